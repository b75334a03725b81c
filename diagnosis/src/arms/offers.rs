//! What a search fits: a structure with a term more or less, the shape of the term, the tolerance of the bodies, the displacement of friction; and what of it is
//! possible at all.

use crate::arms::fit::{Fit, Structure, Weights};
use crate::arms::physics::{Physics, Term};
use crate::arms::regression::Data;

/// The least mass of a payload, as a share of the last body's own: a lighter one is as likely that body's mass, which is not known better.
pub const LEAST_PAYLOAD: f64 = 0.15;
/// The least displacement of presliding, in times what the sensor resolves.
pub const PRESLIDING: f64 = 8.0;
/// Rounds in which the friction's displacement is sought.
const SLIP_STEPS: usize = 12;

/// The torque of a term as a share of the rms torque of the joint where that is most.
pub(crate) fn torque_share(data: &Data, fit: &Fit, index: usize) -> f64 {
    let Some(term) = fit.structure.terms.get(index) else { return 0.0 };
    let columns = data.columns(term, &fit.structure.slip);
    let values = &fit.values[fit.places[index].clone()];
    let torque: Vec<f64> = (0..data.layout.rows).map(|row| columns.iter().zip(values).map(|(c, x)| c[row] * x).sum()).collect();
    let share = |j: usize| (data.mean_square(&torque, j, false) / data.scale(j, false).powi(2).max(f64::MIN_POSITIVE)).sqrt();
    (0..data.problem.joints.len()).map(share).fold(0.0, f64::max)
}

/// Whether what must not be negative is not, and a payload is one.
pub(crate) fn is_possible(data: &Data, fit: &Fit) -> bool {
    let last = data.problem.bodies.nominal.last().map_or(0.0, |p| p[0]);
    fit.structure.terms.iter().zip(&fit.places).all(|(term, place)| {
        let (value, error) = (fit.values[place.start], fit.errors[place.start]);
        let least = match (term.given, term.physics) {
            // What the file states may be nothing, what is added is something.
            (Some(_), _) => -3.0 * error,
            (None, Physics::Payload) => LEAST_PAYLOAD * last,
            (None, _) => 0.0,
        };
        // Presliding over less is a direction that turns at once, within the resolution of the sensor.
        let is_sharp = term.physics == Physics::Presliding
            && term.given.is_none()
            && term.at.joint().is_some_and(|j| term.shape.first().is_some_and(|d| *d < PRESLIDING * data.first_slip(j)));
        // A gear whose number is not that of its shape is no gear.
        let unit = match (term.physics, term.shape.first()) {
            (Physics::Compliance, Some(k)) => k * value,
            (Physics::Backlash, Some(gap)) => value / gap,
            _ => 1.0,
        };
        let is_added = term.given.is_none();
        // A joint whose friction is more than its load cannot be driven back, and moves by no load at all.
        let locks = is_added && term.physics == Physics::LoadFriction && value >= 1.0;
        // Viscous friction that drives in one direction.
        let drives = is_added && term.physics == Physics::AsymmetricDamper && {
            let level = fit.structure.terms.iter().zip(&fit.places).find(|(t, _)| t.physics == Physics::Damper && t.at == term.at);
            value.abs() > level.map_or(0.0, |(_, place)| fit.values[place.start]) + 2.0 * error
        };
        !is_sharp && !locks && !drives && (0.5..2.0).contains(&unit) && (!term.physics.facts().positive || value > least)
    })
}

/// How far the load at a joint spreads over the fitted logs, from a tenth of it to nine tenths, as a share of its median.
pub(crate) fn load_spread(data: &Data, joint: usize) -> f64 {
    let mut all: Vec<f64> = data.load[..data.fit_count].iter().flat_map(|load| load[joint].iter().map(|x| x.abs())).collect();
    all.sort_by(f64::total_cmp);
    let at = |share: f64| all.get((share * all.len().saturating_sub(1) as f64) as usize).copied().unwrap_or(0.0);
    (at(0.9) - at(0.1)) / at(0.5).max(f64::MIN_POSITIVE)
}

pub(crate) fn with(structure: &Structure, term: &Term) -> Structure {
    let mut out = structure.clone();
    out.terms.push(term.clone());
    out
}

pub(crate) fn without(structure: &Structure, index: usize) -> Structure {
    let mut out = structure.clone();
    out.terms.remove(index);
    out
}

pub(crate) fn without_term(data: &Data, fit: &Fit, index: usize, weights: &Weights) -> Option<Fit> {
    data.fit(&without(&fit.structure, index), weights)
}

/// Candidates by what they promise beside a structure, each effect and place once, with the best of its shapes.
pub(crate) fn ranked(data: &Data, pool: &[Term], structure: &Structure, weights: &Weights) -> Vec<(Term, f64)> {
    let Some((system, values)) = data.system(structure, weights) else { return Vec::new() };
    let mut out: Vec<(Term, f64)> = Vec::new();
    for term in pool.iter().filter(|t| !structure.terms.iter().any(|there| there.is_like(t))) {
        let promise = data.promise(&system, &values, &data.columns(term, &structure.slip)) - 2.0 * term.physics.facts().numbers as f64;
        match out.iter_mut().find(|(other, _)| {
            other.is_like(term)
                && (!matches!(term.physics, Physics::Payload | Physics::Compliance) || other.shape.len() == term.shape.len())
        }) {
            Some(there) if there.1 < promise => *there = (term.clone(), promise),
            Some(_) => {}
            None => out.push((term.clone(), promise)),
        }
    }
    out.sort_by(|a, b| b.1.total_cmp(&a.1));
    out
}

/// A fit whose last term has the shape that fits best, near the one that it has.
pub(crate) fn shaped(data: &Data, fit: Fit, index: usize, weights: &Weights) -> Fit {
    let mut best = fit;
    let Some(term) = best.structure.terms.get(index).cloned() else { return best };
    if matches!(term.physics, Physics::Offset | Physics::GravityDirection) {
        // What is of second order follows from the value itself.
        for _ in 0..3 {
            let mut structure = best.structure.clone();
            structure.terms[index].shape = best.values[best.places[index].clone()].to_vec();
            match data.fit(&structure, weights) {
                Some(other) => best = other,
                None => break,
            }
        }
        return best;
    }
    if term.shape.is_empty() || matches!(term.physics, Physics::CoupledFriction | Physics::Payload) {
        return best;
    }
    if matches!(term.physics, Physics::Compliance | Physics::Backlash) {
        // The shape that follows from the fitted value, while that is better.
        for _ in 0..4 {
            let mut structure = best.structure.clone();
            let value = best.values[best.places[index].start];
            if value <= 0.0 {
                break;
            }
            structure.terms[index].shape[0] = if term.physics == Physics::Compliance { 1.0 / value } else { value };
            match data.fit(&structure, weights).filter(|f| f.score < best.score) {
                Some(other) => best = other,
                None => break,
            }
        }
    }
    let mut step: f64 = if term.physics == Physics::Cogging { 1.01 } else { 1.4 };
    for _ in 0..6 {
        let mut moved = false;
        for factor in [step, 1.0 / step] {
            let mut structure = best.structure.clone();
            structure.terms[index].shape[0] *= factor;
            if let Some(other) = data.fit(&structure, weights).filter(|f| f.score < best.score && is_possible(data, f)) {
                best = other;
                moved = true;
                break;
            }
        }
        if !moved {
            step = step.sqrt();
        }
    }
    best
}

/// A fit in which friction turns over the displacement that fits best, joint by joint.
pub(crate) fn slipped(data: &Data, fit: Fit, weights: &Weights) -> Fit {
    let mut best = fit;
    for joint in 0..data.problem.joints.len() {
        let turns =
            |t: &Term| t.at.joint() == Some(joint) && matches!(t.physics, Physics::Coulomb | Physics::Stribeck | Physics::LoadFriction);
        if !best.structure.terms.iter().any(turns) {
            continue;
        }
        // The sensor's own step is the least that makes sense, a hundredth of the range is presliding and no longer a sharp turn.
        let first = data.first_slip(joint);
        for factor in [2.0, 0.5] {
            for _ in 0..SLIP_STEPS {
                let mut structure = best.structure.clone();
                structure.slip[joint] *= factor;
                if !(0.1 * first..=64.0 * first).contains(&structure.slip[joint]) {
                    break;
                }
                match data.fit(&structure, weights).filter(|f| f.score < best.score) {
                    Some(other) => best = other,
                    None => break,
                }
            }
        }
    }
    best
}

/// The fit with the tolerance of the inertial parameters that has the best score.
pub(crate) fn tolerated(data: &Data, fit: Fit, weights: &Weights) -> Fit {
    let others = (0..=data.most_tolerance).filter_map(|tolerance| data.fit(&Structure { tolerance, ..fit.structure.clone() }, weights));
    others.fold(fit.clone(), |best, other| if other.score < best.score - 1e-9 { other } else { best })
}
