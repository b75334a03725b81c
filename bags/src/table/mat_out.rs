//! A table into a MATLAB file of version 5.

use super::mat_format::{CLASS_TEXT, CLASSES, COMPRESSED, DOUBLE, FLAG_LOGICAL, HEADER, INT8, INT32, MATRIX, NAMES, UINT16, UINT32};
use super::types::{Cells, Table};
use crate::BagError;
use crate::number_type::NumberType;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::collections::HashSet;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Longest name that MATLAB takes.
const LONGEST_NAME: usize = 63;

/// Writes the columns of numbers as standing vectors, each with its class. Headings that are no names for MATLAB are changed, and reported; the file lists
/// them in `backdrive_names`, from which an import restores them.
pub(crate) fn write(table: &Table, out: &Path) -> Result<Vec<String>, BagError> {
    let file = File::create_new(out).map_err(BagError::create(out))?;
    let failed = |error: std::io::Error| BagError::Write { name: out.display().to_string(), what: error.to_string() };
    let mut sink = BufWriter::new(file);
    let mut header = format!("MATLAB 5.0 MAT-file, written by backdrive {}", env!("CARGO_PKG_VERSION")).into_bytes();
    header.resize(HEADER - 12, b' ');
    header.resize(HEADER - 4, 0);
    header.extend([0, 1]); // version 1, lower byte first
    header.extend(b"IM");
    sink.write_all(&header).map_err(failed)?;
    let (mut taken, mut renamed) = (HashSet::from([NAMES.to_owned()]), Vec::new());
    for column in &table.columns {
        let Cells::Numbers(values, of) = &column.cells else { continue };
        let name = name_for(&column.name, &taken);
        taken.insert(name.clone());
        if name != column.name {
            renamed.push((name.clone(), column.name.clone()));
        }
        let array = numbers(&name, values, *of).ok_or_else(|| {
            let what = format!(
                "column {:?} is longer than the 4 GiB that a MATLAB file of version 5 has for a variable; write parquet",
                column.name
            );
            BagError::File { path: out.to_owned(), what }
        })?;
        sink.write_all(&compressed(&array).map_err(failed)?).map_err(failed)?;
    }
    if !renamed.is_empty() {
        let lines: Vec<Vec<u16>> = renamed.iter().map(|(name, heading)| format!("{name} = {heading}").encode_utf16().collect()).collect();
        sink.write_all(&compressed(&text(NAMES, &lines)).map_err(failed)?).map_err(failed)?;
    }
    sink.flush().map_err(failed)?;
    Ok(match renamed.as_slice() {
        [] => Vec::new(),
        [(name, heading)] => vec![format!("{heading:?} is renamed to {name}, because MATLAB accepts only letters, digits and _")],
        [(name, heading), ..] => vec![format!(
            "{} columns are renamed, because MATLAB accepts only letters, digits and _: {heading:?} is now {name}; {NAMES} in the file \
                keeps the headings",
            renamed.len()
        )],
    })
}

/// The heading, or what of it MATLAB takes: a letter, then letters, digits and `_`.
fn name_for(heading: &str, taken: &HashSet<String>) -> String {
    let plain: String = heading.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let mut name = plain.trim_start_matches('_').to_owned();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.insert_str(0, "x_");
    }
    name.truncate(LONGEST_NAME);
    let numbered = |number: usize| {
        let end = format!("_{number}");
        format!("{}{end}", &name[..name.len().min(LONGEST_NAME - end.len())])
    };
    match taken.contains(&name) {
        false => name,
        true => (2..).map(numbered).find(|name| !taken.contains(name)).unwrap_or(name),
    }
}

/// An array element of numbers, a standing vector; `None` where it is too long.
fn numbers(name: &str, values: &[f64], of: NumberType) -> Option<Vec<u8>> {
    // A logical array is one of bytes, marked as such.
    let (kind, flags) = if of == NumberType::Bool { (NumberType::Uint8, FLAG_LOGICAL) } else { (of, 0) };
    let (class, _, stored) = CLASSES.into_iter().find(|(_, number, _)| *number == kind).unwrap_or((6, NumberType::Double, DOUBLE));
    let mut data = Vec::with_capacity(values.len() * 8);
    for value in values {
        match kind {
            NumberType::Double => data.extend(value.to_le_bytes()),
            NumberType::Single => data.extend((*value as f32).to_le_bytes()),
            NumberType::Int8 => data.extend((*value as i8).to_le_bytes()),
            NumberType::Int16 => data.extend((*value as i16).to_le_bytes()),
            NumberType::Int32 => data.extend((*value as i32).to_le_bytes()),
            NumberType::Int64 => data.extend((*value as i64).to_le_bytes()),
            NumberType::Uint8 | NumberType::Bool => data.extend((*value as u8).to_le_bytes()),
            NumberType::Uint16 => data.extend((*value as u16).to_le_bytes()),
            NumberType::Uint32 => data.extend((*value as u32).to_le_bytes()),
            NumberType::Uint64 => data.extend((*value as u64).to_le_bytes()),
        }
    }
    let rows = i32::try_from(values.len()).ok()?;
    u32::try_from(data.len() + 1024).ok()?;
    Some(array(name, class, flags, [rows, 1], stored, &data))
}

/// An array element of text, a line a row.
fn text(name: &str, lines: &[Vec<u16>]) -> Vec<u8> {
    let wide = lines.iter().map(Vec::len).max().unwrap_or(0);
    let at = |row: usize, column: usize| lines[row].get(column).copied().unwrap_or(u16::from(b' '));
    let data: Vec<u8> = (0..wide).flat_map(|column| (0..lines.len()).flat_map(move |row| at(row, column).to_le_bytes())).collect();
    array(name, CLASS_TEXT, 0, [lines.len() as i32, wide as i32], UINT16, &data)
}

fn array(name: &str, class: u8, flags: u8, size: [i32; 2], stored: u32, data: &[u8]) -> Vec<u8> {
    let mut inside = Vec::with_capacity(data.len() + 128);
    element(&mut inside, UINT32, &[class, flags, 0, 0, 0, 0, 0, 0]);
    element(&mut inside, INT32, &[size[0].to_le_bytes(), size[1].to_le_bytes()].concat());
    element(&mut inside, INT8, name.as_bytes());
    element(&mut inside, stored, data);
    let mut whole = Vec::with_capacity(inside.len() + 8);
    element(&mut whole, MATRIX, &inside);
    whole
}

/// A tag, the data, and zeros up to a multiple of eight.
fn element(into: &mut Vec<u8>, kind: u32, data: &[u8]) {
    into.extend(kind.to_le_bytes());
    into.extend((data.len() as u32).to_le_bytes());
    into.extend(data);
    into.resize(into.len().next_multiple_of(8), 0);
}

fn compressed(array: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut packer = ZlibEncoder::new(Vec::new(), Compression::default());
    packer.write_all(array)?;
    let packed = packer.finish()?;
    let mut whole = Vec::with_capacity(packed.len() + 8);
    whole.extend(COMPRESSED.to_le_bytes());
    whole.extend((packed.len() as u32).to_le_bytes());
    whole.extend(packed);
    Ok(whole)
}
