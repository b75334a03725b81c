//! What is never claimed, however well it fits: parameters that no device has, effects before their cause, and what is a matter of timing.

use crate::hypothesis::{Family, Hypothesis, Parameter};
use crate::output_error::candidate::Candidate;
use crate::output_error::structure::{FreeParameter, Role};
use crate::tuning::tuning;

/// Whether every effect that a structure adds has plausible parameters, inside the documented range of the effect. Its size must not be at the end of what
/// the fit may try, and must surely differ from nothing.
pub(crate) fn is_plausible(candidate: &Candidate) -> bool {
    added(candidate).all(|(hypothesis, parameter, number, value)| {
        let range = hypothesis.physics.facts.plausible.iter().find(|(key, _, _)| *key == parameter.key);
        let inside = range.is_none_or(|(_, least, most)| (*least..=*most).contains(&value));
        // At the end at which it does nothing, it has only led the rest out of a wrong valley.
        inside && !(parameter.key == hypothesis.physics.size && parameter.index.is_none() && number.at_bound(value).is_some())
    }) && !candidate.may_be_nothing
}

/// Whether a parameter of an added effect is at the end of what the fit may try, other than the end at which it does nothing.
pub(crate) fn is_at_bound(candidate: &Candidate) -> bool {
    added(candidate).any(|(_, parameter, number, value)| at_end(parameter, number, value))
}

/// The same of one of its effects.
pub(crate) fn is_at_bound_of(candidate: &Candidate, which: usize) -> bool {
    let own = candidate.structure.added.get(which).map(|h| h.id.as_str());
    added(candidate).any(|(h, parameter, number, value)| Some(h.id.as_str()) == own && at_end(parameter, number, value))
}

/// Whether an effect is a matter of timing: it comes late by a small share of the sample `period`, s.
pub(crate) fn is_timing(hypothesis: &Hypothesis, values: &[f64], period: f64) -> bool {
    hypothesis.physics.family == Family::Lag && lag(hypothesis, values).is_some_and(|lag| lag.abs() < tuning().claim.timing * period)
}

/// By how much an effect of the family of lags comes late, s.
pub(crate) fn lag(hypothesis: &Hypothesis, values: &[f64]) -> Option<f64> {
    let (parameter, value) = (hypothesis.parameters.first()?, *values.first()?);
    (hypothesis.parameters.len() == 1).then_some(match parameter.unit.as_str() {
        "Hz" => 1.0 / (std::f64::consts::TAU * value),
        _ => value,
    })
}

/// Parameters of the effects that a structure adds.
fn added(candidate: &Candidate) -> impl Iterator<Item = (&Hypothesis, &Parameter, &FreeParameter, f64)> {
    let structure = &candidate.structure;
    structure.free.iter().zip(&candidate.fit.values).filter_map(|(number, value)| {
        let Role::Added(h, p) = number.role else { return None };
        let hypothesis = structure.added.get(h)?;
        Some((hypothesis, hypothesis.parameters.get(p)?, number, *value))
    })
}

/// Whether a parameter is at an end of its range at which it still has an effect.
pub(crate) fn at_end(parameter: &Parameter, number: &FreeParameter, value: f64) -> bool {
    let at = number.at_bound(value);
    at.is_some() && at != parameter.neutral.and_then(|neutral| number.at_bound(neutral))
}
