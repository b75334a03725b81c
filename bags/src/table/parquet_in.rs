//! A table out of a parquet file.

use super::types::{Cells, Column, Table};
use crate::BagError;
use crate::memory::Memory;
use crate::parquet_file::{ParquetFile, Values};
use std::path::Path;
use std::rc::Rc;

/// Reads the columns of a parquet file that hold one value a row.
pub(crate) fn read(path: &Path, memory: Memory) -> Result<Table, BagError> {
    let file = ParquetFile::open(path, &Rc::new(memory))?;
    let mut columns: Vec<Column> = Vec::new();
    for (place, name, is_single) in file.columns() {
        let deeper = || Column::other(name, "lists or structures");
        let column = match is_single {
            true => Column { name: name.to_owned(), cells: cells(file.values(place)?) },
            // Its leaves are columns of one name.
            false if columns.last().is_some_and(|last| *last == deeper()) => continue,
            false => deeper(),
        };
        columns.push(column);
    }
    Ok(Table { columns, notes: Vec::new(), lines: None })
}

fn cells(values: Values) -> Cells {
    match values {
        Values::Numbers(values, of) => Cells::Numbers(values, of),
        Values::Whole(values) => Cells::Large { values, per_second: None },
        Values::Instants(values, per_second) => Cells::Large { values, per_second: Some(per_second) },
        Values::Other(what) => Cells::Other(what.to_owned()),
    }
}
