//! A table of a TOML file that is read key by key: missing, wrong or unread keys are reported with their file and line.

use super::allowed::Allowed;
use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use toml_edit::{Item, TableLike};

/// What is wrong in a model file or a grip, and where.
///
/// Reads `master.toml:14: elements[2] "cable": stiffness: expected a number above 0, found -3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NetworkError {
    /// The file, as the caller named it.
    pub file: String,
    /// Line, from 1; `None` where the whole file is meant.
    pub line: Option<usize>,
    /// The table and key, such as `inputs[0] "force": on`; empty where the whole file is meant.
    pub key: String,
    /// What was found, what was expected, and what to do.
    pub message: String,
}

impl fmt::Display for NetworkError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)
    }
}

impl std::error::Error for NetworkError {}

/// The text that a table stands in.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl Source<'_> {
    /// An error at a stretch of the text.
    pub fn error(&self, span: Option<Range<usize>>, key: &str, message: impl Into<String>) -> NetworkError {
        let line = span.and_then(|span| self.text.get(..span.start)).map(|before| before.matches('\n').count() + 1);
        NetworkError { file: self.file.to_string(), line, key: key.to_string(), message: message.into() }
    }
}

/// A table whose keys are taken one by one.
pub(crate) struct Section<'a> {
    source: Source<'a>,
    table: &'a dyn TableLike,
    span: Option<Range<usize>>,
    label: String,
    taken: BTreeSet<String>,
}

impl<'a> Section<'a> {
    pub fn new(source: Source<'a>, table: &'a dyn TableLike, span: Option<Range<usize>>, label: &str) -> Section<'a> {
        Section { source, table, span, label: label.to_string(), taken: BTreeSet::new() }
    }

    /// Adds a name to the label that errors carry.
    pub fn call(&mut self, name: &str) {
        self.label = format!("{} \"{name}\"", self.label);
    }

    fn take(&mut self, key: &str) -> Option<&'a Item> {
        self.taken.insert(key.to_string());
        self.table.get(key).filter(|item| !item.is_none())
    }

    /// An error about one key, or about the section where the key is not there.
    pub fn error(&self, key: &str, message: impl Into<String>) -> NetworkError {
        let span = self.table.get(key).and_then(Item::span).or_else(|| self.span.clone());
        let key = if self.label.is_empty() { key.to_string() } else { format!("{}: {key}", self.label) };
        self.source.error(span, &key, message)
    }

    pub fn text(&mut self, key: &str) -> Result<Option<&'a str>, NetworkError> {
        match self.take(key) {
            None => Ok(None),
            Some(item) => item.as_str().map(Some).ok_or_else(|| self.error(key, "expected a text in quotes")),
        }
    }

    pub fn need_text(&mut self, key: &str) -> Result<&'a str, NetworkError> {
        self.text(key)?.ok_or_else(|| self.error(key, "missing; add it"))
    }

    pub fn flag(&mut self, key: &str) -> Result<bool, NetworkError> {
        match self.take(key) {
            None => Ok(false),
            Some(item) => item.as_bool().ok_or_else(|| self.error(key, "expected true or false")),
        }
    }

    pub fn number(&mut self, key: &str, allowed: Allowed) -> Result<Option<f64>, NetworkError> {
        let Some(item) = self.take(key) else { return Ok(None) };
        let value = item.as_float().or_else(|| item.as_integer().map(|n| n as f64));
        match value {
            Some(value) if allowed.holds(value) => Ok(Some(value)),
            Some(value) => Err(self.error(key, format!("expected {}, found {value}", allowed.words()))),
            None => Err(self.error(key, format!("expected {}", allowed.words()))),
        }
    }

    pub fn need_number(&mut self, key: &str, allowed: Allowed) -> Result<f64, NetworkError> {
        self.number(key, allowed)?.ok_or_else(|| self.error(key, format!("missing; add {}", allowed.words())))
    }

    pub fn numbers(&mut self, key: &str, allowed: Allowed) -> Result<Option<Vec<f64>>, NetworkError> {
        let Some(item) = self.take(key) else { return Ok(None) };
        let wrong = || self.error(key, format!("expected a list, each entry {}", allowed.words()));
        let list = item.as_array().ok_or_else(wrong)?;
        let values: Option<Vec<f64>> = list
            .iter()
            .map(|entry| entry.as_float().or_else(|| entry.as_integer().map(|n| n as f64)).filter(|value| allowed.holds(*value)))
            .collect();
        values.map(Some).ok_or_else(wrong)
    }

    /// A text or a list of texts.
    pub fn texts(&mut self, key: &str) -> Result<Vec<&'a str>, NetworkError> {
        let Some(item) = self.take(key) else { return Err(self.error(key, "missing; add it")) };
        if let Some(one) = item.as_str() {
            return Ok(vec![one]);
        }
        let list: Option<Vec<&str>> = item.as_array().and_then(|list| list.iter().map(|entry| entry.as_str()).collect());
        list.ok_or_else(|| self.error(key, "expected a text in quotes, or a list of them"))
    }

    /// The names and numbers of a table such as `[bodies]`.
    pub fn named_numbers(&mut self, key: &str, allowed: Allowed) -> Result<Vec<(&'a str, f64)>, NetworkError> {
        let Some(item) = self.take(key) else { return Ok(Vec::new()) };
        let table = item.as_table_like().ok_or_else(|| self.error(key, "expected a table of names and numbers"))?;
        let mut inner = Section::new(self.source, table, item.span(), key);
        let names: Vec<&str> = table.iter().map(|(name, _)| name).collect();
        names.into_iter().map(|name| Ok((name, inner.need_number(name, allowed)?))).collect()
    }

    /// The tables of a list such as `[[elements]]`.
    pub fn sections(&mut self, key: &str) -> Result<Vec<Section<'a>>, NetworkError> {
        let Some(item) = self.take(key) else { return Ok(Vec::new()) };
        let mut found = Vec::new();
        if let Some(tables) = item.as_array_of_tables() {
            for (index, table) in tables.iter().enumerate() {
                found.push(Section::new(self.source, table, table.span(), &format!("{key}[{index}]")));
            }
        } else if let Some(list) = item.as_array() {
            for (index, entry) in list.iter().enumerate() {
                let table = entry.as_inline_table().ok_or_else(|| self.error(key, format!("expected tables: write [[{key}]]")))?;
                found.push(Section::new(self.source, table, entry.span(), &format!("{key}[{index}]")));
            }
        } else {
            return Err(self.error(key, format!("expected a list of tables: write [[{key}]]")));
        }
        Ok(found)
    }

    /// Refuses keys that were not read.
    pub fn finish(self) -> Result<(), NetworkError> {
        match self.table.iter().map(|(key, _)| key).find(|key| !self.taken.contains(*key)) {
            None => Ok(()),
            Some(key) => {
                let known: Vec<&str> = self.taken.iter().map(String::as_str).collect();
                Err(self.error(key, format!("unknown key; correct or remove it, there is {}", known.join(", "))))
            }
        }
    }
}
