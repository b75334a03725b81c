//! A table out of a MATLAB file.

use super::mapping::ImportOptions;
use super::mat_array::{Array, Held, variables};
use super::mat_format::NAMES;
use super::types::{Cells, Column, Table};
use crate::BagError;
use crate::memory::Memory;
use crate::number_type::NumberType;
use std::collections::HashMap;
use std::path::Path;

/// Reads the vectors and matrices of numbers that have as many rows as the vector of times; a matrix becomes columns `NAME[0]`, `NAME[1]` and so on.
pub(crate) fn read(path: &Path, options: &ImportOptions) -> Result<Table, BagError> {
    let wrong = |what: String| BagError::File { path: path.to_owned(), what };
    let file = backdrive_plant::input_file::read(path).map_err(BagError::io(path))?;
    let mut arrays = variables(&file, &Memory::new(options.most_bytes)).map_err(wrong)?;
    let names = names(&arrays);
    // What objects hold stands at the end, without a name.
    arrays.retain(|array| array.name != NAMES && !array.name.is_empty());
    if let Some(variable) = &options.variable {
        let there = || arrays.iter().map(|array| array.name.clone()).collect::<Vec<_>>().join(", ");
        match arrays.iter().position(|array| array.name == *variable) {
            Some(place) => match arrays.swap_remove(place).held {
                Held::Fields(fields) => arrays = fields,
                _ => return Err(wrong(format!("{variable}: is no structure with fields"))),
            },
            None => return Err(wrong(format!("{variable}: there is none; there are {}", there()))),
        }
    }
    for array in &mut arrays {
        if let Some(heading) = names.get(&array.name) {
            array.name.clone_from(heading);
        }
    }
    let Some(rows) = arrays.iter().find(|array| array.name == options.time).and_then(length) else {
        let vectors: Vec<&str> = arrays.iter().filter(|array| length(array).is_some()).map(|array| array.name.as_str()).collect();
        let structures: Vec<&str> =
            arrays.iter().filter(|array| matches!(array.held, Held::Fields(_))).map(|array| array.name.as_str()).collect();
        let what = match (vectors.as_slice(), structures.as_slice()) {
            ([], []) => "there are no vectors".to_owned(),
            ([], _) => format!("name the structure whose fields the columns are with --variable: {}", structures.join(", ")),
            _ => format!("vectors are {}: name one with --time", vectors.join(", ")),
        };
        return Err(wrong(format!("{}: is no vector of times; {what}", options.time)));
    };
    let (mut columns, mut others) = (Vec::new(), Vec::new());
    for array in arrays {
        match length(&array) {
            Some(count) if count == rows => columns.push(Column { cells: cells(array.held), name: array.name }),
            None if is_matrix(&array, rows) => columns.extend(matrix(&array, rows)),
            _ => others.push(match array.held {
                Held::Fields(_) => format!("{} (a structure)", array.name),
                Held::Text(_) => format!("{} (text)", array.name),
                Held::Other(what) => format!("{} ({what})", array.name),
                Held::Numbers(..) | Held::Whole(..) => array.name,
            }),
        }
    }
    let notes = match others.is_empty() {
        true => Vec::new(),
        false => vec![format!("left out, for they are no numbers as long as {}: {}", options.time, others.join(", "))],
    };
    Ok(Table { columns, notes, lines: None })
}

/// Headings by the names that stand for them.
fn names(arrays: &[Array]) -> HashMap<String, String> {
    let text = arrays.iter().find_map(|array| match &array.held {
        Held::Text(text) if array.name == NAMES => Some(text.as_str()),
        _ => None,
    });
    let pairs = text.unwrap_or_default().lines().filter_map(|line| line.split_once(" = "));
    pairs.map(|(name, heading)| (name.to_owned(), heading.trim_end().to_owned())).collect()
}

/// Values of a vector of numbers, lying or standing.
fn length(array: &Array) -> Option<usize> {
    let is_number = matches!(array.held, Held::Numbers(..) | Held::Whole(..));
    let [a, b] = array.size[..] else { return None };
    (is_number && (a == 1) != (b == 1)).then_some(a * b)
}

fn is_matrix(array: &Array, rows: usize) -> bool {
    matches!(array.held, Held::Numbers(..)) && array.size.len() == 2 && array.size.contains(&rows) && !array.size.contains(&0)
}

fn matrix(array: &Array, rows: usize) -> Vec<Column> {
    let (Held::Numbers(values, of), [high, wide]) = (&array.held, &array.size[..]) else { return Vec::new() };
    let column = |number: usize| match *high == rows {
        true => values[number * rows..(number + 1) * rows].to_vec(),
        false => values.iter().skip(number).step_by(*high).copied().collect(),
    };
    let count = if *high == rows { *wide } else { *high };
    (0..count).map(|number| Column::new(format!("{}[{number}]", array.name), column(number), *of)).collect()
}

fn cells(held: Held) -> Cells {
    match held {
        Held::Numbers(values, of) => Cells::Numbers(values, of),
        Held::Whole(_, NumberType::Uint64) => Cells::Other("whole numbers beyond 2^53".to_owned()),
        Held::Whole(values, _) => Cells::Large { values, per_second: None },
        Held::Text(_) | Held::Fields(_) | Held::Other(_) => Cells::Other("something that is no number".to_owned()),
    }
}
