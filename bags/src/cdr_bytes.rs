//! The values in a CDR payload, one after the other.

/// What a field is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Type {
    Bool,
    Unsigned(u8),
    Signed(u8),
    Float(u8),
    Text,
    WideText,
    /// Index into the types of a schema.
    Message(usize),
}

/// How many of it there are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Count {
    One,
    Array(usize),
    Sequence,
}

/// A place in a CDR payload.
pub(crate) struct Cdr<'a> {
    bytes: &'a [u8],
    pub(crate) at: usize,
    big_endian: bool,
}

impl<'a> Cdr<'a> {
    pub(crate) fn new(payload: &'a [u8]) -> Result<Cdr<'a>, String> {
        match payload {
            [0, order @ (0 | 1), _, _, bytes @ ..] => Ok(Cdr { bytes, at: 0, big_endian: *order == 0 }),
            _ => Err(format!("payload starts with {:02x?}, not with a plain CDR header", &payload[..payload.len().min(4)])),
        }
    }

    pub(crate) fn align(&mut self, to: usize) {
        self.at = self.at.next_multiple_of(to);
    }

    pub(crate) fn take(&mut self, len: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(len).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| format!("payload ends at byte {} of its CDR, {len} more are due at {}", self.bytes.len(), self.at))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    pub(crate) fn unsigned(&mut self, size: u8) -> Result<u64, String> {
        self.align(size.into());
        let bytes = self.take(size.into())?;
        let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        Ok(if self.big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) })
    }

    pub(crate) fn signed(&mut self, size: u8) -> Result<i64, String> {
        let unused = 64 - 8 * u32::from(size);
        Ok((self.unsigned(size)? << unused) as i64 >> unused)
    }

    /// `builtin_interfaces/Time`; 32 bits of seconds always fit.
    pub(crate) fn time_ns(&mut self) -> Result<i64, String> {
        let sec = self.signed(4)?;
        Ok(sec * 1_000_000_000 + self.unsigned(4)? as i64)
    }

    pub(crate) fn number(&mut self, of: Type) -> Result<f64, String> {
        Ok(match of {
            Type::Bool => self.unsigned(1)? as f64,
            Type::Unsigned(size) => self.unsigned(size)? as f64,
            Type::Signed(size) => self.signed(size)? as f64,
            Type::Float(4) => f32::from_bits(self.unsigned(4)? as u32).into(),
            Type::Float(_) => f64::from_bits(self.unsigned(8)?),
            Type::Text | Type::WideText | Type::Message(_) => return Err("not a number".to_owned()),
        })
    }

    pub(crate) fn count(&mut self, count: Count) -> Result<usize, String> {
        Ok(match count {
            Count::One => 1,
            Count::Array(len) => len,
            Count::Sequence => self.unsigned(4)? as usize,
        })
    }
}
