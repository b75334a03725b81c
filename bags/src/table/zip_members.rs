//! The members of a zip archive, stored or deflated (PKWARE, APPNOTE.TXT 4.3), by the directory at its end.
//!
//! Two kinds of records are all that an archive of NumPy has; a crate for archives would bring seven others along.

use flate2::read::DeflateDecoder;
use std::io::Read;

const END: &[u8] = b"PK\x05\x06";
const ENTRY: &[u8] = b"PK\x01\x02";
const LOCAL: &[u8] = b"PK\x03\x04";
/// Bytes of the record at the end, whose comment is limited by a 16-bit length.
const END_LENGTH: usize = 22;
/// What a size or a place is where it stands in a record for files of 4 GB and more.
const ELSEWHERE: usize = u32::MAX as usize;

/// A member.
pub(super) struct Member<'a> {
    pub(super) name: String,
    packed: &'a [u8],
    is_deflated: bool,
    crc: u32,
}

/// The members of an archive, in the order of its directory.
///
/// # Errors
/// A sentence: it is damaged, encrypted, or packed in another way.
pub(super) fn members(file: &[u8]) -> Result<Vec<Member<'_>>, String> {
    let from = file.len().saturating_sub(END_LENGTH + usize::from(u16::MAX));
    let last = file.get(from..).unwrap_or_default();
    let end = (0..last.len()).rev().find(|at| last[*at..].starts_with(END)).map(|at| from + at);
    let end = end.ok_or("is an archive without its directory; it was cut off")?;
    let count = number(file, end + 10, 2)?;
    let mut at = number(file, end + 16, 4)?;
    let mut found = Vec::new();
    for _ in 0..count {
        let entry = file
            .get(at..)
            .filter(|entry| entry.starts_with(ENTRY))
            .ok_or_else(|| format!("byte {at}: expected an entry of its directory; it is damaged"))?;
        let (flags, method, size, place) = (number(entry, 8, 2)?, number(entry, 10, 2)?, number(entry, 20, 4)?, number(entry, 42, 4)?);
        let (length, extra, comment) = (number(entry, 28, 2)?, number(entry, 30, 2)?, number(entry, 32, 2)?);
        let name = String::from_utf8_lossy(entry.get(46..46 + length).ok_or_else(cut)?).into_owned();
        if size == ELSEWHERE || place == ELSEWHERE {
            return Err(format!("{name}: has 4 GB or more, which is beyond the limit; save a piece of it"));
        }
        if flags & 1 != 0 || (method != 0 && method != 8) {
            return Err(format!("{name}: is encrypted or packed in a way that is not read; save it again with numpy.savez"));
        }
        let local = file
            .get(place..)
            .filter(|local| local.starts_with(LOCAL))
            .ok_or_else(|| format!("{name}: is not at the offset in the directory; the file is damaged"))?;
        let data = 30 + number(local, 26, 2)? + number(local, 28, 2)?;
        let packed = local.get(data..data + size).ok_or_else(cut)?;
        found.push(Member { crc: number(entry, 16, 4)? as u32, name, packed, is_deflated: method == 8 });
        at += 46 + length + extra + comment;
    }
    Ok(found)
}

impl Member<'_> {
    /// Its bytes, if they are no more than `most`.
    ///
    /// # Errors
    /// A sentence: there are more, or it is damaged.
    pub(super) fn unpack(&self, most: u64) -> Result<Vec<u8>, String> {
        let mut bytes = Vec::new();
        let read = match self.is_deflated {
            true => DeflateDecoder::new(self.packed).take(most + 1).read_to_end(&mut bytes),
            false => self.packed.take(most + 1).read_to_end(&mut bytes),
        };
        read.map_err(|error| format!("cannot be unpacked: {error}"))?;
        if bytes.len() as u64 > most {
            return Err(format!(
                "is larger than the remaining limit for the file, {} MiB; split it, or allow more with --memory (MiB)",
                most >> 20
            ));
        }
        match crc32fast::hash(&bytes) == self.crc {
            true => Ok(bytes),
            false => Err("does not agree with its checksum; it is damaged".to_owned()),
        }
    }
}

fn cut() -> String {
    "ends within a member; it was cut off".to_owned()
}

fn number(bytes: &[u8], at: usize, size: usize) -> Result<usize, String> {
    let bytes = bytes.get(at..at + size).ok_or_else(cut)?;
    Ok(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
}
