//! Where a fit of one law starts from the values of another that stood in the same place.

use super::types::{Family, Hypothesis, Parameter};

/// Values with which one hypothesis nearly reproduces another one of fewer parameters at the same place, where both are the same law at different
/// resolution. Example: friction that builds up over a distance is that of many contacts, described by one state. `None` for any other pair.
pub(crate) fn refined(coarse: &Hypothesis, values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    if !coarse.place.same(&finer.place) || !coarse.replaces.iter().all(|name| finer.replaces.contains(name)) {
        return None;
    }
    (finer.physics.facts.refine)(coarse, values, finer)
}

/// Where a fit of `other` starts as an alternative to a law that was fitted. For friction that holds and slides, the start has the forces of the fitted
/// law, all scaled alike. For other laws, the law's own starts.
pub(crate) fn starts_beside(law: &Hypothesis, values: &[f64], other: &Hypothesis) -> Vec<Vec<f64>> {
    let is_force = |p: &Parameter| matches!(p.unit.as_str(), "N" | "N m");
    let forces = |h: &Hypothesis, values: &[f64]| {
        let all: Vec<f64> = h.parameters.iter().zip(values).filter(|(p, _)| is_force(p)).map(|(_, v)| *v).collect();
        // The values of a list, such as sliders side by side, act together, other laws at one time at one of their levels.
        let share = if h.parameters.iter().any(|p| p.index.is_some()) { 1.0 } else { 1.0 / all.len().max(1) as f64 };
        share * all.iter().sum::<f64>()
    };
    let level = forces(law, values);
    if law.physics.family != Family::Friction || other.physics.family != Family::Friction || level.is_nan() || level <= 0.0 {
        return other.starts.clone();
    }
    let scaled = |start: &Vec<f64>| {
        let own = forces(other, start);
        let scale = if own > 0.0 { level / own } else { 1.0 };
        let value = |(p, v): (&Parameter, &f64)| (if is_force(p) { scale * v } else { *v }).clamp(p.range.0, p.range.1);
        other.parameters.iter().zip(start).map(value).collect()
    };
    let mut starts: Vec<Vec<f64>> = other.starts.iter().map(scaled).collect();
    starts.dedup();
    starts
}

/// A start with the values that another law at the same place has for what both have: keys of the same name, levels of friction.
pub(crate) fn inherited(hypothesis: &Hypothesis, start: &[f64], from: &Hypothesis, values: &[f64]) -> Vec<f64> {
    let known = || from.parameters.iter().zip(values);
    let value = |key: &str| {
        let same = known().find(|(p, _)| p.key == key);
        let is_level = hypothesis.physics.facts.from_level.contains(&key);
        let level = || known().find(|(p, _)| is_level && from.physics.facts.from_level.contains(&p.key.as_str()));
        same.or_else(level).map(|(_, value)| *value)
    };
    let one = |(p, s): (&Parameter, &f64)| match value(&p.key).filter(|_| p.index.is_none()) {
        Some(value) => value.clamp(p.range.0, p.range.1),
        None => *s,
    };
    hypothesis.parameters.iter().zip(start).map(one).collect()
}
