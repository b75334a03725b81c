//! What structures are compared by: weights of rows, residuals by block, and which terms are common, rare, or of one joint's own torque.

use crate::arms::fit::{Fit, Structure, TOLERANCES, Weights};
use crate::arms::joint_laws::acts_at;
use crate::arms::offers::load_spread;
use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::Data;
use crate::belief::predictive::{Gain, gain};

/// The least share of the mean squared residual of held-out segments, at the joint where it shows most, that an effect has to explain.
pub const LEAST_SHARE: f64 = 0.03;
/// The least share of the rms torque of a joint, that where it shows most, that an effect has to be.
pub const LEAST_TORQUE: f64 = 0.01;
/// Effects that every joint has more or less of: they take no other's place.
pub(crate) const COMMON: [Physics; 4] = [Physics::Coulomb, Physics::Damper, Physics::Bias, Physics::Inertia];
/// The load at a joint has to spread by this share of its median for friction that grows with it to be tried.
pub(crate) const LOAD_CHANGES: f64 = 0.5;

/// Whether a term is a law of one joint's own torque, at a joint whose torque is known.
pub(crate) fn is_local(data: &Data, term: &Term) -> bool {
    term.given.is_none() && term.at.joint().is_some_and(|j| acts_at(term, j) && !data.is_passive(j))
}

/// Whether the logs can say anything of a term: nothing of a joint whose torque has no sign, nor of a motor or a gear that is not there. (Without a motor the
/// load at a joint is its friction: friction in proportion to the load would be in proportion to itself.)
pub(crate) fn may_be(data: &Data, term: &Term) -> bool {
    let of_a_motor = matches!(
        term.physics,
        Physics::Gain | Physics::Coupling | Physics::Delay | Physics::Compliance | Physics::Backlash | Physics::LoadFriction
    );
    // What grows with a load that does not change is what does not grow with it.
    let no_load = |j: usize| term.physics == Physics::LoadFriction && load_spread(data, j) < LOAD_CHANGES;
    let may = |j: usize| !(data.unsigned[j] || of_a_motor && data.is_passive(j) || no_load(j));
    match term.at {
        At::Joint(j) => may(j),
        At::Pair(j, k) => may(j) && may(k),
        At::Base => !data.unsigned.contains(&true),
    }
}

/// Terms that a search has added, by index.
pub fn added(structure: &Structure) -> Vec<usize> {
    (0..structure.terms.len()).filter(|i| structure.terms[*i].given.is_none()).collect()
}

/// Terms that a search has added and that not every joint has.
pub fn rare(structure: &Structure) -> usize {
    added(structure).into_iter().filter(|index| !COMMON.contains(&structure.terms[*index].physics)).count()
}

/// Residuals of a structure that has plain friction and armature at every joint and free inertial parameters: what scatters beside them.
pub(crate) fn first_weights(data: &Data, nominal: &Structure) -> Option<Weights> {
    let mut rich = Structure { tolerance: TOLERANCES.len() - 1, ..nominal.clone() };
    for joint in 0..data.problem.joints.len() {
        for physics in [Physics::Damper, Physics::Coulomb, Physics::LoadFriction, Physics::Spring] {
            let term = Term::new(physics, At::Joint(joint), Vec::new());
            if may_be(data, &term) && !rich.terms.iter().any(|t| t.is_like(&term)) {
                rich.terms.push(term);
            }
        }
    }
    let start = Weights {
        sd: (0..data.problem.joints.len()).map(|j| (0.1 * data.scale(j, false)).max(1e-9) * data.doubt(j)).collect(),
        time: vec![1.0; data.problem.joints.len()],
    };
    let mut weights = start;
    for _ in 0..3 {
        weights = data.weights(&data.fit(&rich, &weights)?.residual);
    }
    Some(weights)
}

/// Mean squared held-out residuals by block, weighted over the joints, in lists of neighbours.
pub fn by_block(data: &Data, residual: &[f64], weights: &Weights, held_out: bool) -> Vec<Vec<f64>> {
    let joints: Vec<usize> = (0..data.problem.joints.len()).collect();
    by_block_of(data, residual, weights, held_out, &joints)
}

/// The same of some joints.
pub(crate) fn by_block_of(data: &Data, residual: &[f64], weights: &Weights, held_out: bool, joints: &[usize]) -> Vec<Vec<f64>> {
    let motions = if held_out { data.fit_count..data.motions.len() } else { 0..data.fit_count };
    let of_block = |block: &crate::arms::layout::Block| -> f64 {
        joints
            .iter()
            .map(|&j| {
                let first = data.layout.of(block.motion, j).start;
                let rows = &residual[first + block.rows.start..first + block.rows.end];
                rows.iter().map(|x| x * x).sum::<f64>() / rows.len().max(1) as f64 / weights.sd[j].powi(2)
            })
            .sum()
    };
    motions.map(|m| data.blocks.iter().filter(|b| b.motion == m).map(of_block).collect()).collect()
}

/// How much better one fit predicts stretches that it has not seen than another.
pub fn compare(data: &Data, base: &Fit, better: &Fit, weights: &Weights) -> Option<Gain> {
    gain(&by_block(data, &base.unseen, weights, false), &by_block(data, &better.unseen, weights, false))
}

/// The largest share of the mean squared held-out residual of a joint that one fit removes from another.
pub fn largest_share(data: &Data, base: &Fit, better: &Fit) -> f64 {
    (0..data.problem.joints.len())
        .map(|j| 1.0 - data.mean_square(&better.unseen, j, false) / data.mean_square(&base.unseen, j, false).max(f64::MIN_POSITIVE))
        .fold(f64::NEG_INFINITY, f64::max)
}
