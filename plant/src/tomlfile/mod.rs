//! A cursor over a TOML file that knows which line each key stands on.
//!
//! A reader takes the keys it knows, each with its type and range, and then calls [`Table::finish`],
//! which refuses any key that was not taken. Every error is a [`FileError`] that names file, line and key.

mod error;
mod tree;

pub use error::{FileError, nearest, unknown};

use crate::elements::Range;
use std::path::Path;
use std::sync::Arc;
use tree::{Entry, Node, Value};

/// The file that a cursor is in.
#[derive(Debug)]
struct File {
    name: String,
    text: String,
}

/// A table of a TOML file, from which known keys are taken one by one.
#[derive(Debug)]
pub struct Table {
    file: Arc<File>,
    /// Dotted path of this table, with its label: `elements[2] "cable"`; empty at the top.
    path: String,
    line: usize,
    entries: Vec<Entry>,
    known: Vec<String>,
    /// Lines of keys that were taken, for errors that come up later.
    taken: Vec<(String, usize)>,
}

/// Why a file cannot be read, in words.
pub(crate) fn unreadable(path: &Path, error: &std::io::Error) -> FileError {
    let message = match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_string(),
        std::io::ErrorKind::PermissionDenied => "may not be read: permission denied".to_string(),
        _ if path.is_dir() => "is a folder, expected a file".to_string(),
        _ => format!("cannot be read: {error}"),
    };
    FileError::whole(path.display().to_string(), message)
}

/// Text of a file, or a clear error where it is missing, is not a file or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    let name = path.display().to_string();
    let bytes = crate::input_file::read(path).map_err(|e| unreadable(path, &e))?;
    String::from_utf8(bytes).map_err(|e| {
        let good = e.utf8_error().valid_up_to();
        let line = e.as_bytes()[..good].iter().filter(|b| **b == b'\n').count() + 1;
        FileError::at(&name, line, "", format!("is not UTF-8 text (byte {good})"))
    })
}

impl Table {
    /// Opens a TOML file at its top table.
    pub fn open(path: &Path) -> Result<Table, FileError> {
        Table::parse(read_text(path)?, path.display().to_string())
    }

    /// Reads TOML text; `name` stands for the file in errors.
    pub fn parse(text: impl Into<String>, name: impl Into<String>) -> Result<Table, FileError> {
        let file = File { name: name.into(), text: text.into() };
        let entries = tree::parse(&file.text).map_err(|(line, column, message)| {
            FileError::at(&file.name, line, "", format!("is not valid TOML at column {column}: {message}"))
        })?;
        Ok(Table { file: Arc::new(file), path: String::new(), line: 1, entries, known: Vec::new(), taken: Vec::new() })
    }

    /// The file's name, as the user gave it.
    pub fn file_name(&self) -> &str {
        &self.file.name
    }

    /// The whole text of the file.
    pub fn text(&self) -> &str {
        &self.file.text
    }

    /// Line on which this table begins, from 1.
    pub fn line(&self) -> usize {
        self.line
    }

    /// Dotted path of this table, such as `elements[2] "cable"`; empty at the top.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Adds the table's own name to its path, so that errors name it: `elements[2]` becomes `elements[2] "cable"`.
    pub fn label(&mut self, name: &str) {
        self.path = format!("{} \"{name}\"", self.path);
    }

    /// Whether a key stands in the table and was not taken yet.
    pub fn contains(&self, key: &str) -> bool {
        self.entries.iter().any(|e| e.key == key)
    }

    /// Keys that were not taken yet, in the order of the file: for tables whose keys are names.
    pub fn keys(&self) -> Vec<String> {
        self.entries.iter().map(|e| e.key.clone()).collect()
    }

    /// Line of a key of this table, taken or not; the table's own line where there is none.
    pub fn line_of(&self, key: &str) -> usize {
        let waiting = self.entries.iter().find(|e| e.key == key).map(|e| e.line);
        waiting.or_else(|| self.taken.iter().find(|t| t.0 == key).map(|t| t.1)).unwrap_or(self.line)
    }

    /// An error about this table.
    pub fn error(&self, message: impl Into<String>) -> FileError {
        FileError::at(&self.file.name, self.line, &self.path, message)
    }

    /// An error about a key of this table, taken or not.
    pub fn error_at(&self, key: &str, message: impl Into<String>) -> FileError {
        FileError::at(&self.file.name, self.line_of(key), self.path_of(key), message)
    }

    fn path_of(&self, key: &str) -> String {
        match self.path.as_str() {
            "" => key.to_string(),
            path if path.ends_with('"') => format!("{path} {key}"),
            path => format!("{path}.{key}"),
        }
    }

    fn take(&mut self, key: &str) -> Option<Node> {
        if !self.known.iter().any(|k| k == key) {
            self.known.push(key.to_string());
        }
        let entry = self.entries.remove(self.entries.iter().position(|e| e.key == key)?);
        self.taken.push((entry.key, entry.line));
        Some(entry.node)
    }

    fn wrong_type(&self, key: &str, node: &Node, expected: &str) -> FileError {
        self.error_at(key, format!("expected {expected}, found {}", node.describe()))
    }

    /// The error for a key that must be there: names a misspelling of it where one stands in the table.
    pub fn missing(&self, key: &str) -> FileError {
        let near = |other: &&Entry| key.len() > 3 && strsim::damerau_levenshtein(&other.key, key) <= 2;
        match self.entries.iter().find(near) {
            Some(other) => {
                FileError::at(&self.file.name, other.line, &self.path, format!("unknown key \"{}\"; did you mean \"{key}\"?", other.key))
            }
            None => self.error(format!("missing key \"{key}\"")),
        }
    }

    /// A number (an integer counts), finite and within `range`.
    pub fn number(&mut self, key: &str, range: Range) -> Result<Option<f64>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        self.as_number(key, &node, range).map(Some)
    }

    /// A number, or `default` where the file has none.
    pub fn number_or(&mut self, key: &str, range: Range, default: f64) -> Result<f64, FileError> {
        Ok(self.number(key, range)?.unwrap_or(default))
    }

    /// A number that must be there.
    pub fn need_number(&mut self, key: &str, range: Range) -> Result<f64, FileError> {
        self.number(key, range)?.ok_or_else(|| self.missing(key))
    }

    fn as_number(&self, key: &str, node: &Node, range: Range) -> Result<f64, FileError> {
        let value = match node.value {
            Value::Float(value) => value,
            Value::Integer(value) => value as f64,
            _ => return Err(self.wrong_type(key, node, "a number")),
        };
        check_range(value, range).map_err(|message| FileError::at(&self.file.name, node.line, self.path_of(key), message))?;
        Ok(value)
    }

    /// A list of numbers, each finite and within `range`.
    pub fn numbers(&mut self, key: &str, range: Range) -> Result<Option<Vec<f64>>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        let Value::Array(items) = &node.value else { return Err(self.wrong_type(key, &node, "a list of numbers")) };
        let path = |i: usize| format!("{key}[{i}]");
        items
            .iter()
            .enumerate()
            .map(|(i, item)| self.as_number(&path(i), item, range).map_err(|e| FileError { line: Some(item.line), ..e }))
            .collect::<Result<Vec<f64>, FileError>>()
            .map(Some)
    }

    /// An integer within `lowest..=highest`.
    pub fn integer(&mut self, key: &str, lowest: i64, highest: i64) -> Result<Option<i64>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        let Value::Integer(value) = node.value else { return Err(self.wrong_type(key, &node, "an integer")) };
        if value < lowest || value > highest {
            let expected = if highest == i64::MAX { format!("at least {lowest}") } else { format!("from {lowest} to {highest}") };
            return Err(self.error_at(key, format!("must be {expected}, is {value}")));
        }
        Ok(Some(value))
    }

    /// True or false.
    pub fn boolean(&mut self, key: &str) -> Result<Option<bool>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        let Value::Boolean(value) = node.value else { return Err(self.wrong_type(key, &node, "true or false")) };
        Ok(Some(value))
    }

    /// A string.
    pub fn string(&mut self, key: &str) -> Result<Option<String>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        match node.value {
            Value::String(value) => Ok(Some(value)),
            _ => Err(self.wrong_type(key, &node, "a string")),
        }
    }

    /// A string that must be there and may not be empty.
    pub fn need_string(&mut self, key: &str) -> Result<String, FileError> {
        let value = self.string(key)?.ok_or_else(|| self.missing(key))?;
        if value.is_empty() { Err(self.error_at(key, "must not be empty")) } else { Ok(value) }
    }

    /// A list of strings.
    pub fn strings(&mut self, key: &str) -> Result<Option<Vec<String>>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        let Value::Array(items) = &node.value else { return Err(self.wrong_type(key, &node, "a list of strings")) };
        items
            .iter()
            .enumerate()
            .map(|(i, item)| match &item.value {
                Value::String(text) => Ok(text.clone()),
                _ => Err(FileError::at(
                    &self.file.name,
                    item.line,
                    format!("{}[{i}]", self.path_of(key)),
                    format!("expected a string, found {}", item.describe()),
                )),
            })
            .collect::<Result<Vec<String>, FileError>>()
            .map(Some)
    }

    /// A list of lists of strings; one list of strings is a list of one.
    pub fn string_lists(&mut self, key: &str) -> Result<Option<Vec<Vec<String>>>, FileError> {
        let nested = match self.entries.iter().find(|e| e.key == key).map(|e| &e.node.value) {
            Some(Value::Array(items)) => items.iter().any(|item| matches!(item.value, Value::Array(_))),
            _ => false,
        };
        if !nested {
            let lists = |one: Vec<String>| if one.is_empty() { Vec::new() } else { vec![one] };
            return Ok(self.strings(key)?.map(lists));
        }
        let Some(node) = self.take(key) else { return Ok(None) };
        let Value::Array(lists) = &node.value else { return Err(self.wrong_type(key, &node, "a list of lists of strings")) };
        let wrong = |item: &Node, index: usize, expected: &str| {
            let message = format!("expected {expected}, found {}", item.describe());
            FileError::at(&self.file.name, item.line, format!("{}[{index}]", self.path_of(key)), message)
        };
        let list = |(index, list): (usize, &Node)| -> Result<Vec<String>, FileError> {
            let Value::Array(items) = &list.value else { return Err(wrong(list, index, "a list of strings")) };
            let text = |item: &Node| match &item.value {
                Value::String(text) => Ok(text.clone()),
                _ => Err(wrong(item, index, "strings")),
            };
            items.iter().map(text).collect()
        };
        lists.iter().enumerate().map(list).collect::<Result<_, _>>().map(Some)
    }

    /// A string or a list of strings; one string is a list of one.
    pub fn string_or_strings(&mut self, key: &str) -> Result<Option<Vec<String>>, FileError> {
        match self.entries.iter().find(|e| e.key == key).map(|e| &e.node.value) {
            Some(Value::String(_)) => Ok(self.string(key)?.map(|one| vec![one])),
            Some(Value::Array(_)) | None => self.strings(key),
            Some(_) => match self.take(key) {
                Some(node) => Err(self.wrong_type(key, &node, "a string or a list of strings")),
                None => Ok(None),
            },
        }
    }

    /// One of the given words; the error names the nearest, or all of them.
    pub fn one_of<T: Clone>(&mut self, key: &str, choices: &[(&str, T)]) -> Result<Option<T>, FileError> {
        let Some(word) = self.string(key)? else { return Ok(None) };
        match choices.iter().find(|c| c.0 == word) {
            Some(choice) => Ok(Some(choice.1.clone())),
            None => {
                let all: Vec<&str> = choices.iter().map(|c| c.0).collect();
                let message = match nearest(&word, all.iter().copied()) {
                    Some(near) => format!("unknown value \"{word}\"; did you mean \"{near}\"?"),
                    None => format!("unknown value \"{word}\"; expected one of {}", all.join(", ")),
                };
                Err(self.error_at(key, message))
            }
        }
    }

    /// One of the given words, which must be there.
    pub fn need_one_of<T: Clone>(&mut self, key: &str, choices: &[(&str, T)]) -> Result<T, FileError> {
        self.one_of(key, choices)?.ok_or_else(|| self.missing(key))
    }

    /// A table below this one, `[key]` or `key = { .. }`.
    pub fn table(&mut self, key: &str) -> Result<Option<Table>, FileError> {
        let Some(node) = self.take(key) else { return Ok(None) };
        match node.value {
            Value::Table(entries) => Ok(Some(self.below(self.path_of(key), node.line, entries))),
            _ => Err(self.wrong_type(key, &node, "a table")),
        }
    }

    /// The tables of `[[key]]`, or of a list of inline tables; none where the key is absent.
    pub fn tables(&mut self, key: &str) -> Result<Vec<Table>, FileError> {
        let Some(node) = self.take(key) else { return Ok(Vec::new()) };
        if matches!(node.value, Value::Table(_)) {
            return Err(self.error_at(key, format!("expected a list of tables: write [[{key}]], not [{key}]")));
        }
        let Value::Array(items) = node.value else { return Err(self.wrong_type(key, &node, "a list of tables")) };
        items
            .into_iter()
            .enumerate()
            .map(|(i, item)| {
                let path = format!("{}[{i}]", self.path_of(key));
                match item.value {
                    Value::Table(entries) => Ok(self.below(path, item.line, entries)),
                    _ => Err(FileError::at(&self.file.name, item.line, path, format!("expected a table, found {}", item.describe()))),
                }
            })
            .collect()
    }

    fn below(&self, path: String, line: usize, entries: Vec<Entry>) -> Table {
        Table { file: self.file.clone(), path, line, entries, known: Vec::new(), taken: Vec::new() }
    }

    /// Whether a key that was not taken yet holds a table.
    pub fn is_table(&self, key: &str) -> bool {
        self.entries.iter().any(|e| e.key == key && matches!(e.node.value, Value::Table(_)))
    }

    /// Whether a key that was not taken yet holds a string.
    pub fn is_string(&self, key: &str) -> bool {
        self.entries.iter().any(|e| e.key == key && matches!(e.node.value, Value::String(_)))
    }

    /// Whether a key that was not taken yet holds a list.
    pub fn is_list(&self, key: &str) -> bool {
        self.entries.iter().any(|e| e.key == key && matches!(e.node.value, Value::Array(_)))
    }

    /// Whether a key that was not taken yet holds a list that begins with a table.
    pub fn is_list_of_tables(&self, key: &str) -> bool {
        let begins = |value: &Value| match value {
            Value::Array(items) => items.first().is_some_and(|item| matches!(item.value, Value::Table(_))),
            _ => false,
        };
        self.entries.iter().any(|e| e.key == key && begins(&e.node.value))
    }

    /// Takes a key without looking at it: for keys that another reader of the same file owns.
    pub fn skip(&mut self, key: &str) {
        self.take(key);
    }

    /// Refuses any key that was not taken, naming the known key that is nearest.
    pub fn finish(self) -> Result<(), FileError> {
        let Some(extra) = self.entries.first() else { return Ok(()) };
        let message = match nearest(&extra.key, self.known.iter().map(String::as_str)) {
            Some(near) => format!("unknown key \"{}\"; did you mean \"{near}\"?", extra.key),
            None if self.known.is_empty() => format!("unknown key \"{}\"; this table has no keys", extra.key),
            None => format!("unknown key \"{}\"; known here: {}", extra.key, self.known.join(", ")),
        };
        Err(FileError::at(&self.file.name, extra.line, &self.path, message))
    }
}

/// Whether a number is finite and within a range; the error is one sentence without the key.
pub fn check_range(value: f64, range: Range) -> Result<(), String> {
    if !value.is_finite() {
        return Err(format!("must be a finite number, is {value}"));
    }
    match range {
        Range::Any => Ok(()),
        Range::NonNegative if value >= 0.0 => Ok(()),
        Range::NonNegative => Err(format!("must be at least 0, is {value}")),
        Range::Positive if value > 0.0 => Ok(()),
        Range::Positive => Err(format!("must be above 0, is {value}")),
        Range::Between(low, high) if (low..=high).contains(&value) => Ok(()),
        Range::Between(low, high) => Err(format!("must be from {low} to {high}, is {value}")),
    }
}

#[cfg(test)]
mod tests;
