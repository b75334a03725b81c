//! How sure a finding is, and what could be in its place.

use crate::arms::fit::Fit;
use crate::arms::local::Local;
use crate::arms::physics::{At, Term};
use crate::arms::place::place;
use crate::arms::regression::Data;
use crate::arms::search::{Rival, Search};
use crate::belief::on_forces::Belief;
use crate::verdict::{Alternative, Estimate, Parameter};
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::BTreeMap;

/// How sure mass can be at the most where only what is known of bodies speaks for it.
pub(crate) const MASSES_SURE: f64 = 0.95;
/// Score above that of the best structure up to which a rival counts as alike.
pub(crate) const ALIKE: f64 = 6.0;
/// How sure a finding can be at the most that held-out torque or a simulation speaks against.
pub(crate) const DOUBTED: f64 = 0.45;
/// At the joints of a term what of the torque of held-out logs has to be left at most, as a share of its rms, for anything to be believed there.
pub(crate) const EXPLAINS: f64 = 0.9;

/// What could replace a law of a joint's own torque: laws that are not predicted surely worse share what the law leaves.
pub(crate) fn beside(data: &Data, local: &Local) -> Vec<Alternative> {
    let left = 1.0 - local.belief.law;
    let weights: Vec<f64> = local.rivals.iter().map(|(.., behind)| (-behind.max(0.0)).exp()).collect();
    let total = weights.iter().sum::<f64>().max(1.0);
    let one = |((name, term, _), weight): (&(&str, Term, f64), &f64)| Alternative {
        physics: name.to_string(),
        place: place(data, term),
        confidence: left * weight / total,
    };
    local.rivals.iter().zip(&weights).map(one).collect()
}

/// How sure a term is that several joints show, by the evidence of all, and what could be in its place.
pub(crate) fn by_evidence(data: &Data, search: &Search, order: usize, index: usize) -> (Belief, Vec<Alternative>) {
    let term = &search.best.structure.terms[index];
    let rivals: Vec<&Rival> = search.rivals.get(order).map_or(Vec::new(), |r| r.iter().filter(|r| r.above < ALIKE).collect());
    let weights: Vec<f64> = rivals.iter().map(|r| (-0.5 * r.above.max(0.0)).exp()).collect();
    let total = 1.0 + weights.iter().sum::<f64>();
    let alternative = |(r, w): (&&Rival, &f64)| Alternative {
        physics: r.term.physics.facts().name.to_string(),
        place: place(data, &r.term),
        confidence: w / total,
    };
    let mut alternatives: Vec<Alternative> = rivals.iter().zip(&weights).map(alternative).collect();
    let mut sure = search.gains.get(order).copied().flatten().map_or(0.5, |g| Normal::standard().cdf(g.in_errors()));
    if let Some(above) = search.freed.get(order).copied().flatten() {
        // Held-out segments may not decide here: released bodies predict the same.
        let by_bodies = 1.0 / (1.0 + (-0.5 * above).exp());
        if by_bodies > sure {
            sure = by_bodies.min(MASSES_SURE);
            let physics = "inertial_parameters".to_string();
            alternatives.push(Alternative { physics, place: place(data, term), confidence: (1.0 - sure) / total });
        }
    }
    if search.like_bodies.get(order).is_some_and(|is| *is) {
        sure = sure.min(DOUBTED);
        let physics = "inertial_parameters".to_string();
        alternatives.push(Alternative { physics, place: place(data, term), confidence: (1.0 - sure) / total });
    }
    let family = term.physics.facts().family;
    let kin: f64 = rivals.iter().zip(&weights).filter(|(r, _)| r.term.physics.facts().family == family).map(|(_, w)| w / total).sum();
    let law = sure / total;
    (Belief { law, kind: (law + sure * kin).min(1.0) }, alternatives)
}

/// Whether the torque of held-out logs that is left where a term acts falls with what was found, to below what leaving the joint alone would leave; true where no
/// log is held out.
pub(crate) fn falls(data: &Data, search: &Search, term: &Term) -> bool {
    if data.fit_count == data.motions.len() {
        return true;
    }
    let at: Vec<usize> = match term.at {
        At::Joint(j) => vec![j],
        // What the second joint does shows at the first.
        At::Pair(j, _) => vec![j],
        At::Base => (0..data.problem.joints.len()).collect(),
    };
    at.iter().any(|j| {
        let left = |fit: &Fit| data.mean_square(&fit.residual, *j, true).sqrt();
        let (before, after) = (left(&search.refit), left(&search.best));
        after < before && (data.is_passive(*j) || after < EXPLAINS * data.scale(*j, true))
    })
}

/// Whether the interval of a size holds 0.
pub(crate) fn may_be_nothing(numbers: &BTreeMap<String, Parameter>) -> bool {
    const SIZES: [&str; 9] = ["force", "coulomb", "stiffness", "inertia", "coefficient", "damping", "gap", "amplitude", "delay"];
    let holds_zero = |one: &Estimate| matches!(one.ci95, [Some(low), Some(high)] if low <= 0.0 && high >= 0.0);
    // One of several sizes that is nothing leaves the others.
    let sizes: Vec<&Estimate> = numbers
        .iter()
        .filter(|(key, _)| SIZES.contains(&key.as_str()))
        .filter_map(|(_, number)| if let Parameter::One(one) = number { Some(one) } else { None })
        .filter(|one| one.value != 0.0)
        .collect();
    !sizes.is_empty() && sizes.iter().all(|one| holds_zero(one))
}
