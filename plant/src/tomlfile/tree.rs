//! TOML text as an owned tree in which every key and value knows its line.

use std::ops::Range;
use toml_edit::{Document, Item, TableLike, Value as TomlValue};

/// A value and the line (from 1) it begins on.
#[derive(Debug)]
pub(super) struct Node {
    pub line: usize,
    pub value: Value,
}

#[derive(Debug)]
pub(super) enum Value {
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Datetime(String),
    Array(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key of a table, with the line it stands on.
#[derive(Debug)]
pub(super) struct Entry {
    pub key: String,
    pub line: usize,
    pub node: Node,
}

impl Node {
    /// What it is, for an error: `the string "x"`.
    pub fn describe(&self) -> String {
        match &self.value {
            Value::String(s) => format!("the string \"{s}\""),
            Value::Integer(i) => format!("the integer {i}"),
            Value::Float(x) => format!("the number {x}"),
            Value::Boolean(b) => format!("{b}"),
            Value::Datetime(d) => format!("the date {d}"),
            Value::Array(items) if items.is_empty() => "an empty list".to_string(),
            Value::Array(_) => "a list".to_string(),
            Value::Table(_) => "a table".to_string(),
        }
    }
}

struct Lines {
    starts: Vec<usize>,
}

impl Lines {
    fn of(text: &str) -> Lines {
        Lines { starts: std::iter::once(0).chain(text.bytes().enumerate().filter(|b| b.1 == b'\n').map(|b| b.0 + 1)).collect() }
    }

    fn line(&self, byte: usize) -> usize {
        self.starts.partition_point(|start| *start <= byte).max(1)
    }
}

/// Top table of a text; the error is line and column (from 1) and what is wrong there.
pub(super) fn parse(text: &str) -> Result<Vec<Entry>, (usize, usize, String)> {
    let lines = Lines::of(text);
    let document = Document::parse(text).map_err(|e| {
        let byte = e.span().map_or(0, |s| s.start).min(text.len());
        let line = lines.line(byte);
        let start = lines.starts.get(line - 1).copied().unwrap_or(0);
        let column = text.get(start..byte).map_or(byte - start, |s| s.chars().count()) + 1;
        (line, column, e.message().trim().replace('\n', ", "))
    })?;
    Ok(entries(document.as_table(), &lines, 1))
}

fn line_of(span: Option<Range<usize>>, lines: &Lines, fallback: usize) -> usize {
    span.map_or(fallback, |s| lines.line(s.start))
}

fn entries(table: &dyn TableLike, lines: &Lines, fallback: usize) -> Vec<Entry> {
    table
        .iter()
        .map(|(name, item)| {
            let key = table.key(name).and_then(|k| k.span());
            let line = line_of(key.or_else(|| item.span()), lines, fallback);
            Entry { key: name.to_string(), line, node: from_item(item, lines, line) }
        })
        .collect()
}

fn from_item(item: &Item, lines: &Lines, fallback: usize) -> Node {
    let line = line_of(item.span(), lines, fallback);
    match item {
        // Only a table that was built by hand holds nothing; a parsed one does not.
        Item::None => Node { line, value: Value::Table(Vec::new()) },
        Item::Value(value) => from_value(value, lines, fallback),
        Item::Table(table) => Node { line, value: Value::Table(entries(table, lines, line)) },
        Item::ArrayOfTables(tables) => {
            let from_table = |t: &toml_edit::Table| {
                let line = line_of(t.span(), lines, line);
                Node { line, value: Value::Table(entries(t, lines, line)) }
            };
            Node { line, value: Value::Array(tables.iter().map(from_table).collect()) }
        }
    }
}

fn from_value(value: &TomlValue, lines: &Lines, fallback: usize) -> Node {
    let line = line_of(value.span(), lines, fallback);
    let value = match value {
        TomlValue::String(s) => Value::String(s.value().clone()),
        TomlValue::Integer(i) => Value::Integer(*i.value()),
        TomlValue::Float(x) => Value::Float(*x.value()),
        TomlValue::Boolean(b) => Value::Boolean(*b.value()),
        TomlValue::Datetime(d) => Value::Datetime(d.value().to_string()),
        TomlValue::Array(items) => Value::Array(items.iter().map(|item| from_value(item, lines, line)).collect()),
        TomlValue::InlineTable(table) => Value::Table(entries(table, lines, line)),
    };
    Node { line, value }
}
