//! The times of a table, in s.

use super::mapping::ImportOptions;
use super::types::{Cells, Table, name_of, unit_of};
use crate::BagError;
use crate::number_type::NumberType;
use backdrive_plant::recording::units::{self, Kind, Unit};
use std::borrow::Cow;
use std::path::Path;

/// The times of the rows.
pub(super) struct Times<'a> {
    /// Place of their column; `None` where the rate gives them.
    pub(super) place: Option<usize>,
    /// s, rising.
    pub(super) values: Cow<'a, [f64]>,
    pub(super) of: NumberType,
    /// What a person should know of them.
    pub(super) note: Option<String>,
}

/// Steps above which times are not taken for seconds, s: no recording is that slow, and ns or us without a unit look like this.
const NO_SECONDS: f64 = 1000.0;

/// Finds the column that is asked for: by its heading, by its name, or as `NAME [unit]` where its heading names no unit.
pub(super) fn times_of<'a>(path: &Path, table: &'a Table, options: &ImportOptions) -> Result<Times<'a>, BagError> {
    let asked = options.time.as_str();
    if let Some(rate) = options.rate_hz {
        return by_rate(path, table, asked, rate);
    }
    let (place, unit) = match table.find(path, asked)? {
        Some(place) => (place, unit_of(&table.columns[place].name)),
        None => match unit_of(asked).map(|unit| table.find(path, name_of(asked)).map(|place| (place, unit))).transpose()? {
            Some((Some(place), unit)) => (place, Some(unit)),
            _ => {
                return Err(table.no_column(
                    path,
                    asked,
                    ": name the one with the times with --time, or give the sampling rate with --rate HZ",
                ));
            }
        },
    };
    let heading = &table.columns[place].name;
    // A unit that is stated and not known is no reason to take the times for seconds.
    let unit = match unit {
        None => units::of_times(heading)
            .map_err(|what| table.wrong_columns(path, format!("column {heading:?}: {what}; or give it as --time \"{heading} [ms]\"")))?,
        unit => unit,
    };
    if let Some(unit) = unit.filter(|unit| unit.kind != Kind::Time) {
        let what = format!("column {heading:?} is in {}, {}, expected a time such as s or ms", unit.name, unit.kind.text());
        return Err(table.wrong_columns(path, what));
    }
    let name = units::split(heading).0;
    let (values, of, note) = match &table.columns[place].cells {
        Cells::Numbers(values, of) => match unit.map_or(1.0, |unit| unit.factor) {
            1.0 => (Cow::from(values), *of, None),
            factor => (values.iter().map(|value| value * factor).collect(), NumberType::Double, None),
        },
        Cells::Large { values, per_second } => {
            let Some(second) = per_second.or(unit.map(a_second)) else {
                let what = format!("the times in {name:?} are whole numbers beyond 2^53: {}", say_unit(name));
                return Err(table.wrong_columns(path, what));
            };
            let first = values.first().copied().unwrap_or(0);
            // Differences of whole numbers: seconds since 1970 would leave only 0.2 us of a double.
            let times = values.iter().map(|value| (i128::from(*value) - i128::from(first)) as f64 / second).collect();
            (times, NumberType::Double, Some(format!("times are counted from the first row, whose {name:?} is {first}")))
        }
        Cells::Other(holds) => {
            return Err(
                table.wrong_columns(path, format!("column {name:?} contains {}; times must be numbers", holds.trim_end_matches(',')))
            );
        }
    };
    if values.is_empty() {
        let what = if table.lines.is_some() { "there are no rows below the heading" } else { "there are no rows" };
        return Err(table.wrong_columns(path, what.to_owned()));
    }
    check(path, table, name, &values)?;
    Ok(Times { place: Some(place), values, of, note })
}

/// Times of evenly spaced rows, from 0.
fn by_rate<'a>(path: &Path, table: &Table, asked: &str, rate: f64) -> Result<Times<'a>, BagError> {
    if !rate.is_finite() || rate <= 0.0 {
        return Err(BagError::Usage(format!("--rate {rate:?}: expected rows per second, above 0")));
    }
    if table.find(path, asked)?.is_some() {
        let what = format!("there is a column {asked:?} with the times; leave --rate out, or name that column otherwise");
        return Err(table.wrong_columns(path, what));
    }
    let rows = table.columns.iter().map(|column| column.cells.len()).max().unwrap_or(0);
    if rows == 0 {
        return Err(table.wrong_columns(path, "there are no rows with numbers".to_owned()));
    }
    let values: Vec<f64> = (0..rows).map(|row| row as f64 / rate).collect();
    check(path, table, "--rate", &values)?;
    Ok(Times { place: None, values: values.into(), of: NumberType::Double, note: None })
}

/// How many of a unit of time make a second.
fn a_second(unit: Unit) -> f64 {
    // Of units below a second a whole number, which their sizes as doubles are next to.
    if unit.factor < 1.0 { (1.0 / unit.factor).round() } else { 1.0 / unit.factor }
}

fn say_unit(name: &str) -> String {
    format!("state their unit, in the heading or as --time \"{name} [ns]\"")
}

/// Times have to grow: every step in a bag has one.
fn check(path: &Path, table: &Table, name: &str, times: &[f64]) -> Result<(), BagError> {
    if let Some(row) = times.iter().position(|time| time.is_nan()) {
        return Err(table.wrong(path, row, format!("column {name:?}: expected a time, found none (NaN); leave such rows out")));
    }
    // Stamps of messages have 32 bits of seconds.
    if let Some(row) = times.iter().position(|time| time.abs() > f64::from(i32::MAX)) {
        return Err(table.wrong(
            path,
            row,
            format!("{:?} is not a time in s; if the times are in another unit, {}", times[row], say_unit(name)),
        ));
    }
    if let Some(row) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        let (before, now) = (times[row], times[row + 1]);
        let what = match now == before {
            true => format!("the time {now:?} s is in two rows; remove the duplicate"),
            false => format!("time goes back from {before:?} to {now:?} s; cut the recording there"),
        };
        return Err(table.wrong(path, row + 1, what));
    }
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() || *steps.select_nth_unstable_by(middle, f64::total_cmp).1 < NO_SECONDS {
        return Ok(());
    }
    let what = format!("the times in {name:?} are usually {:?} s apart, which is implausible: {}", steps[middle], say_unit(name));
    Err(table.wrong_columns(path, what))
}
