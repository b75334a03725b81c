//! The table as a parquet file that DuckDB, pandas and polars open. The same rows give the same bytes.

use super::rows::{NUMBERS, TEXTS, Table, TableRow};
use crate::date::Date;
use crate::error::FleetError;
use crate::what::What;
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::Field;
use parquet::schema::types::{Type, TypePtr};
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// Entry of the file that names what was asked.
const ASKED: &str = "backdrive.fleet";

enum Column {
    Texts(String, Vec<Option<String>>),
    Numbers(String, Vec<Option<f64>>),
}

/// Writes the table.
///
/// # Errors
/// The file cannot be written.
pub fn write(table: &Table, into: impl Write + Send) -> Result<(), String> {
    write_to(table, into).map_err(|e| e.to_string())
}

fn write_to(table: &Table, into: impl Write + Send) -> Result<(), ParquetError> {
    let columns = columns(table);
    let fields = columns.iter().map(field).collect::<Result<Vec<TypePtr>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
    let properties = WriterProperties::builder()
        .set_created_by(concat!("backdrive ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(vec![KeyValue::new(ASKED.to_owned(), table.what.name().to_owned())]))
        .build();
    let mut writer = SerializedFileWriter::new(into, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for column in &columns {
        let Some(mut into) = group.next_column()? else { break };
        match column {
            Column::Texts(_, values) => {
                let there: Vec<ByteArray> = values.iter().flatten().map(|text| ByteArray::from(text.as_bytes().to_vec())).collect();
                into.typed::<ByteArrayType>().write_batch(&there, Some(&levels(values)), None)?;
            }
            Column::Numbers(_, values) => {
                let there: Vec<f64> = values.iter().flatten().copied().collect();
                into.typed::<DoubleType>().write_batch(&there, Some(&levels(values)), None)?;
            }
        }
        into.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

/// 1 where there is a value, 0 where there is none.
fn levels<T>(values: &[Option<T>]) -> Vec<i16> {
    values.iter().map(|value| i16::from(value.is_some())).collect()
}

fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let built = match column {
        Column::Texts(name, _) => Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
            .with_repetition(Repetition::OPTIONAL)
            .with_converted_type(ConvertedType::UTF8)
            .with_logical_type(Some(LogicalType::String)),
        Column::Numbers(name, _) => Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::OPTIONAL),
    };
    Ok(Arc::new(built.build()?))
}

fn columns(table: &Table) -> Vec<Column> {
    let texts = |name: &str, of: &dyn Fn(&TableRow) -> Option<String>| Column::Texts(name.to_string(), table.rows.iter().map(of).collect());
    let numbers =
        |name: &str, of: &dyn Fn(&TableRow) -> Option<f64>| Column::Numbers(name.to_string(), table.rows.iter().map(of).collect());
    let some = |text: &String| (!text.is_empty()).then(|| text.clone());
    let mut out = vec![
        texts(TEXTS[0], &|row| Some(row.recording.clone())),
        texts(TEXTS[1], &|row| Some(row.unit.clone())),
        texts(TEXTS[2], &|row| some(&row.joint)),
        texts(TEXTS[3], &|row| row.date.map(Date::iso)),
        texts(TEXTS[4], &|row| Some(row.answer.clone())),
        texts(TEXTS[5], &|row| some(&row.error)),
        numbers(NUMBERS[0], &|row| row.date.map(|date| date.0 as f64)),
        numbers(NUMBERS[1], &|row| row.temperature),
        numbers(NUMBERS[2], &|row| row.since_start),
    ];
    for name in table.word_columns() {
        out.push(texts(&name, &|row| row.words.get(&name).cloned()));
    }
    for name in table.number_columns() {
        out.push(numbers(&name, &|row| row.numbers.get(&name).copied()));
    }
    out
}

/// Reads a table that [`write()`] wrote.
///
/// # Errors
/// The file cannot be read, or is no table of a fleet.
pub fn read(path: &Path) -> Result<Table, FleetError> {
    let failed = |why: String| FleetError::input(format!("{}: {why}", path.display()));
    let file = File::open(path).map_err(|e| failed(format!("cannot be read: {e}")))?;
    let reader = SerializedFileReader::new(file).map_err(|e| failed(format!("is not a whole parquet file: {e}")))?;
    let said = reader.metadata().file_metadata().key_value_metadata();
    let asked = said.into_iter().flatten().find(|pair| pair.key == ASKED).and_then(|pair| pair.value.clone());
    let what: What = asked
        .ok_or_else(|| failed("is no table of a fleet; `backdrive fleet MANIFEST --out DIR` writes one".to_string()))?
        .parse()
        .map_err(failed)?;
    let mut table = Table::new(what);
    for row in reader.get_row_iter(None).map_err(|e| failed(e.to_string()))? {
        let row = row.map_err(|e| failed(format!("is damaged: {e}")))?;
        let mut out = TableRow::default();
        for (name, value) in row.get_column_iter() {
            match value {
                Field::Str(text) => put_text(&mut out, name, text),
                Field::Double(number) => put_number(&mut out, name, *number),
                _ => {}
            }
        }
        table.rows.push(out);
    }
    Ok(table)
}

fn put_text(row: &mut TableRow, name: &str, text: &str) {
    let text = text.to_string();
    match name {
        "recording" => row.recording = text,
        "unit" => row.unit = text,
        "joint" => row.joint = text,
        "date" => row.date = Date::parse(&text),
        "answer" => row.answer = text,
        "error" => row.error = text,
        other => drop(row.words.insert(other.to_string(), text)),
    }
}

fn put_number(row: &mut TableRow, name: &str, number: f64) {
    match name {
        "time" => {}
        "temperature" => row.temperature = Some(number),
        "since_start" => row.since_start = Some(number),
        other => drop(row.numbers.insert(other.to_string(), number)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_reads_back_and_its_bytes_repeat() {
        let mut table = Table::new(What::Triage);
        for (index, joint) in ["a", "b", ""].iter().enumerate() {
            let mut row =
                TableRow { recording: format!("r{index}"), unit: "u".to_string(), joint: joint.to_string(), ..TableRow::default() };
            row.date = Date::parse("2026-11-03T10:00:00Z").filter(|_| index != 1);
            row.numbers.extend((index == 0).then(|| ("dry".to_string(), 0.1 + 0.2)));
            row.words.insert("audit".to_string(), "clean".to_string());
            table.rows.push(row);
        }
        let bytes = || {
            let mut out = Vec::new();
            write(&table, &mut out).unwrap();
            out
        };
        assert_eq!(bytes(), bytes());
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes()).unwrap();
        assert_eq!(read(file.path()).unwrap(), table);
        std::fs::write(file.path(), &bytes()[..100]).unwrap();
        assert!(read(file.path()).unwrap_err().to_string().contains("not a whole parquet file"));
    }
}
