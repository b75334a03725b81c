//! Secret keys, and tags that only who has the key can compute: HMAC-SHA-256 (RFC 2104), cut to 128 bits.

use hmac::{Hmac, KeyInit, Mac};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::Sha256;
use std::fmt;

/// Bytes of a tag.
pub const TAG_BYTES: usize = 16;

/// A secret of 256 bits. It is not shown where it is printed for debugging.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl Key {
    /// A fresh one from the system's source of randomness.
    ///
    /// # Errors
    /// The system gives none.
    pub fn fresh() -> Result<Key, String> {
        use rand::TryRng;
        let mut bytes = [0; 32];
        rand::rngs::SysRng.try_fill_bytes(&mut bytes).map_err(|e| format!("the system gives no random numbers: {e}"))?;
        Ok(Key(bytes))
    }

    /// Reads 64 hexadecimal digits; `None` where they are none.
    pub fn from_hex(text: &str) -> Option<Key> {
        let mut bytes = [0; 32];
        from_hex(text, &mut bytes).then_some(Key(bytes))
    }

    /// As 64 hexadecimal digits.
    pub fn to_hex(&self) -> String {
        self.0.iter().map(|b| format!("{b:02x}")).collect()
    }

    /// Another key from this one, for a purpose. Who has that one does not know this one.
    pub fn derive(&self, purpose: &str, parts: &[&str]) -> Key {
        let mut mac = self.mac();
        absorb(&mut mac, purpose.as_bytes());
        parts.iter().for_each(|part| absorb(&mut mac, part.as_bytes()));
        let mut bytes = [0; 32];
        bytes.copy_from_slice(&mac.finalize().into_bytes());
        Key(bytes)
    }

    /// The tag of a few texts, as hexadecimal digits.
    pub fn tag(&self, parts: &[&str]) -> String {
        let mut mac = self.mac();
        parts.iter().for_each(|part| absorb(&mut mac, part.as_bytes()));
        mac.finalize().into_bytes()[..TAG_BYTES].iter().map(|b| format!("{b:02x}")).collect()
    }

    /// Whether `tag` is that of these texts. It takes equally long whatever differs.
    pub fn verifies(&self, parts: &[&str], tag: &str) -> bool {
        let (mut mac, mut bytes) = (self.mac(), [0; TAG_BYTES]);
        parts.iter().for_each(|part| absorb(&mut mac, part.as_bytes()));
        from_hex(tag, &mut bytes) && mac.verify_truncated_left(&bytes).is_ok()
    }

    pub(super) fn mac(&self) -> Hmac<Sha256> {
        // A key of any length is one for HMAC; this arm is never taken.
        Hmac::new_from_slice(&self.0).unwrap_or_else(|_| Hmac::new(&Default::default()))
    }
}

/// With its length before it, so that no two lists of parts are the same bytes.
pub(super) fn absorb(mac: &mut Hmac<Sha256>, part: &[u8]) {
    mac.update(&(part.len() as u64).to_le_bytes());
    mac.update(part);
}

/// Fills `bytes` from exactly as many pairs of lower-case hexadecimal digits.
pub(super) fn from_hex(text: &str, bytes: &mut [u8]) -> bool {
    let digit = |b: u8| match b {
        b'0'..=b'9' => Some(b - b'0'),
        b'a'..=b'f' => Some(b - b'a' + 10),
        _ => None,
    };
    let pairs = text.as_bytes().chunks_exact(2);
    text.len() == 2 * bytes.len()
        && bytes.iter_mut().zip(pairs).all(|(byte, pair)| match (digit(pair[0]), digit(pair[1])) {
            (Some(high), Some(low)) => {
                *byte = high << 4 | low;
                true
            }
            _ => false,
        })
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(not shown)")
    }
}

impl Serialize for Key {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.to_hex())
    }
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Key, D::Error> {
        Key::from_hex(&String::deserialize(deserializer)?).ok_or_else(|| serde::de::Error::custom("a key has 64 hexadecimal digits"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tag_is_hmac_sha_256() {
        // RFC 4231, test case 2, has a shorter key: the same bytes by way of the crate alone.
        let mut mac = Hmac::<Sha256>::new_from_slice(b"Jefe").unwrap();
        mac.update(b"what do ya want for nothing?");
        let hex: String = mac.finalize().into_bytes().iter().map(|b| format!("{b:02x}")).collect();
        assert_eq!(hex, "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
    }

    #[test]
    fn a_tag_is_of_its_key_and_of_these_texts_in_this_division() {
        let (key, other) = (Key::fresh().unwrap(), Key::fresh().unwrap());
        assert_ne!(key, other);
        let tag = key.tag(&["ab", "c"]);
        assert!(key.verifies(&["ab", "c"], &tag));
        assert!(!other.verifies(&["ab", "c"], &tag));
        for parts in [&["a", "bc"][..], &["abc"], &["ab", "c", ""], &["ab"], &[]] {
            assert!(!key.verifies(parts, &tag), "{parts:?}");
        }
        for wrong in ["", &tag[..30], &tag.to_uppercase(), &format!("{tag}00"), "\u{e9}"] {
            assert!(!key.verifies(&["ab", "c"], wrong) || *wrong == tag, "{wrong}");
        }
        assert_ne!(key.derive("a", &["b"]), key.derive("ab", &[]));
    }

    #[test]
    fn a_key_is_written_as_text_and_not_shown() {
        let key = Key::fresh().unwrap();
        assert_eq!(Key::from_hex(&key.to_hex()), Some(key.clone()));
        assert!(!format!("{key:?}").contains(&key.to_hex()[..8]));
        for wrong in ["", "0", &key.to_hex()[1..], &format!("{}g", &key.to_hex()[1..])] {
            assert_eq!(Key::from_hex(wrong), None, "{wrong}");
        }
    }
}
