//! The seal: bytes and their SHA-256.

use crate::truth::{Truth, TruthError};
use sha2::{Digest, Sha256};
use std::fmt::Write;

/// The truth as the bytes of its file and their SHA-256 in hexadecimal, as `sha256sum` prints it.
///
/// The same truth gives the same bytes: keys stand in the order of the fields, numbers in their shortest exact form.
///
/// # Errors
///
/// [`TruthError::Json`], which a truth of finite numbers never meets.
pub fn seal(truth: &Truth) -> Result<(Vec<u8>, String), TruthError> {
    let mut bytes = serde_json::to_vec_pretty(truth)?;
    bytes.push(b'\n');
    let hash = hash(&bytes);
    Ok((bytes, hash))
}

/// SHA-256 of bytes in hexadecimal: a reader who opens the truth later compares it with what was printed.
pub fn hash(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(64);
    for byte in Sha256::digest(bytes) {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
    }
    text
}
