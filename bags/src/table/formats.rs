//! The formats of tables, and how the format of a file is recognised.

use super::csv_file::Missing;
use super::mapping::{ImportOptions, ImportReport};
use super::types::{Cells, Column, Table};
use super::{csv_file, from_bag, mat_in, mat_out, npz_in, parquet_in, parquet_out, to_bag};
use crate::memory::Memory;
use crate::number_type::NumberType;
use crate::{BagError, Reader};
use backdrive_plant::input_file;
use backdrive_plant::recording::Frame;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A format of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Text, a heading and rows; numbers are doubles.
    Csv,
    /// Apache Parquet; columns keep their types.
    Parquet,
    /// NumPy: an archive of arrays (`.npz`) or one array (`.npy`); it is read and not written.
    Numpy,
    /// MATLAB MAT, version 5, as `save` writes it up to `-v7`; columns keep their types.
    Mat,
}

impl TableFormat {
    /// What a file is: by its first bytes, else by its ending; what is neither is taken for CSV, which any text may be.
    ///
    /// # Errors
    /// It cannot be read, or its ending promises what its bytes are not.
    pub fn of_file(path: &Path) -> Result<TableFormat, BagError> {
        let mut start = Vec::new();
        let file = input_file::open(path).map_err(BagError::io(path))?;
        // What comes through a pipe cannot be looked at before it is read.
        if file.metadata().is_ok_and(|about| !about.is_file()) {
            return Ok(TableFormat::Csv);
        }
        file.take(128).read_to_end(&mut start).map_err(BagError::io(path))?;
        let promised = TableFormat::of_ending(path);
        let wrong = |what: &str| Err(BagError::File { path: path.to_owned(), what: what.to_owned() });
        if start.starts_with(b"PAR1") {
            return Ok(TableFormat::Parquet);
        }
        if start.starts_with(npz_in::MAGIC) || (start.starts_with(b"PK\x03\x04") && npz_in::is_npz(path)) {
            return Ok(TableFormat::Numpy);
        }
        if start.starts_with(b"MATLAB 5.0 MAT-file") {
            return Ok(TableFormat::Mat);
        }
        let is_hdf5 = start.starts_with(b"\x89HDF\r\n\x1a\n");
        if start.starts_with(b"MATLAB 7.3 MAT-file") || (is_hdf5 && promised == Some(TableFormat::Mat)) {
            return wrong("is a MATLAB file of version 7.3 (HDF5); save it again with save(..., '-v7')");
        }
        if is_hdf5 {
            return wrong("is an HDF5 file, which is not read; write its columns as CSV or parquet (pandas: read_hdf, to_parquet)");
        }
        if start.starts_with(&mcap::MAGIC[..6]) {
            let unread = Reader::open(path).map(|reader| reader.topics().iter().filter_map(|topic| topic.unread()).collect::<Vec<_>>());
            return wrong(&match unread.unwrap_or_default().as_slice() {
                [] => "is an MCAP file already: every command reads it directly".to_owned(),
                unread => format!("is an MCAP file already, and {}", unread.join("; ")),
            });
        }
        let packed: [(&[u8], &str); 4] = [
            (b"\x28\xb5\x2f\xfd", "is compressed by zstd; unpack it with `zstd -d`"),
            (b"\x1f\x8b", "is compressed by gzip; unpack it with `gunzip`"),
            (b"BZh", "is compressed by bzip2; unpack it with `bunzip2`"),
            (b"PK\x03\x04", "is a zip archive; of a workbook of Excel, save the table as CSV UTF-8, else unpack it"),
        ];
        if let Some((_, what)) = packed.iter().find(|(magic, _)| start.starts_with(magic)) {
            return wrong(what);
        }
        match promised {
            Some(TableFormat::Numpy) => {
                wrong("is not a NumPy file: it is neither an archive of arrays nor one array; save it again with numpy.savez")
            }
            Some(TableFormat::Parquet) => wrong("is not a parquet file: it does not start with the bytes PAR1"),
            Some(TableFormat::Mat) => wrong(
                "is not a MATLAB file of version 5: it does not start with \"MATLAB 5.0 MAT-file\"; save it again with save(..., '-v7')",
            ),
            // Text in UTF-16 has zeros too, and is reported as such where its rows are read.
            _ if start.contains(&0) && !start.starts_with(b"\xff\xfe") && !start.starts_with(b"\xfe\xff") => {
                wrong("is neither text nor a file of another format that is known (parquet, MATLAB, ROS bag)")
            }
            _ => Ok(TableFormat::Csv),
        }
    }

    /// What a file's ending promises: `.csv`, `.parquet`, `.mat`, `.npz` or `.npy`.
    pub fn of_ending(path: &Path) -> Option<TableFormat> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(TableFormat::Csv),
            "parquet" => Some(TableFormat::Parquet),
            "mat" => Some(TableFormat::Mat),
            "npz" | "npy" => Some(TableFormat::Numpy),
            _ => None,
        }
    }
}

/// Turns a table, which is one experiment, into a bag that [`crate::signals()`] reads the same numbers from.
///
/// A row is a step, its stamp the row's time to the ns; the exact time is in `position[0]` of `/recording/t`. A heading may name its unit (`x [mm]`):
/// the bag holds SI units. The bag remembers what the numbers of a column were in the file, and [`export_table`] writes them so again. As where a
/// table is read directly, an empty cell or `nan` is an error. Errors: the file cannot be read, a column is missing, a time is no number or goes back,
/// a mapped cell is no number, `bag` exists or cannot be written.
pub fn import_table(table: &Path, bag: &Path, options: &ImportOptions) -> Result<ImportReport, BagError> {
    to_bag::write_bag(table, &read_table(table, options, Missing::IsWrong)?, bag, options)
}

/// Reads a table of any format, its columns called as the options say.
pub(crate) fn read_table(table: &Path, options: &ImportOptions, missing: Missing) -> Result<Table, BagError> {
    let format = TableFormat::of_file(table)?;
    if let Some(variable) = options.variable.as_ref().filter(|_| format != TableFormat::Mat) {
        return Err(BagError::Usage(format!("{}: is not a MATLAB file, so it has no structure {variable:?}", table.display())));
    }
    let mut read = match format {
        TableFormat::Csv => csv_file::read_cells(table, options, missing)?,
        TableFormat::Numpy => npz_in::read(table, options)?,
        TableFormat::Parquet => parquet_in::read(table, Memory::new(options.most_bytes))?,
        TableFormat::Mat => mat_in::read(table, options)?,
    };
    if let Some(names) = options.headings.as_ref().filter(|_| format != TableFormat::Csv) {
        if names.len() != read.columns.len() {
            let there = read.columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>().join(", ");
            let what = format!("--columns names {} columns, and the file has {}: {there}", names.len(), read.columns.len());
            return Err(BagError::File { path: table.to_owned(), what });
        }
        read.columns.iter_mut().zip(names).for_each(|(column, name)| column.name.clone_from(name));
    }
    Ok(read)
}

/// As [`import_table`], of a file that is CSV whatever its extension.
///
/// # Errors
/// As of [`import_table`].
pub fn import_csv(table: &Path, bag: &Path, options: &ImportOptions) -> Result<ImportReport, BagError> {
    to_bag::write_bag(table, &csv_file::read(table, options)?, bag, options)
}

/// Writes one table: `t`, `step` (if the messages have steps), and every signal as `topic.field.axis`; what was imported is called as in its table, and has the
/// type that it had there.
///
/// Every number reads back to the same bits; what was not measured is NaN. Topics that speak now and then (gains) have their last value in every
/// row. `topics` limits it to some. Returns the rows, and what a person should know: a sentence each.
///
/// # Errors
/// A topic that is not there, nothing to write, a damaged bag, `out` exists or cannot be written.
pub fn export_table(reader: &Reader, out: &Path, format: TableFormat, topics: Option<&[String]>) -> Result<(u64, Vec<String>), BagError> {
    let mut table = from_bag::table_of(reader, topics)?;
    let mut notes = std::mem::take(&mut table.notes);
    notes.extend(match format {
        TableFormat::Numpy => {
            return Err(BagError::Usage("NumPy files are read and not written; name one of .csv, .parquet or .mat".to_owned()));
        }
        TableFormat::Csv => csv_file::write(&table, out).map(|()| Vec::new())?,
        TableFormat::Parquet => parquet_out::write(&table, out).map(|()| Vec::new())?,
        TableFormat::Mat => mat_out::write(&table, out)?,
    });
    Ok((table.rows() as u64, notes))
}

/// As [`import_table`], of columns in memory. Errors count rows from 1.
///
/// # Errors
/// As of [`import_table`].
pub fn import_frame(frame: Frame, bag: &Path, options: &ImportOptions) -> Result<ImportReport, BagError> {
    let name = PathBuf::from(frame.name());
    let columns = frame.into_columns().into_iter().map(|(name, values)| Column::new(name, values, NumberType::Double)).collect();
    to_bag::write_bag(&name, &Table { columns, ..Table::default() }, bag, options)
}

/// What [`export_table`] writes, as columns in memory: numbers that no double holds are rounded.
///
/// # Errors
/// A topic that is not there, no numbers, a damaged bag.
pub fn frame_of(reader: &Reader, topics: Option<&[String]>) -> Result<Vec<(String, Vec<f64>)>, BagError> {
    let numbers = |cells: Cells, rows: usize| match cells {
        Cells::Numbers(values, _) => values,
        Cells::Large { values, .. } => values.into_iter().map(|value| value as f64).collect(),
        Cells::Other(_) => vec![f64::NAN; rows],
    };
    let table = from_bag::table_of(reader, topics)?;
    let rows = table.rows();
    Ok(table.columns.into_iter().map(|column| (column.name, numbers(column.cells, rows))).collect())
}

/// As [`export_table`], as CSV; numbers have the shortest digits that read back to the same bits. Returns the rows.
///
/// # Errors
/// As of [`export_table`].
pub fn export_csv(reader: &Reader, out: &Path, topics: Option<&[String]>) -> Result<u64, BagError> {
    Ok(export_table(reader, out, TableFormat::Csv, topics)?.0)
}
