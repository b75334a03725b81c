//! Headings of a table: which column a signal is read from, and in which unit.

use super::columns::{Columns, Source};
use super::units::{self, Unit};
use crate::tomlfile::{self, FileError};

/// A column to be read.
pub(super) struct Wanted {
    pub(super) signal: String,
    pub(super) heading: String,
    pub(super) index: usize,
    pub(super) factor: f64,
    pub(super) offset: f64,
    /// The unit whose kind has to go with the signal.
    pub(super) unit: Option<Unit>,
}

/// The headings of a table.
pub(super) struct Headings<'a> {
    /// The table, for errors.
    pub(super) name: &'a str,
    /// Where the heading stands.
    pub(super) line: usize,
    /// As they stand there.
    pub(super) headings: &'a [String],
}

impl Headings<'_> {
    /// The place of a column.
    pub(super) fn index_of(&self, heading: &str, signal: &str, asked_by: &str) -> Result<usize, FileError> {
        let mut found = self.headings.iter().enumerate().filter(|h| *h.1 == heading).map(|h| h.0);
        // Without its unit a heading is meant too, where no column is called exactly so.
        let mut bare = self.headings.iter().enumerate().filter(|h| units::split(h.1).0 == heading).map(|h| h.0);
        let pair = (found.next(), found.next());
        match if pair.0.is_some() { pair } else { (bare.next(), bare.next()) } {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => Err(FileError::at(self.name, self.line, heading, "two columns have this heading")),
            (None, _) => {
                let mut message = tomlfile::unknown("column", heading, self.headings.iter().map(String::as_str));
                if heading == signal && asked_by.is_empty() {
                    message.push_str(&format!(" ([columns] {signal} = \"...\" names the column)"));
                }
                Err(FileError::at(self.name, self.line, asked_by, message))
            }
        }
    }

    /// Where a signal stands.
    pub(super) fn find(&self, signal: &str, columns: &Columns) -> Result<Wanted, FileError> {
        let rule = columns.iter().find(|c| c.0 == signal).map(|c| &c.1);
        let heading = match rule.map(|r| &r.source) {
            None => signal,
            Some(Source::Column(heading)) => heading,
            Some(Source::Topic { topic, .. }) => {
                let message = format!("[columns] reads \"{signal}\" from the topic {topic}, but a CSV file has columns");
                return Err(FileError::at(self.name, self.line, "", message));
            }
        };
        let asked_by = if rule.is_some() && heading != signal { format!("[columns] {signal}") } else { String::new() };
        let index = self.index_of(heading, signal, &asked_by)?;
        let heading = self.headings.get(index).map_or(heading, String::as_str).to_string();
        let (factor, unit) = match rule.filter(|r| r.unit.is_some() || r.scale.is_some()) {
            Some(rule) => (rule.factor(), rule.checked_unit()),
            None => {
                let unit = units::split(&heading).1.map(units::parse).transpose();
                let unit = unit.map_err(|message| {
                    FileError::at(
                        self.name,
                        self.line,
                        &heading,
                        format!("{message}; or set scale for \"{signal}\" under [columns] of set.toml"),
                    )
                })?;
                (unit.map_or(1.0, |u| u.factor), unit)
            }
        };
        let offset = rule.map_or(0.0, |r| r.offset);
        Ok(Wanted { signal: signal.to_string(), heading, index, factor, offset, unit })
    }

    /// The column of the times: `time_ms` is in ms unless another unit is stated.
    pub(super) fn timed(&self, time: Wanted, columns: &Columns) -> Result<Wanted, FileError> {
        let is_ruled = columns.iter().any(|(signal, rule)| signal == "t" && (rule.unit.is_some() || rule.scale.is_some()));
        match units::of_times(&time.heading) {
            _ if is_ruled || time.unit.is_some() => Ok(time),
            Ok(Some(unit)) => Ok(Wanted { factor: unit.factor, unit: Some(unit), ..time }),
            Ok(None) => Ok(time),
            Err(message) => Err(FileError::at(self.name, self.line, &time.heading, message)),
        }
    }

    /// Every signal that `columns` names, and every other column by its own heading.
    pub(super) fn all(&self, columns: &Columns, time: &Wanted) -> Result<Vec<Wanted>, FileError> {
        let ruled = columns.iter().map(|c| c.0.as_str()).filter(|s| *s != "t");
        let mut wanted = ruled.map(|s| self.find(s, columns)).collect::<Result<Vec<_>, _>>()?;
        for heading in self.headings {
            let index = self.index_of(heading, heading, "")?;
            let (name, unit) = units::split(heading);
            if index == time.index || wanted.iter().any(|w| w.index == index || w.signal == *heading) {
                continue;
            }
            let heading = heading.clone();
            // A column that was not requested may be in any unit: where it is not known, the column keeps its whole heading as its name.
            let known = unit.map(units::parse).transpose().ok().filter(|_| !wanted.iter().any(|w| w.signal == name));
            wanted.push(match known {
                Some(unit) => {
                    Wanted { signal: name.to_string(), heading, index, factor: unit.map_or(1.0, |u| u.factor), offset: 0.0, unit }
                }
                None => Wanted { signal: heading.clone(), heading, index, factor: 1.0, offset: 0.0, unit: None },
            });
        }
        Ok(wanted)
    }
}
