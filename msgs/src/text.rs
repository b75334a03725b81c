//! Short text of fixed size.

use iceoryx2::prelude::ZeroCopySend;

/// UTF-8 text of at most `N` bytes, padded with zeros.
#[derive(Clone, Copy, PartialEq, Eq, ZeroCopySend)]
#[type_name("backdrive/Text")]
#[repr(C)]
pub struct Text<const N: usize> {
    bytes: [u8; N],
}

impl<const N: usize> Text<N> {
    /// Takes what fits of `text`, cut at a character boundary.
    pub fn new(text: &str) -> Text<N> {
        let mut end = text.len().min(N);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        let mut bytes = [0; N];
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Text { bytes }
    }

    /// The text; what another process filled with something that is not UTF-8 reads as empty.
    pub fn as_str(&self) -> &str {
        let end = self.bytes.iter().position(|b| *b == 0).unwrap_or(N);
        std::str::from_utf8(&self.bytes[..end]).unwrap_or("")
    }
}

impl<const N: usize> std::fmt::Debug for Text<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}

impl<const N: usize> std::fmt::Display for Text<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}
