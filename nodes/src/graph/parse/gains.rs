//! `[gains]`: at the start and later.

use backdrive_control::scaling::{GainChange, GainPlan};
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table};

pub(super) fn read_gains(top: &mut Table) -> Result<GainPlan, FileError> {
    let mut plan = GainPlan { mu: 1.0, lambda: 0.0, ramp_s: 0.05, changes: Vec::new() };
    let Some(mut gains) = top.table("gains")? else { return Ok(plan) };
    plan.mu = gains.number_or("mu", Range::NonNegative, 1.0)?;
    plan.lambda = gains.need_number("lambda", Range::NonNegative)?;
    for (key, scale) in [("mu", plan.mu), ("lambda", plan.lambda)] {
        possible(&gains, key, scale)?;
    }
    plan.ramp_s = gains.number_or("ramp_s", Range::NonNegative, 0.05)?;
    let (mut mu, mut lambda, mut last) = (plan.mu, plan.lambda, 0.0);
    for mut change in gains.tables("change")? {
        let at_s = change.need_number("at_s", Range::NonNegative)?;
        if at_s < last {
            return Err(change.error_at("at_s", "changes must be in order of time"));
        }
        mu = change.number_or("mu", Range::NonNegative, mu)?;
        lambda = change.number_or("lambda", Range::NonNegative, lambda)?;
        possible(&change, "mu", mu)?;
        possible(&change, "lambda", lambda)?;
        last = at_s;
        change.finish()?;
        plan.changes.push(GainChange { at_s, mu, lambda });
    }
    gains.finish()?;
    Ok(plan)
}

/// Largest scale of position or force. From the weakest sensor to the strongest slave there are six decades: a larger value is a typing error, and
/// its results would leave all bounds in a few steps.
const LARGEST_SCALE: f64 = 1e6;

fn possible(table: &Table, key: &str, scale: f64) -> Result<(), FileError> {
    match scale <= LARGEST_SCALE {
        true => Ok(()),
        false => {
            Err(table.error_at(key, format!("is {scale:e}, and a scale between two devices is at most {LARGEST_SCALE:e}: check its units")))
        }
    }
}
