//! Where files name things differently, or in other units; and which piece of a file counts.

use super::units::{self, Unit};
use crate::elements::Range;
use crate::tomlfile::{FileError, Table};

/// Where a signal stands in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// Heading of a CSV column.
    Column(String),
    /// Field of a topic in an MCAP file, such as `effort[0]` of `/master/servo_jf`.
    Topic {
        /// Such as `/master/servo_jf`.
        topic: String,
        /// Such as `effort[0]`.
        field: String,
    },
}

/// How a signal is read: the value there, times `scale`, plus `offset`, is in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnRule {
    /// Where it stands.
    pub source: Source,
    /// The unit of the values; `None` where the rule names none.
    pub unit: Option<Unit>,
    /// Factor on the value in SI units of `unit`, or on the bare value. With a factor the kind of the unit is not checked, for it may be a
    /// motor's constant (N/A) or the size of a count; `None` is 1.
    pub scale: Option<f64>,
    /// Added after that.
    pub offset: f64,
}

impl ColumnRule {
    /// The value as it stands there, from this source.
    pub fn of(source: Source) -> ColumnRule {
        ColumnRule { source, unit: None, scale: None, offset: 0.0 }
    }

    /// Factor from the file's value to SI units.
    pub fn factor(&self) -> f64 {
        self.unit.map_or(1.0, |u| u.factor) * self.scale.unwrap_or(1.0)
    }

    /// The unit whose kind has to go with the signal.
    pub fn checked_unit(&self) -> Option<Unit> {
        self.unit.filter(|_| self.scale.is_none())
    }
}

/// Rules by signal name (or `t`); a signal without one has a column of its own name.
pub type Columns = Vec<(String, ColumnRule)>;

/// Which rows of a file count.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Piece {
    /// First row that counts and first that does not; rows of data, from 0, in the whole file.
    pub rows: Option<[usize; 2]>,
    /// Of these, the rows whose column has this value.
    pub keep: Vec<(String, Cell)>,
}

/// A value that a row is chosen by.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Equal as a number.
    Number(f64),
    /// Equal as text.
    Text(String),
}

impl Cell {
    /// Whether a cell of a file has this value.
    pub fn matches(&self, cell: &str) -> bool {
        match self {
            Cell::Number(number) => cell.parse::<f64>().is_ok_and(|x| x == *number),
            Cell::Text(text) => cell == text,
        }
    }
}

/// Takes the rules of a `[columns]` table: `name = "heading"`, `{ column, unit, scale, offset }` or `{ topic, field, unit, scale, offset }`.
pub fn read_columns(mut table: Table) -> Result<Columns, FileError> {
    let mut columns = Columns::new();
    for name in table.keys() {
        let Some(rule) = read_one(&mut table, &name)? else { continue };
        columns.push((name, rule));
    }
    table.finish()?;
    Ok(columns)
}

/// The rule at a key: a heading, or a table; `None` where the key is not there.
pub(crate) fn read_one(table: &mut Table, key: &str) -> Result<Option<ColumnRule>, FileError> {
    if !table.contains(key) {
        // Known from now on: a misspelling is reported with its name.
        table.skip(key);
        return Ok(None);
    }
    if table.is_string(key) {
        return Ok(Some(ColumnRule::of(Source::Column(table.need_string(key)?))));
    }
    match table.is_table(key) {
        true => read_rule(table, key).map(Some),
        false => Err(table.error_at(key, "expected the heading of a column, or a table with column, or with topic and field")),
    }
}

fn read_rule(columns: &mut Table, name: &str) -> Result<ColumnRule, FileError> {
    let mut table = columns.table(name)?.ok_or_else(|| columns.missing(name))?;
    let source = match (table.string("column")?, table.string("topic")?, table.string("field")?) {
        (None, Some(topic), Some(field)) => Source::Topic { topic, field },
        (Some(column), None, None) => Source::Column(column),
        // Only a scale: the column has the signal's own name.
        (None, None, None) => Source::Column(name.to_string()),
        (Some(_), Some(_), _) | (Some(_), _, Some(_)) => {
            return Err(table.error("has both a column (of a CSV) and a topic or field (of an MCAP); keep one"));
        }
        (None, Some(_), None) => return Err(table.missing("field")),
        (None, None, Some(_)) => return Err(table.missing("topic")),
    };
    let unit = match table.string("unit")? {
        Some(unit) => Some(units::parse(&unit).map_err(|message| table.error_at("unit", message))?),
        None => None,
    };
    let scale = table.number("scale", Range::Any)?;
    if scale == Some(0.0) {
        return Err(table.error_at("scale", "must not be 0"));
    }
    let offset = table.number_or("offset", Range::Any, 0.0)?;
    table.finish()?;
    Ok(ColumnRule { source, unit, scale, offset })
}
