//! What is a matter of timing: an effect that comes late by a small share of a sample period.

use super::findings::is_timing_of;
use crate::audit::{Remark, Weight};
use crate::belief::choice::chosen;
use crate::belief::plausible::lag;
use crate::recordings::problem::Problem;
use crate::search::Search;
use crate::tuning::tuning;

/// Time shifts of the best explanation that are so small that they concern the sampling times, not the device.
pub fn timing(problem: &Problem, search: &Search) -> Vec<Remark> {
    let best = chosen(search);
    let values = best.structure.added_of(&best.fit.values);
    let period = problem.fit.iter().map(|r| r.period).fold(f64::INFINITY, f64::min);
    let one = |(which, hypothesis): (usize, &crate::hypothesis::Hypothesis)| {
        let late = lag(hypothesis, values.get(which)?).filter(|_| is_timing_of(problem, best, which))?;
        let text = format!(
            "seems to lag by {:.3} ms, {:.1} % of a sample period: an effect of sampling time or of the input between samples, not of the \
             device (less than {:.0} % is not claimed)",
            1e3 * late,
            100.0 * late / period,
            100.0 * tuning().claim.timing
        );
        Some(Remark { weight: Weight::Note, records: Vec::new(), signal: hypothesis.place.to_string(), about: "timing", text })
    };
    best.structure.added.iter().enumerate().filter_map(one).collect()
}
