//! Columns of numbers out of a parquet file. The crate defines the format; this file maps its types to a recording.

use crate::BagError;
use crate::arrow_schema::durations;
use crate::foreign_code::guarded;
use crate::memory::Memory;
use crate::number_type::{LARGEST_WHOLE, NumberType};
use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;
use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// An open parquet file.
pub(crate) struct ParquetFile {
    path: PathBuf,
    reader: SerializedFileReader<File>,
    /// Of columns that are durations, which parquet has no type for, how many of their units make a second.
    durations: HashMap<String, f64>,
    /// Memory that the numbers may take.
    memory: Rc<Memory>,
}

/// What a column of single values holds.
pub(crate) enum Values {
    /// Numbers; NaN where there is none.
    Numbers(Vec<f64>, NumberType),
    /// Whole numbers of which some are beyond 2⁵³.
    Whole(Vec<i64>),
    /// Points in time or durations, and how many of their units make a second.
    Instants(Vec<i64>, f64),
    /// None of these; what it is, in the plural.
    Other(&'static str),
}

/// The stored values of a column, one after the other, with the levels that assign them to rows.
#[derive(Default)]
struct Stored {
    numbers: Numbers,
    /// How much of each place is there; empty where all must be.
    defined: Vec<i16>,
    /// 0 where a row begins; empty where every row has one value.
    repeated: Vec<i16>,
}

enum Numbers {
    Floats(Vec<f64>),
    Whole(Vec<i64>),
}

impl Default for Numbers {
    fn default() -> Numbers {
        Numbers::Floats(Vec::new())
    }
}

impl ParquetFile {
    pub(crate) fn open(path: &Path, memory: &Rc<Memory>) -> Result<ParquetFile, BagError> {
        let file = backdrive_plant::input_file::open(path).map_err(BagError::io(path))?;
        let size = file.metadata().map_err(BagError::io(path))?.len();
        let opened = guarded(|| SerializedFileReader::new(file)).and_then(|opened| opened.map_err(|error| error_text(&error)));
        let reader = opened.map_err(|why| {
            let what = format!("is not a whole parquet file: {why}; if it was cut off, it has to be written again");
            BagError::File { path: path.to_owned(), what }
        })?;
        let said = reader.metadata().file_metadata().key_value_metadata();
        let schema = said.into_iter().flatten().find(|pair| pair.key == "ARROW:schema").and_then(|pair| pair.value.as_deref());
        let durations = schema.map(durations).unwrap_or_default();
        let file = ParquetFile { path: path.to_owned(), reader, durations, memory: Rc::clone(memory) };
        file.check_extents(size)?;
        Ok(file)
    }

    /// What the reader takes on trust: that columns lie within the file and have the stated number of values.
    fn check_extents(&self, size: u64) -> Result<(), BagError> {
        for group in self.reader.metadata().row_groups() {
            for column in group.columns() {
                let begin = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset()).min(column.data_page_offset());
                let end = begin.checked_add(column.compressed_size()).and_then(|end| u64::try_from(end).ok());
                let is_sound = begin >= 0 && column.compressed_size() >= 0 && end.is_some_and(|end| end <= size);
                if !is_sound || column.num_values() < 0 || group.num_rows() < 0 {
                    let what = format!("lies at byte {begin}, {} bytes long, in a file of {size}; it is damaged", column.compressed_size());
                    return Err(self.wrong(column.column_descr(), what));
                }
            }
        }
        Ok(())
    }

    /// Columns of single values and of anything deeper, by their place; a column that is deeper comes once for each of its leaves.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        let schema = self.reader.metadata().file_metadata().schema_descr();
        schema.columns().iter().enumerate().map(|(place, column)| {
            let parts = column.path().parts();
            (place, parts.first().map_or("", String::as_str), parts.len() == 1 && column.max_rep_level() == 0)
        })
    }

    /// A column with one value a row.
    pub(crate) fn values(&self, place: usize) -> Result<Values, BagError> {
        let column = self.reader.metadata().file_metadata().schema_descr().column(place);
        let meaning = meaning(&column);
        let (of, per_second) = match meaning {
            Meaning::Numbers(of) => (of, self.durations.get(column.name()).copied()),
            Meaning::Instants(per_second) => (NumberType::Int64, Some(per_second)),
            Meaning::Other(what) => return Ok(Values::Other(what)),
        };
        let Stored { numbers, defined, .. } = self.stored(place, &column)?;
        let full = column.max_def_level();
        let is_whole = defined.iter().all(|level| *level == full);
        let whole = match numbers {
            Numbers::Floats(values) => return Ok(Values::Numbers(spread(values, &defined, full), of)),
            Numbers::Whole(values) if of == NumberType::Uint64 && values.iter().any(|value| *value < 0) => {
                return Ok(Values::Other("whole numbers beyond 2^63"));
            }
            Numbers::Whole(values) => values,
        };
        Ok(match per_second {
            Some(per_second) if is_whole => Values::Instants(whole, per_second),
            Some(_) => Values::Other("points in time, of which some are missing,"),
            None if whole.iter().all(|value| value.unsigned_abs() as f64 <= LARGEST_WHOLE) => {
                Values::Numbers(spread(whole.into_iter().map(|value| value as f64).collect(), &defined, full), of)
            }
            None if is_whole => Values::Whole(whole),
            None => Values::Other("whole numbers beyond 2^53, of which some are missing,"),
        })
    }

    /// A column of numbers, one or equally many a row: the numbers of a row after another, and how many a row has, and what they are; NaN where one is missing.
    pub(crate) fn matrix(&self, place: usize) -> Result<(Vec<f64>, usize, NumberType), BagError> {
        let column = self.reader.metadata().file_metadata().schema_descr().column(place);
        let of = match meaning(&column) {
            Meaning::Numbers(of) => of,
            Meaning::Instants(_) => NumberType::Int64,
            Meaning::Other(what) => return Err(self.wrong(&column, format!("holds {what}, expected numbers"))),
        };
        let Stored { numbers, defined, repeated } = self.stored(place, &column)?;
        let values = match numbers {
            Numbers::Floats(values) => values,
            Numbers::Whole(values) => values.into_iter().map(|value| value as f64).collect(),
        };
        if column.max_rep_level() == 0 {
            return Ok((spread(values, &defined, column.max_def_level()), 1, of));
        }
        let mut values = values.into_iter();
        let (mut flat, mut width, mut row, mut rows) = (Vec::new(), None, 0, 0);
        let different = |row: usize| self.wrong(&column, format!("row {row}: has another number of values than the rows before"));
        for (level, back) in defined.iter().zip(&repeated) {
            if *back == 0 {
                if rows > 0 && *width.get_or_insert(row) != row {
                    return Err(different(rows));
                }
                (row, rows) = (0, rows + 1);
            }
            if *level >= column.repeated_ancestor_def_level() {
                let there = *level == column.max_def_level();
                flat.push(if there { values.next().unwrap_or(f64::NAN) } else { f64::NAN });
                row += 1;
            }
        }
        match width {
            Some(width) if width != row => Err(different(rows)),
            _ => Ok((flat, row, of)),
        }
    }

    fn stored(&self, place: usize, column: &ColumnDescriptor) -> Result<Stored, BagError> {
        let failed = |error: ParquetError| self.wrong(column, format!("cannot be read: {}", error_text(&error)));
        let mut found = Stored::default();
        let (mut flags, mut small, mut whole, mut single, mut double) = (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut days, mut bytes) = (Vec::new(), Vec::new());
        for (index, group) in self.reader.metadata().row_groups().iter().enumerate() {
            let rows = usize::try_from(group.num_rows()).unwrap_or(0);
            // The file's own counts first, so that what is too large is refused before anything of it is unpacked.
            let values = group.columns().get(place).map_or(0, |of| u64::try_from(of.num_values()).unwrap_or(0)).max(rows as u64);
            self.memory.check_numbers(values).map_err(|what| self.wrong(column, what))?;
            let memory = &self.memory;
            let read = guarded(|| {
                let reader = self.reader.get_row_group(index)?.get_column_reader(place)?;
                match reader {
                    ColumnReader::BoolColumnReader(of) => read_all(of, rows, memory, &mut found, &mut flags),
                    ColumnReader::Int32ColumnReader(of) => read_all(of, rows, memory, &mut found, &mut small),
                    ColumnReader::Int64ColumnReader(of) => read_all(of, rows, memory, &mut found, &mut whole),
                    ColumnReader::Int96ColumnReader(of) => read_all(of, rows, memory, &mut found, &mut days),
                    ColumnReader::FloatColumnReader(of) => read_all(of, rows, memory, &mut found, &mut single),
                    ColumnReader::DoubleColumnReader(of) => read_all(of, rows, memory, &mut found, &mut double),
                    ColumnReader::FixedLenByteArrayColumnReader(of) => read_all(of, rows, memory, &mut found, &mut bytes),
                    ColumnReader::ByteArrayColumnReader(_) => {
                        Err(ParquetError::General("it holds bytes where numbers were expected".to_owned()))
                    }
                }
            });
            read.map_err(|why| self.wrong(column, format!("cannot be read: {why}; it is damaged")))?.map_err(failed)?;
        }
        let unsigned = matches!(meaning(column), Meaning::Numbers(NumberType::Uint8 | NumberType::Uint16 | NumberType::Uint32));
        found.numbers = match column.physical_type() {
            Physical::BOOLEAN => Numbers::Whole(flags.into_iter().map(i64::from).collect()),
            Physical::INT32 if unsigned => Numbers::Whole(small.into_iter().map(|value: i32| i64::from(value as u32)).collect()),
            Physical::INT32 => Numbers::Whole(small.into_iter().map(i64::from).collect()),
            Physical::INT96 => Numbers::Whole(days.iter().map(parquet::data_type::Int96::to_nanos).collect()),
            Physical::FLOAT => Numbers::Floats(single.into_iter().map(f64::from).collect()),
            Physical::DOUBLE => Numbers::Floats(double),
            Physical::FIXED_LEN_BYTE_ARRAY => Numbers::Floats(bytes.iter().map(|bytes| half(bytes.data())).collect()),
            Physical::INT64 | Physical::BYTE_ARRAY => Numbers::Whole(whole),
        };
        Ok(found)
    }

    fn wrong(&self, column: &ColumnDescriptor, what: String) -> BagError {
        let name = column.path().parts().first().map_or("", String::as_str);
        BagError::File { path: self.path.clone(), what: format!("column {name:?}: {what}") }
    }
}

/// Rows that are read between two checks of the memory: a damaged file may hold more values than stated.
const BATCH: usize = 1 << 16;

/// All values of a column in a row group, behind what is there.
fn read_all<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    memory: &Memory,
    found: &mut Stored,
    into: &mut Vec<T::T>,
) -> Result<(), ParquetError> {
    let mut done = 0;
    while done < rows {
        let before = into.len().max(found.defined.len());
        let batch = BATCH.min(rows - done);
        let (read, _, _) = reader.read_records(batch, Some(&mut found.defined), Some(&mut found.repeated), into)?;
        let values = into.len().max(found.defined.len()).saturating_sub(before);
        memory.take_numbers(values as u64).map_err(ParquetError::General)?;
        if read == 0 {
            return Err(ParquetError::EOF(format!("it ends after {done} of {rows} rows")));
        }
        done += read;
    }
    Ok(())
}

/// Values at the places where there is one, NaN at the others.
fn spread(values: Vec<f64>, defined: &[i16], full: i16) -> Vec<f64> {
    if defined.iter().all(|level| *level == full) {
        return values;
    }
    let mut values = values.into_iter();
    defined.iter().map(|level| if *level == full { values.next().unwrap_or(f64::NAN) } else { f64::NAN }).collect()
}

enum Meaning {
    Numbers(NumberType),
    /// How many make a second.
    Instants(f64),
    Other(&'static str),
}

fn meaning(column: &ColumnDescriptor) -> Meaning {
    let whole = |bits: i32, signed: bool| {
        Meaning::Numbers(match (bits, signed) {
            (8, true) => NumberType::Int8,
            (16, true) => NumberType::Int16,
            (32, true) => NumberType::Int32,
            (8, false) => NumberType::Uint8,
            (16, false) => NumberType::Uint16,
            (32, false) => NumberType::Uint32,
            (_, true) => NumberType::Int64,
            (_, false) => NumberType::Uint64,
        })
    };
    match column.logical_type_ref() {
        Some(LogicalType::Integer(of)) => return whole(of.bit_width.into(), of.is_signed),
        Some(LogicalType::Timestamp(of)) => {
            return Meaning::Instants(match of.unit {
                TimeUnit::MILLIS => 1e3,
                TimeUnit::MICROS => 1e6,
                TimeUnit::NANOS => 1e9,
            });
        }
        Some(LogicalType::Float16) => return Meaning::Numbers(NumberType::Single), // which holds every number of half precision
        Some(LogicalType::Date) => return Meaning::Other("dates"),
        Some(LogicalType::Time(_)) => return Meaning::Other("times of day"),
        Some(LogicalType::Decimal(_)) => return Meaning::Other("decimal fractions"),
        _ => {}
    }
    match (column.physical_type(), column.converted_type()) {
        (_, ConvertedType::INT_8) => whole(8, true),
        (_, ConvertedType::INT_16) => whole(16, true),
        (_, ConvertedType::UINT_8) => whole(8, false),
        (_, ConvertedType::UINT_16) => whole(16, false),
        (_, ConvertedType::UINT_32) => whole(32, false),
        (_, ConvertedType::UINT_64) => whole(64, false),
        (_, ConvertedType::TIMESTAMP_MILLIS) => Meaning::Instants(1e3),
        (_, ConvertedType::TIMESTAMP_MICROS) => Meaning::Instants(1e6),
        (_, ConvertedType::DATE) => Meaning::Other("dates"),
        (_, ConvertedType::DECIMAL) => Meaning::Other("decimal fractions"),
        (_, ConvertedType::TIME_MILLIS | ConvertedType::TIME_MICROS) => Meaning::Other("times of day"),
        (Physical::BOOLEAN, _) => Meaning::Numbers(NumberType::Bool),
        (Physical::INT32, _) => whole(32, true),
        (Physical::INT64, _) => whole(64, true),
        (Physical::INT96, _) => Meaning::Instants(1e9),
        (Physical::FLOAT, _) => Meaning::Numbers(NumberType::Single),
        (Physical::DOUBLE, _) => Meaning::Numbers(NumberType::Double),
        (Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY, _) => Meaning::Other("text or bytes"),
    }
}

/// A number of half precision (IEEE 754, 16 bits, lower byte first).
fn half(bytes: &[u8]) -> f64 {
    let [low, high] = *bytes else { return f64::NAN };
    let bits = u16::from_le_bytes([low, high]);
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2f64.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// The crate's message, without the name of its kind of error.
fn error_text(error: &ParquetError) -> String {
    match error {
        ParquetError::General(what) | ParquetError::NYI(what) | ParquetError::EOF(what) => what.clone(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn half_precision_is_exact() {
        // IEEE 754-2019, binary16: 1, -2, the greatest (65504), the least (2^-24), infinity.
        for (bits, value) in
            [(0x3c00_u16, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (1, 2f64.powi(-24)), (0x7c00, f64::INFINITY), (0x8000, -0.0)]
        {
            assert_eq!(half(&bits.to_le_bytes()).to_bits(), f64::to_bits(value), "{bits:x}");
        }
        assert!(half(&0x7e00_u16.to_le_bytes()).is_nan() && half(&[0]).is_nan());
    }
}
