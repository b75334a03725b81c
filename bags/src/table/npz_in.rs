//! A table out of a NumPy file: an archive of named arrays (`.npz`), or one array (`.npy`).

use super::arrays;
use super::mapping::ImportOptions;
use super::mat_array::{Array, Held};
use super::types::Table;
use super::zip_members::{Member, members};
use crate::BagError;
use crate::number_type::{LARGEST_WHOLE, NumberType};
use backdrive_plant::input_file;
use std::io::Read;
use std::path::Path;

/// First bytes of an array.
pub(super) const MAGIC: &[u8] = b"\x93NUMPY";

/// Most bytes of the file itself.
const MOST_PACKED: u64 = 1 << 30;

/// Whether an archive holds arrays only, as `numpy.savez` writes it; `false` for what is no archive.
pub(super) fn is_npz(path: &Path) -> bool {
    let is_npy = |member: &Member| member.name.ends_with(".npy");
    whole(path).is_ok_and(|file| members(&file).is_ok_and(|members| !members.is_empty() && members.iter().all(is_npy)))
}

fn whole(path: &Path) -> Result<Vec<u8>, BagError> {
    let mut bytes = Vec::new();
    let file = input_file::open(path).map_err(BagError::io(path))?;
    file.take(MOST_PACKED + 1).read_to_end(&mut bytes).map_err(BagError::io(path))?;
    match bytes.len() as u64 > MOST_PACKED {
        true => Err(BagError::File {
            path: path.to_owned(),
            what: format!("is larger than {} MB, which is the limit; save a piece of it", MOST_PACKED >> 20),
        }),
        false => Ok(bytes),
    }
}

/// Reads the arrays of one and of two dimensions that have as many rows as the times; one of two becomes columns `NAME[0]`, `NAME[1]` and so on.
pub(super) fn read(path: &Path, options: &ImportOptions) -> Result<Table, BagError> {
    let wrong = |what: String| BagError::File { path: path.to_owned(), what };
    let file = whole(path)?;
    if file.starts_with(MAGIC) {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let array = array(name, &file).map_err(wrong)?;
        return arrays::table(vec![array], options).map_err(wrong);
    }
    let (mut found, mut left) = (Vec::new(), options.most_bytes);
    for member in members(&file).map_err(wrong)? {
        let name = member.name.trim_end_matches(".npy");
        let inside = |what: String| wrong(format!("{name}: {what}"));
        let bytes = member.unpack(left).map_err(inside)?;
        left = left.saturating_sub(bytes.len() as u64);
        found.push(array(name.to_owned(), &bytes).map_err(inside)?);
    }
    arrays::table(found, options).map_err(wrong)
}

/// The array of a member: magic bytes, version, a header that is a dictionary of Python, then the values (NumPy, "A Simple File Format for NumPy Arrays").
fn array(name: String, bytes: &[u8]) -> Result<Array, String> {
    let cut = || "ends within its header; it was cut off or is damaged".to_owned();
    if !bytes.starts_with(MAGIC) {
        return Err("does not start with the bytes of a NumPy array".to_owned());
    }
    let (from, length): (usize, usize) = match bytes.get(6).ok_or_else(cut)? {
        1 => (10, bytes.get(8..10).ok_or_else(cut)?.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte))),
        2 | 3 => (12, bytes.get(8..12).ok_or_else(cut)?.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte))),
        version => return Err(format!("is of version {version} of the format; versions 1 to 3 are read")),
    };
    let header = bytes.get(from..from.saturating_add(length)).ok_or_else(cut)?;
    let header = String::from_utf8_lossy(header);
    let said = |key: &str| {
        header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start()).ok_or_else(|| format!("its header has no {key:?}"))
    };
    let is_fortran = said("fortran_order")?.starts_with("True");
    let shape = said("shape")?.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|(shape, _)| shape);
    let shape = shape.ok_or("its header has no shape")?;
    let shape: Vec<usize> = shape
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty())
        .map(|side| side.parse().map_err(|_| format!("its shape ({shape}) is none")))
        .collect::<Result<_, _>>()?;
    // MATLAB's way: a vector has two sides, values stand column by column.
    let size = match shape[..] {
        [] => vec![1, 1],
        [rows] => vec![rows, 1],
        _ => shape.clone(),
    };
    let Some(kind) = said("descr")?.strip_prefix('\'').and_then(|rest| rest.split_once('\'')).map(|(kind, _)| kind) else {
        return Ok(Array { name, size, held: Held::Other("records of several fields") });
    };
    let Some((of, width)) = type_of(kind) else {
        let held = Held::Other(match kind.trim_start_matches(['<', '>', '|', '=']).chars().next() {
            Some('O') => "Python objects",
            Some('c') => "complex numbers",
            Some('U' | 'S') => "text",
            Some('M' | 'm') => "dates or durations",
            _ => "of a type that is not read",
        });
        return Ok(Array { name, size, held });
    };
    let count = size.iter().try_fold(1_usize, |count, side| count.checked_mul(*side)).and_then(|count| count.checked_mul(width));
    let data = bytes.get(from + length..).unwrap_or_default();
    let data = count
        .and_then(|count| data.get(..count))
        .ok_or_else(|| format!("its shape is ({}), and {} bytes of values are there", join(&shape), data.len()))?;
    let is_big = kind.starts_with('>');
    let values: Vec<Value> =
        data.chunks_exact(width).map(|bytes| value(bytes, kind.trim_start_matches(['<', '>', '|', '=']), is_big)).collect();
    let values = match size[..] {
        [rows, columns] if !is_fortran && rows > 1 && columns > 1 => {
            (0..columns).flat_map(|column| values.iter().skip(column).step_by(columns).copied()).collect()
        }
        _ => values,
    };
    let is_large = |value: &Value| matches!(value, Value::Whole(whole) if whole.unsigned_abs() as f64 > LARGEST_WHOLE);
    let held = match values.iter().any(is_large) {
        true => Held::Whole(values.into_iter().map(|value| if let Value::Whole(whole) = value { whole } else { 0 }).collect(), of),
        false => Held::Numbers(values.into_iter().map(Value::number).collect(), of),
    };
    Ok(Array { name, size, held })
}

fn join(shape: &[usize]) -> String {
    shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

/// What the numbers of a type are, and their bytes. Half precision is kept as single.
fn type_of(kind: &str) -> Option<(NumberType, usize)> {
    Some(match kind.trim_start_matches(['<', '>', '|', '=']) {
        "f8" => (NumberType::Double, 8),
        "f4" => (NumberType::Single, 4),
        "f2" => (NumberType::Single, 2),
        "i1" => (NumberType::Int8, 1),
        "i2" => (NumberType::Int16, 2),
        "i4" => (NumberType::Int32, 4),
        "i8" => (NumberType::Int64, 8),
        "u1" => (NumberType::Uint8, 1),
        "u2" => (NumberType::Uint16, 2),
        "u4" => (NumberType::Uint32, 4),
        "u8" => (NumberType::Uint64, 8),
        "b1" => (NumberType::Bool, 1),
        _ => return None,
    })
}

#[derive(Clone, Copy)]
enum Value {
    Float(f64),
    Whole(i64),
}

impl Value {
    fn number(self) -> f64 {
        match self {
            Value::Float(value) => value,
            Value::Whole(value) => value as f64,
        }
    }
}

fn value(bytes: &[u8], kind: &str, is_big: bool) -> Value {
    let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    let bits = if is_big { bytes.iter().fold(0, join) } else { bytes.iter().rev().fold(0, join) };
    match kind {
        "f8" => Value::Float(f64::from_bits(bits)),
        "f4" => Value::Float(f32::from_bits(bits as u32).into()),
        "f2" => Value::Float(half(bits as u16)),
        "i1" => Value::Whole((bits as i8).into()),
        "i2" => Value::Whole((bits as i16).into()),
        "i4" => Value::Whole((bits as i32).into()),
        "i8" => Value::Whole(bits as i64),
        _ => Value::Whole(i64::try_from(bits).unwrap_or(i64::MAX)),
    }
}

/// IEEE 754 half precision.
fn half(bits: u16) -> f64 {
    let (sign, exponent, fraction) = (if bits >> 15 == 1 { -1.0 } else { 1.0 }, i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    sign * match exponent {
        0 => fraction * 2_f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction / 1024.0) * 2_f64.powi(exponent - 15),
    }
}
