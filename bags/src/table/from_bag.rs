//! A bag's signals as a table.

use super::bag_columns::{columns_of, was_table};
use super::types::{Cells, Column, Table};
use crate::number_type::NumberType;
use crate::signals::{TIME_TOPIC, gather};
use crate::{BagError, Reader};

/// `t`, `step` (if the messages have steps), and every signal. Columns that were imported have the type that they had in their table.
pub(crate) fn table_of(reader: &Reader, topics: Option<&[String]>) -> Result<Table, BagError> {
    for name in topics.unwrap_or_default() {
        reader.topic(name)?;
    }
    let wanted = columns_of(reader, topics)?;
    let asked = |name: &str| topics.is_none_or(|topics| topics.iter().any(|topic| topic == name));
    let unread: Vec<String> = reader.topics().iter().filter(|topic| asked(&topic.name)).filter_map(|topic| topic.unread()).collect();
    if wanted.is_empty() {
        let why: Vec<String> = reader.end_missing().into_iter().chain(unread).collect();
        let why = if why.is_empty() { String::new() } else { format!(": {}", why.join("; ")) };
        return Err(BagError::Usage(format!("{} has no numbers to export{why}", reader.path().display())));
    }
    let found = gather(reader, &wanted, false, usize::MAX)?;
    // Recovered bags may have rows in which a whole number is missing: then the column is one of doubles.
    let type_of = |place: &str, values: &[f64]| {
        let was = reader.header().and_then(|header| header.column_types.get(place).copied());
        was.filter(|of| of.holds(values)).unwrap_or_default()
    };
    let mut columns = vec![Column::new("t", Vec::new(), type_of(&format!("{TIME_TOPIC}.position[0]"), &found.t))];
    // The steps of a table that was imported are its rows.
    if let Some(steps) = found.steps.filter(|_| !was_table(reader)) {
        columns.push(Column {
            name: "step".to_owned(),
            cells: Cells::of_whole(steps.into_iter().map(|step| step as i64).collect(), NumberType::Int64),
        });
    }
    for ((signal, name), values) in wanted.iter().zip(found.names).zip(found.columns) {
        let of = type_of(&format!("{}.{}", signal.topic, signal.field), &values);
        columns.push(Column::new(name, values, of));
    }
    if let Cells::Numbers(values, _) = &mut columns[0].cells {
        *values = found.t;
    }
    Ok(Table { columns, notes: unread, lines: None })
}
