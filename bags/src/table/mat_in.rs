//! A table out of a MATLAB file.

use super::arrays;
use super::mapping::ImportOptions;
use super::mat_array::{Array, Held, variables};
use super::mat_format::NAMES;
use super::types::Table;
use crate::BagError;
use crate::memory::Memory;
use std::collections::HashMap;
use std::path::Path;

/// Reads the vectors and matrices of numbers, or those in a structure.
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
                _ => return Err(wrong(format!("{variable}: is not a structure with fields"))),
            },
            None => return Err(wrong(format!("{variable}: there is none; there are {}", there()))),
        }
    }
    for array in &mut arrays {
        if let Some(heading) = names.get(&array.name) {
            array.name.clone_from(heading);
        }
    }
    arrays::table(arrays, options).map_err(wrong)
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
