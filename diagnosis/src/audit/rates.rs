//! Sample times that cannot be right: recordings of different rates in one set, and time in another unit than seconds.

use super::remark::file_name;
use super::units::factor;
use crate::output_error::evaluator::measured;
use crate::output_error::simulate::predict;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::stepper::segments;

/// Units that time is recorded in, s, and how its values read.
const UNITS: [(f64, &str); 3] = [(1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds")];

/// Whether the sample times of a set's recordings are compatible. Between samples an input runs as its hold states, so a slow recording may miss an
/// excitation that a fast one shows.
///
/// # Errors
/// One sentence where two recordings differ by more than a factor of two, with what to do.
pub fn rates(problem: &Problem) -> Result<(), String> {
    let all: Vec<&Record> = problem.fit.iter().chain(&problem.held_out).collect();
    let by_period = |a: &&&Record, b: &&&Record| a.period.total_cmp(&b.period);
    let (Some(fast), Some(slow)) = (all.iter().min_by(by_period), all.iter().max_by(by_period)) else { return Ok(()) };
    let ratio = slow.period / fast.period;
    if ratio <= tuning().recordings.sample_times {
        return Ok(());
    }
    let (slow_name, fast_name) = (file_name(&slow.name), file_name(&fast.name));
    let unit = UNITS.iter().find(|(unit, _)| (ratio * unit).max(1.0 / (ratio * unit)) < tuning().recordings.unit_near);
    let advice = match unit {
        Some((unit, word)) => format!(
            "its time looks like {word}: write t = {{ column = \"t\", scale = {unit:e} }} under [columns] of a set.toml for these files, \
                or convert it"
        ),
        None => "the input between the slow samples is unknown. Record all at one rate, diagnose them separately, or set mixed_rates = \
                 true in set.toml if the slow input really is held between samples"
            .to_string(),
    };
    Err(format!(
        "{slow_name}: has a sample every {:.4} s, {fast_name} one every {:.4} s ({ratio:.3} times); {advice}",
        slow.period, fast.period
    ))
}

/// Whether time is in seconds, as far as the nominal model can tell: a sentence where another unit makes measured and predicted agree.
pub(super) fn unit_of_time(problem: &Problem) -> Option<String> {
    let record = problem.fit.iter().max_by(|a, b| a.period.total_cmp(&b.period)).filter(|r| r.period > tuning().recordings.slow)?;
    let as_given = unexplained_variance(problem, record, record.period)?;
    let (left, unit, word) = UNITS
        .iter()
        .filter_map(|(unit, word)| Some((unexplained_variance(problem, record, record.period * unit)?, *unit, *word)))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let better = left < (1.0 - tuning().recordings.time_unit_removes) * as_given
        && left < 1.0 - tuning().recordings.unit_correlates * tuning().recordings.unit_correlates;
    better.then(|| {
        format!(
            "{}: has a sample every {:.4} s, which does not fit the model. Read as {word} it explains {:.0} % of the motion's variance \
             instead of {:.0} %. Write t = {{ column = \"t\", scale = {unit:e} }} under [columns] of set.toml, or convert the column to \
             seconds",
            file_name(&record.name),
            record.period,
            100.0 * (1.0 - left),
            100.0 * (1.0 - as_given)
        )
    })
}

/// Smallest share of an output's variance that the scaled prediction of the nominal model does not explain when the samples are taken at this period. Where
/// no spring holds the position, the variance is that of differences over a lag.
fn unexplained_variance(problem: &Problem, record: &Record, period: f64) -> Option<f64> {
    let mut record = record.clone();
    (record.period, record.logged) = (period, None);
    record.segments =
        problem.model.inputs.iter().zip(&record.inputs).map(|(input, samples)| segments(input.hold, samples, period)).collect();
    let predicted = predict(&problem.model, &record, 16)?;
    let share = |(place, output): (usize, usize)| {
        let column = predicted.get(place * record.len..(place + 1) * record.len)?;
        let samples = record.outputs.get(output)?.as_deref()?;
        let correlation = factor(samples, column, problem.lag.get(output).copied().unwrap_or(0)).1;
        Some(1.0 - correlation.max(0.0).powi(2)).filter(|s| s.is_finite())
    };
    measured(&record).enumerate().filter_map(share).min_by(f64::total_cmp)
}
