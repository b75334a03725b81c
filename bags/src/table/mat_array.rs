//! The arrays of a MAT file of version 5: their tags, sizes and values, in either byte order, compressed or not.

use super::mat_format::{
    CLASS_OPAQUE, CLASS_STRUCTURE, CLASS_TEXT, CLASSES, COMPRESSED, DOUBLE, FLAG_COMPLEX, FLAG_LOGICAL, HEADER, INT8, INT16, INT32, INT64,
    MATRIX, SINGLE, UINT8, UINT16, UINT32, UINT64, UTF8, UTF16,
};
use crate::memory::Memory;
use crate::number_type::{LARGEST_WHOLE, NumberType};
use flate2::read::ZlibDecoder;
use std::io::Read;

/// A variable, or a field of a structure.
pub(crate) struct Array {
    pub(crate) name: String,
    /// Rows, columns, and so on; values stand column by column.
    pub(crate) size: Vec<usize>,
    pub(crate) held: Held,
}

/// What an array holds.
pub(crate) enum Held {
    Numbers(Vec<f64>, NumberType),
    /// Whole numbers of which some are beyond 2⁵³.
    Whole(Vec<i64>, NumberType),
    Text(String),
    /// The fields of one structure.
    Fields(Vec<Array>),
    /// Something else, in the plural.
    Other(&'static str),
}

/// Structures inside structures beyond this are damage.
const MOST_NESTED: usize = 8;

/// The variables of a file, which begins with its header.
///
/// # Errors
/// A sentence with the byte.
pub(crate) fn variables(file: &[u8], memory: &Memory) -> Result<Vec<Array>, String> {
    let header =
        file.get(..HEADER).ok_or_else(|| format!("ends at byte {}, within its header of {HEADER} bytes; it was cut off", file.len()))?;
    let big_endian = match &header[126..128] {
        b"IM" => false,
        b"MI" => true,
        other => return Err(format!("byte 126: expected IM or MI, which give the byte order, found {other:02x?}")),
    };
    let version = if big_endian { header[124] } else { header[125] };
    if version != 1 {
        return Err(format!("byte 124: is of version {version}, expected 1; save it again with save(..., '-v7')"));
    }
    let mut bytes = Bytes { bytes: file, at: HEADER, from: 0, big_endian, memory };
    let mut found = Vec::new();
    while bytes.at < file.len() {
        let (start, kind, data) = bytes.element()?;
        let inner = match kind {
            MATRIX => data.array(0)?,
            COMPRESSED => {
                let mut plain = Vec::new();
                let read = ZlibDecoder::new(data.bytes).take(memory.left().saturating_add(1)).read_to_end(&mut plain);
                read.map_err(|error| format!("byte {start}: a compressed variable cannot be unpacked: {error}"))?;
                if plain.len() as u64 > memory.left() {
                    return Err(format!("byte {start}: a compressed variable {}", memory.refuse(plain.len() as u64)));
                }
                let within = |what: String| format!("byte {start}, a compressed variable, unpacked {what}");
                let mut plain = Bytes { bytes: &plain, at: 0, from: 0, big_endian, memory };
                match plain.element().map_err(within)? {
                    (_, MATRIX, data) => data.array(0).map_err(within)?,
                    (_, kind, _) => return Err(within(format!("byte 0: is an element of type {kind}, expected an array, {MATRIX}"))),
                }
            }
            _ => continue, // not a variable
        };
        found.push(inner);
    }
    Ok(found)
}

/// A place among bytes; `from` is where they begin in what encloses them.
struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    from: usize,
    big_endian: bool,
    memory: &'a Memory,
}

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| {
            let (at, there) = (self.from + self.at, self.bytes.len().saturating_sub(self.at));
            format!("byte {at}: {count} bytes are due, {there} are there; it was cut off or is damaged")
        })?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn word(&mut self) -> Result<u32, String> {
        let big_endian = self.big_endian;
        let bytes = self.take(4)?;
        Ok(number(bytes, big_endian) as u32)
    }

    /// The next element: where it starts, its type, its data.
    fn element(&mut self) -> Result<(usize, u32, Bytes<'a>), String> {
        let start = self.from + self.at;
        let first = self.word()?;
        // A small element has its size in the upper half of the type, and its data in place of the size.
        let (kind, count) = if first >> 16 == 0 { (first, self.word()? as usize) } else { (first & 0xffff, (first >> 16) as usize) };
        let small = first >> 16 != 0;
        if small && count > 4 {
            return Err(format!("byte {start}: a small element of {count} bytes, expected at most 4; it is damaged"));
        }
        let from = self.from + self.at;
        let data = self.take(count)?;
        let fill = match (small, kind) {
            (true, _) => 4 - count,
            (false, COMPRESSED) => 0,
            (false, _) => count.next_multiple_of(8) - count,
        };
        // The last element of a file need not be filled up.
        self.at = (self.at + fill).min(self.bytes.len());
        Ok((start, kind, Bytes { bytes: data, at: 0, from, big_endian: self.big_endian, memory: self.memory }))
    }

    /// The array that an element of type [`MATRIX`] holds.
    fn array(mut self, nested: usize) -> Result<Array, String> {
        if nested > MOST_NESTED {
            return Err(format!("byte {}: more than {MOST_NESTED} structures inside each other", self.from));
        }
        if self.bytes.is_empty() {
            return Ok(Array { name: String::new(), size: vec![0, 0], held: Held::Numbers(Vec::new(), NumberType::Double) });
        }
        let (start, _, mut flags) = self.element()?;
        let flags = flags.word()?;
        let (class, marks) = (flags as u8, (flags >> 8) as u8);
        if class == CLASS_OPAQUE {
            // It has no size; its content is not documented.
            let (_, _, name) = self.element()?;
            let name = String::from_utf8_lossy(name.bytes).into_owned();
            return Ok(Array { name, size: Vec::new(), held: Held::Other("an object such as a table, a string or a date") });
        }
        let (_, kind, size) = self.element()?;
        let size = size.numbers(kind)?;
        let size: Vec<usize> = size.whole().iter().map(|side| usize::try_from(*side).unwrap_or(0)).collect();
        let count = size.iter().try_fold(1_usize, |count, side| count.checked_mul(*side)).filter(|_| size.len() >= 2);
        let count = count.ok_or_else(|| format!("byte {start}: an array of size {size:?}; it is damaged"))?;
        let (_, _, name) = self.element()?;
        let name = String::from_utf8_lossy(name.bytes).into_owned();
        let held = if let Some((_, of, _)) = CLASSES.iter().find(|(number, _, _)| *number == class) {
            let (start, kind, data) = self.element()?;
            let values = data.numbers(kind)?;
            if values.count() != count {
                return Err(format!(
                    "byte {start}: {} values of {name:?}, whose size {size:?} makes {count}; it is damaged",
                    values.count()
                ));
            }
            match marks & FLAG_COMPLEX != 0 {
                true => Held::Other("complex numbers"),
                false => values.held(if marks & FLAG_LOGICAL != 0 { NumberType::Bool } else { *of }),
            }
        } else if class == CLASS_TEXT {
            let (_, kind, data) = self.element()?;
            Held::Text(data.text(kind, &size)?)
        } else if class == CLASS_STRUCTURE && count == 1 {
            Held::Fields(self.fields(nested)?)
        } else {
            Held::Other(match class {
                1 => "cells",
                CLASS_STRUCTURE => "an array of structures",
                5 => "a sparse matrix",
                _ => "an object",
            })
        };
        Ok(Array { name, size, held })
    }

    fn fields(&mut self, nested: usize) -> Result<Vec<Array>, String> {
        let (start, kind, length) = self.element()?;
        let length = length.numbers(kind)?.whole().first().and_then(|length| usize::try_from(*length).ok()).filter(|length| *length > 0);
        let length = length.ok_or_else(|| format!("byte {start}: the names of fields have no length; it is damaged"))?;
        let (_, _, names) = self.element()?;
        let mut fields = Vec::new();
        for name in names.bytes.chunks(length) {
            let (_, kind, data) = self.element()?;
            if kind != MATRIX {
                return Err(format!("byte {}: an element of type {kind}, expected the array of a field, {MATRIX}", data.from));
            }
            let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
            fields.push(Array { name: String::from_utf8_lossy(name).into_owned(), ..data.array(nested + 1)? });
        }
        Ok(fields)
    }

    /// Values as they are stored, which may be smaller than the class of the array: 1.0, 2.0 as bytes.
    fn numbers(&self, kind: u32) -> Result<Stored, String> {
        // Numbers of one byte become eight.
        let size = match kind {
            INT8 | UINT8 => 1,
            INT16 | UINT16 => 2,
            INT32 | UINT32 | SINGLE => 4,
            _ => 8,
        };
        self.memory.take_numbers((self.bytes.len() / size) as u64).map_err(|what| format!("byte {}: a variable {what}", self.from))?;
        let floats = |size: usize, value: fn(u64) -> f64| {
            Stored::Floats(self.bytes.chunks_exact(size).map(|bytes| value(number(bytes, self.big_endian))).collect())
        };
        let whole = |size: usize, value: fn(u64) -> i64| {
            Stored::Whole(self.bytes.chunks_exact(size).map(|bytes| value(number(bytes, self.big_endian))).collect())
        };
        Ok(match kind {
            INT8 => whole(1, |bits| (bits as i8).into()),
            UINT8 => whole(1, |bits| (bits as u8).into()),
            INT16 => whole(2, |bits| (bits as i16).into()),
            UINT16 => whole(2, |bits| (bits as u16).into()),
            INT32 => whole(4, |bits| (bits as i32).into()),
            UINT32 => whole(4, |bits| (bits as u32).into()),
            INT64 => whole(8, |bits| bits as i64),
            UINT64 => whole(8, |bits| i64::try_from(bits).unwrap_or(i64::MAX)),
            SINGLE => floats(4, |bits| f32::from_bits(bits as u32).into()),
            DOUBLE => floats(8, f64::from_bits),
            other => return Err(format!("byte {}: an element of type {other}, expected numbers", self.from)),
        })
    }

    /// Text row by row, rows parted by line feeds; it stands column by column.
    fn text(&self, kind: u32, size: &[usize]) -> Result<String, String> {
        let units: Vec<u16> = match kind {
            UTF8 => String::from_utf8_lossy(self.bytes).encode_utf16().collect(),
            UTF16 => self.bytes.chunks_exact(2).map(|bytes| number(bytes, self.big_endian) as u16).collect(),
            other => self.numbers(other)?.whole().iter().map(|unit| *unit as u16).collect(),
        };
        let rows = size.first().copied().unwrap_or(0).min(units.len());
        let row = |row: usize| String::from_utf16_lossy(&units.iter().skip(row).step_by(rows.max(1)).copied().collect::<Vec<_>>());
        Ok((0..rows).map(row).collect::<Vec<_>>().join("\n"))
    }
}

/// Values as they are stored.
enum Stored {
    Floats(Vec<f64>),
    Whole(Vec<i64>),
}

impl Stored {
    fn count(&self) -> usize {
        match self {
            Stored::Floats(values) => values.len(),
            Stored::Whole(values) => values.len(),
        }
    }

    fn whole(&self) -> &[i64] {
        match self {
            Stored::Floats(_) => &[],
            Stored::Whole(values) => values,
        }
    }

    fn held(self, of: NumberType) -> Held {
        match self {
            Stored::Floats(values) => Held::Numbers(values, of),
            Stored::Whole(values) if values.iter().all(|value| value.unsigned_abs() as f64 <= LARGEST_WHOLE) => {
                Held::Numbers(values.into_iter().map(|value| value as f64).collect(), of)
            }
            Stored::Whole(values) => Held::Whole(values, of),
        }
    }
}

fn number(bytes: &[u8], big_endian: bool) -> u64 {
    let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    if big_endian { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) }
}
