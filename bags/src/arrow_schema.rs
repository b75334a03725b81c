//! Content of an Arrow schema in a parquet file that the file's own types lack: which integers are durations. Of the schema (a FlatBuffer, in base64) no more
//! is read.

use std::collections::HashMap;

/// Places in the tables of Arrow's `Message.fbs` and `Schema.fbs`, and the number of the type.
const MESSAGE_HEADER: usize = 2;
const SCHEMA_FIELDS: usize = 1;
const FIELD_NAME: usize = 0;
const FIELD_KIND: usize = 2;
const FIELD_TYPE: usize = 3;
const DURATION_UNIT: usize = 0;
const DURATION: u8 = 18;

/// How many of its units make a second, of each column that is a duration; nothing where the text is no such schema.
pub(crate) fn durations(text: &str) -> HashMap<String, f64> {
    let bytes = base64(text).unwrap_or_default();
    // Before the message stand a mark and its length.
    bytes.get(8..).and_then(found).unwrap_or_default()
}

fn found(bytes: &[u8]) -> Option<HashMap<String, f64>> {
    let flat = Flat { bytes };
    let schema = flat.field(flat.behind(0)?, MESSAGE_HEADER).and_then(|at| flat.behind(at))?;
    let fields = flat.field(schema, SCHEMA_FIELDS).and_then(|at| flat.behind(at))?;
    let count = usize::try_from(flat.number(fields, 4)?).ok()?;
    let mut durations = HashMap::new();
    for index in 0..count {
        let field = flat.behind(fields + 4 + 4 * index)?;
        let kind = flat.field(field, FIELD_KIND).and_then(|at| bytes.get(at));
        if kind != Some(&DURATION) {
            continue;
        }
        let name = flat.field(field, FIELD_NAME).and_then(|at| flat.behind(at))?;
        let length = usize::try_from(flat.number(name, 4)?).ok()?;
        let name = String::from_utf8_lossy(bytes.get(name + 4..(name + 4).checked_add(length)?)?).into_owned();
        let unit = flat.field(field, FIELD_TYPE).and_then(|at| flat.behind(at)).and_then(|of| flat.field(of, DURATION_UNIT));
        let unit = unit.and_then(|at| flat.number(at, 2)).unwrap_or(1); // without one, ms
        durations.insert(name, 1000_f64.powi(i32::try_from(unit.min(3)).ok()?));
    }
    Some(durations)
}

/// A FlatBuffer: tables that point at their fields by offsets.
struct Flat<'a> {
    bytes: &'a [u8],
}

impl Flat<'_> {
    /// A number without a sign, lower byte first.
    fn number(&self, at: usize, size: usize) -> Option<u64> {
        let bytes = self.bytes.get(at..at.checked_add(size)?)?;
        Some(bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
    }

    /// Where the offset at a place points.
    fn behind(&self, at: usize) -> Option<usize> {
        at.checked_add(usize::try_from(self.number(at, 4)?).ok()?)
    }

    /// Where a field of a table is; `None` where it has its default.
    fn field(&self, table: usize, index: usize) -> Option<usize> {
        let back = i64::try_from(self.number(table, 4)?).ok()?;
        // The offset of the list of fields has a sign, and is taken off.
        let list = i64::try_from(table).ok()? - i64::from(back as u32 as i32);
        let list = usize::try_from(list).ok()?;
        let place = 4 + 2 * index;
        let size = usize::try_from(self.number(list, 2)?).ok()?;
        let offset = if place + 2 <= size { usize::try_from(self.number(list + place, 2)?).ok()? } else { 0 };
        if offset == 0 { None } else { table.checked_add(offset) }
    }
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    for letter in text.bytes().filter(|letter| *letter != b'=') {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        (bits, count) = (bits << 6 | u32::from(value), count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::{base64, durations};

    #[test]
    fn what_is_no_schema_has_no_durations() {
        // RFC 4648, section 10.
        assert_eq!(base64("Zm9vYmE="), Some(b"fooba".to_vec()));
        assert_eq!(base64("Zm9v!"), None);
        let odd = ["", "AAAA", "////////////////////////////////", "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"];
        assert!(odd.iter().all(|text| durations(text).is_empty()));
    }
}
