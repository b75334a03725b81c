//! A table into a parquet file.

use super::types::{Cells, Table};
use crate::BagError;
use crate::parquet_writer::{Values, Written, write as write_columns};
use std::path::Path;

/// Writes the columns of numbers, each with its type.
pub(crate) fn write(table: &Table, out: &Path) -> Result<(), BagError> {
    let written = table.columns.iter().filter_map(|column| match &column.cells {
        Cells::Numbers(values, of) => Some(Written { name: column.name.clone(), values: Values::Numbers(values, *of) }),
        _ => None,
    });
    write_columns(out, &written.collect::<Vec<_>>(), &[])
}
