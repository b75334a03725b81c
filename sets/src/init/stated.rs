//! Units that nothing states: SI units are assumed, which is said, and refused where the values contradict it.

use super::ask::usage;
use super::error::InitError;
use super::options::Driven;
use super::plan::{Plan, Signal};
use backdrive_plant::recording::Recording;
use backdrive_plant::recording::units::Kind;
use backdrive_report::number;
use std::f64::consts::TAU;

/// A joint's angle reaches no further than one turn; degrees that are taken for radians do from 6.3 degrees on.
const MOST_ANGLE: f64 = TAU;
/// Travel that no desk-sized device has, m; millimetres that are taken for metres have it from 5 mm on.
const MOST_LENGTH: f64 = 5.0;
/// Time between rows in which a device moves unseen, s; milliseconds that are taken for seconds have it at 2 kHz and slower.
const MOST_STEP: f64 = 0.5;
/// Time between rows from which on seconds are worth a word, s.
const SLOW_STEP: f64 = 0.05;

/// What is assumed of units, in one sentence; `None` where all are stated.
///
/// # Errors
/// Usage: an assumption that the values contradict, with the option and the heading that state the unit.
pub fn check(plan: &Plan, records: &[Recording]) -> Result<Option<String>, InitError> {
    let moving = if plan.driven == Driven::Motion { Some(&plan.drive) } else { plan.position.as_ref() };
    if let Some((signal, (option, unit))) = moving.and_then(|signal| Some((signal, signal.assumed.as_ref()?))) {
        let (most, other) = if unit.kind == Kind::Angle { (MOST_ANGLE, "deg") } else { (MOST_LENGTH, "mm") };
        let reach = records.iter().filter_map(|record| reach(record.signal(&signal.name)?)).fold(0.0, f64::max);
        if reach > most {
            let turns = if unit.kind == Kind::Angle { format!(", {} turns", number(reach / TAU)) } else { String::new() };
            return Err(refused(signal, option, unit.name, &format!("its values span {} {}{turns}", number(reach), unit.name), other));
        }
    }
    let step = records.iter().map(|record| record.period).fold(0.0, f64::max);
    let time = plan.time.as_ref().and_then(|time| Some((time, time.assumed.as_ref()?)));
    if let Some((time, (option, unit))) = time.filter(|_| step >= MOST_STEP) {
        return Err(refused(time, option, unit.name, &format!("its rows are {} s apart", number(step)), "ms"));
    }
    let time = time.filter(|_| step >= SLOW_STEP).map(|(time, _)| time);
    let assumed: Vec<String> = std::iter::once(&plan.drive)
        .chain(plan.measured())
        .chain(time)
        .filter_map(|signal| {
            signal.assumed.as_ref().map(|(option, unit)| format!("{} in {} (--{option})", signal.column.short_name(), unit.name))
        })
        .collect();
    Ok((!assumed.is_empty()).then(|| format!("units not stated, assumed: {}", assumed.join(", "))))
}

/// The largest of what a signal spans and how far it is from 0.
fn reach(samples: &[f64]) -> Option<f64> {
    let first = *samples.first()?;
    let (low, high) = samples.iter().fold((first, first), |(low, high), x| (low.min(*x), high.max(*x)));
    Some((high - low).max(low.abs()).max(high.abs()))
}

fn refused(signal: &Signal, option: &str, assumed: &str, but: &str, other: &str) -> InitError {
    let (column, short) = (&signal.column.name, signal.column.short_name());
    usage(format!(
        "the unit of {column} is not stated, and assumed as {assumed} {but}: give --{option} {other} or --{option} {assumed}, or state it \
         in the heading, as \"{short} [{other}]\""
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reach_is_the_span_or_the_distance_from_0() {
        assert_eq!((reach(&[1.0, -2.0, 3.0]), reach(&[100.0, 101.0]), reach(&[])), (Some(5.0), Some(101.0), None));
    }
}
