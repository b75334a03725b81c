//! Columns into a parquet file. The format is the crate's.

use crate::BagError;
use crate::number_type::NumberType;
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;

/// A column to be written.
pub(crate) struct Written<'a> {
    pub(crate) name: String,
    pub(crate) values: Values<'a>,
}

/// What stands in a column.
pub(crate) enum Values<'a> {
    /// A number a row.
    Numbers(&'a [f64], NumberType),
    /// A list of numbers a row, as long in every row; the rows one after the other.
    Lists(&'a [f64], usize, NumberType),
    /// A text a row.
    Texts(Vec<String>),
    /// A list of one text a row.
    TextLists(Vec<String>),
}

/// Rows that are compressed together.
const GROUP: usize = 1 << 20;

/// Writes columns of equal length, with the other entries about the file. The compression is Snappy, which every reader has.
pub(crate) fn write(out: &Path, columns: &[Written], said: &[(&str, String)]) -> Result<(), BagError> {
    let file = File::create_new(out).map_err(BagError::create(out))?;
    let failed = |error: ParquetError| BagError::Write { name: out.display().to_string(), what: error.to_string() };
    write_to(BufWriter::new(file), columns, said).map_err(failed)
}

fn write_to(sink: BufWriter<File>, columns: &[Written], said: &[(&str, String)]) -> Result<(), ParquetError> {
    let fields = columns.iter().map(field).collect::<Result<Vec<TypePtr>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build()?);
    let said = said.iter().map(|(key, value)| KeyValue::new((*key).to_owned(), value.clone())).collect();
    let properties = WriterProperties::builder()
        .set_created_by(concat!("backdrive ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(said))
        .build();
    let mut writer = SerializedFileWriter::new(sink, schema, Arc::new(properties))?;
    let rows = columns.first().map_or(0, |column| column.values.rows());
    let mut from = 0;
    while from < rows {
        let to = rows.min(from + GROUP);
        let mut group = writer.next_row_group()?;
        for column in columns {
            let Some(mut into) = group.next_column()? else { break };
            write_column(&mut into, &column.values, from, to)?;
            into.close()?;
        }
        group.close()?;
        from = to;
    }
    writer.close()?;
    Ok(())
}

impl Values<'_> {
    fn rows(&self) -> usize {
        match self {
            Values::Numbers(values, _) => values.len(),
            Values::Lists(values, width, _) => values.len() / width.max(&1),
            Values::Texts(texts) | Values::TextLists(texts) => texts.len(),
        }
    }
}

fn field(column: &Written) -> Result<TypePtr, ParquetError> {
    let single = |name: &str, of: NumberType| {
        let (physical, logical) = stored_as(of);
        Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build()
    };
    let text = |name: &str| {
        let text = Type::primitive_type_builder(name, Physical::BYTE_ARRAY).with_repetition(Repetition::OPTIONAL);
        text.with_converted_type(ConvertedType::UTF8).with_logical_type(Some(LogicalType::String)).build()
    };
    let list = |element: Type| {
        let inner = Type::group_type_builder("list").with_repetition(Repetition::REPEATED).with_fields(vec![Arc::new(element)]).build()?;
        let outer = Type::group_type_builder(&column.name).with_repetition(Repetition::OPTIONAL);
        outer.with_converted_type(ConvertedType::LIST).with_logical_type(Some(LogicalType::List)).with_fields(vec![Arc::new(inner)]).build()
    };
    let built = match &column.values {
        Values::Numbers(_, of) => single(&column.name, *of)?,
        Values::Lists(_, _, of) => list(single("element", *of)?)?,
        Values::Texts(_) => text(&column.name)?,
        Values::TextLists(_) => list(text("element")?)?,
    };
    Ok(Arc::new(built))
}

fn stored_as(of: NumberType) -> (Physical, Option<LogicalType>) {
    let whole = |bits, signed| Some(LogicalType::integer(bits, signed));
    match of {
        NumberType::Double => (Physical::DOUBLE, None),
        NumberType::Single => (Physical::FLOAT, None),
        NumberType::Bool => (Physical::BOOLEAN, None),
        NumberType::Int8 => (Physical::INT32, whole(8, true)),
        NumberType::Int16 => (Physical::INT32, whole(16, true)),
        NumberType::Int32 => (Physical::INT32, None),
        NumberType::Int64 => (Physical::INT64, None),
        NumberType::Uint8 => (Physical::INT32, whole(8, false)),
        NumberType::Uint16 => (Physical::INT32, whole(16, false)),
        NumberType::Uint32 => (Physical::INT32, whole(32, false)),
        NumberType::Uint64 => (Physical::INT64, whole(64, false)),
    }
}

/// Rows `from` to `to` of a column.
fn write_column(into: &mut SerializedColumnWriter, values: &Values, from: usize, to: usize) -> Result<(), ParquetError> {
    match values {
        Values::Numbers(values, of) => write_numbers(into, &values[from..to], *of, &Levels::single(to - from)),
        Values::Lists(values, width, of) => write_numbers(into, &values[from * width..to * width], *of, &Levels::lists(to - from, *width)),
        Values::Texts(texts) => write_texts(into, &texts[from..to], &Levels::single(to - from)),
        Values::TextLists(texts) => write_texts(into, &texts[from..to], &Levels::lists(to - from, 1)),
    }
}

/// Everything is there: the levels say no more than where a row begins.
struct Levels {
    defined: Vec<i16>,
    repeated: Option<Vec<i16>>,
}

impl Levels {
    fn single(rows: usize) -> Levels {
        Levels { defined: vec![1; rows], repeated: None }
    }

    fn lists(rows: usize, width: usize) -> Levels {
        let repeated = (0..rows * width).map(|place| i16::from(place % width != 0)).collect();
        Levels { defined: vec![3; rows * width], repeated: Some(repeated) }
    }
}

fn write_numbers(into: &mut SerializedColumnWriter, values: &[f64], of: NumberType, levels: &Levels) -> Result<(), ParquetError> {
    match of {
        NumberType::Double => batch::<DoubleType>(into, values, levels),
        NumberType::Single => batch::<FloatType>(into, &values.iter().map(|value| *value as f32).collect::<Vec<_>>(), levels),
        NumberType::Bool => batch::<BoolType>(into, &values.iter().map(|value| *value != 0.0).collect::<Vec<_>>(), levels),
        NumberType::Int64 | NumberType::Uint64 => {
            batch::<Int64Type>(into, &values.iter().map(|value| *value as i64).collect::<Vec<_>>(), levels)
        }
        NumberType::Uint32 => batch::<Int32Type>(into, &values.iter().map(|value| *value as u32 as i32).collect::<Vec<_>>(), levels),
        _ => batch::<Int32Type>(into, &values.iter().map(|value| *value as i32).collect::<Vec<_>>(), levels),
    }
}

fn write_texts(into: &mut SerializedColumnWriter, texts: &[String], levels: &Levels) -> Result<(), ParquetError> {
    let texts: Vec<ByteArray> = texts.iter().map(|text| ByteArray::from(text.clone().into_bytes())).collect();
    batch::<ByteArrayType>(into, &texts, levels)
}

fn batch<T: DataType>(into: &mut SerializedColumnWriter, values: &[T::T], levels: &Levels) -> Result<(), ParquetError> {
    into.typed::<T>().write_batch(values, Some(&levels.defined), levels.repeated.as_deref()).map(|_| ())
}
