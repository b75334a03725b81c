//! Which column of a table is the time, and in which unit.

use crate::names;
use crate::numeric::{deviation, mean, median};
use crate::quantity::Quantity;
use crate::source::Options;
use backdrive_bags::RawColumn;
use backdrive_plant::recording::units::{self, Kind};

/// The times of a table.
pub enum Found {
    /// A column.
    Column {
        /// Its place.
        place: usize,
        /// Times of the rows, s.
        seconds: Vec<f64>,
        /// What a person should know of it.
        note: Option<String>,
        /// Its heading.
        heading: String,
    },
    /// Evenly spaced rows, the number per second.
    Rate(f64),
}

/// Share of steps that have to go forward in a column of times: a clock that goes back now and then is a finding, not a reason to take another column.
const FORWARD: f64 = 0.9;
/// Steps of times vary by less than this share of them where only the data say that they are times.
const STEADY: f64 = 0.5;
/// Steps above which numbers without a unit are not taken for seconds: no recording of joints is slower than twice a second.
const NO_SECONDS: f64 = 0.5;
/// The slowest rate at which joints are recorded, Hz: of the units ms, us and ns the first that gives more is taken.
const SLOWEST_HZ: f64 = 5.0;

/// Finds the times.
///
/// # Errors
/// There are none, and what to do.
pub fn find(columns: &[RawColumn], options: &Options) -> Result<Found, String> {
    if let Some(rate) = options.rate_hz {
        return match rate.is_finite() && rate > 0.0 {
            true => Ok(Found::Rate(rate)),
            false => Err(format!("--rate {rate}: expected rows per second, above 0")),
        };
    }
    if columns.iter().all(|column| column.values.len() < 2) {
        return Err("contains fewer than two rows of numbers: record again, or name the file that has them".to_string());
    }
    let is_clock = |column: &RawColumn| {
        let steps: Vec<f64> = column.values.windows(2).map(|w| w[1] - w[0]).collect();
        !steps.is_empty()
            && steps.iter().filter(|step| **step >= 0.0).count() as f64 >= FORWARD * steps.len() as f64
            && median(&steps) > 0.0
    };
    let is_steady = |column: &RawColumn| {
        let steps: Vec<f64> = column.values.windows(2).map(|w| w[1] - w[0]).collect();
        is_clock(column) && deviation(&steps) < STEADY * mean(&steps)
    };
    let named = |column: &RawColumn| {
        column.unit.is_some_and(|unit| unit.kind == Kind::Time) || names::read(&column.name, "").quantity == Some(Quantity::Time)
    };
    let asked = |column: &RawColumn| options.time.as_ref().is_some_and(|time| *time == column.name || units::split(time).0 == column.name);
    let place =
        columns.iter().position(asked).or_else(|| columns.iter().position(|column| named(column) && is_clock(column))).or_else(|| {
            columns.iter().position(|column| is_steady(column) && names::read(&column.name, "").quantity != Some(Quantity::Counter))
        });
    let Some((place, column)) = place.and_then(|place| Some((place, columns.get(place)?))) else {
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        return Err(format!("no column holds times; there is {}: give the sampling rate with --rate HZ", names.join(", ")));
    };
    if let Some(other) = &column.other {
        return Err(format!("column {:?} contains {other}; times must be numbers", column.name));
    }
    let steps: Vec<f64> = column.values.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
    let step = median(&steps);
    let hint = column.unit.or_else(|| units::of_times(&column.name).ok().flatten()).filter(|unit| unit.kind == Kind::Time);
    let (factor, note) = match hint {
        Some(unit) => (unit.factor, None),
        None if step < NO_SECONDS => (1.0, None),
        None => {
            let unit = ["ms", "us", "ns"].into_iter().filter_map(|unit| units::parse(unit).ok());
            let unit = unit.into_iter().find(|unit| step * unit.factor < 1.0 / SLOWEST_HZ);
            let unit =
                unit.ok_or_else(|| format!("column {:?}: its steps of {step} match no known unit of time; give --rate HZ", column.name))?;
            let note = format!(
                "the times in {:?} have steps of {step} and are assumed to be in {}: state it in the set: [columns] t = {{ column = {:?}, \
                    unit = {:?} }}",
                column.name, unit.name, column.name, unit.name
            );
            (unit.factor, Some(note))
        }
    };
    let seconds = column.values.iter().map(|time| time * factor).collect();
    Ok(Found::Column { place, seconds, note, heading: column.name.clone() })
}
