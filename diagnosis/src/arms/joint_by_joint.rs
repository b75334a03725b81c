//! What each joint's own torque shows, put where it predicts that torque better than what all joints together gave.

use crate::arms::error::ArmError;
use crate::arms::fit::{Fit, Structure, Weights};
use crate::arms::local::{Bands, JointFound, Local, laws_of_joints};
use crate::arms::offers::{shaped, slipped, tolerated, torque_share, without};
use crate::arms::physics::{At, Term};
use crate::arms::regression::Data;
use crate::arms::weighing::{LEAST_SHARE, LEAST_TORQUE, by_block_of, first_weights, is_local, rare};
use crate::belief::predictive::gain;
use crate::output_error::work::Limit;

/// Replaces the laws that were found at a joint by those that its own torque shows, if they predict that torque better.
///
/// Not on arms with a joint without a motor: bodies are then all that is known of it, and a law in another joint's torque would bend them.
pub(crate) fn joint_by_joint(
    data: &Data,
    pool: &[Term],
    most: usize,
    best: &mut Fit,
    weights: &Weights,
    limit: Limit,
) -> Result<Vec<JointFound>, ArmError> {
    let joints = 0..data.problem.joints.len();
    if joints.clone().any(|j| data.is_passive(j)) {
        return Ok(Vec::new());
    }
    let of_all = best.structure.terms.iter().filter(|t| !is_local(data, t)).cloned().collect();
    let structure = Structure { terms: of_all, ..best.structure.clone() };
    let mut bands = Bands::of(data);
    let nominal = data.nominal_structure();
    bands.see(&data.seen, |band| first_weights(band, &nominal))?;
    let looked = |tolerance: usize| {
        let base = Structure { tolerance: tolerance.min(data.most_tolerance), ..structure.clone() };
        laws_of_joints(data, &bands, &base, pool, limit)
    };
    // No law shall stand for what is wrong in a body: one that only bodies near the file's show has to be known from all joints too.
    let (mut found, free) = (looked(structure.tolerance + 1), looked(data.most_tolerance));
    for (joint, free) in found.iter_mut().zip(&free) {
        let is_in = |terms: &[Term], law: &Local| law.terms.iter().all(|t| terms.iter().any(|own| own.is_like(t)));
        let with_free: Vec<Term> = free.chosen.iter().flat_map(|law| law.terms.clone()).collect();
        joint.chosen.retain(|law| is_in(&best.structure.terms, law) || is_in(&with_free, law));
    }
    for joint in joints {
        let now: Vec<&Term> = best.structure.terms.iter().filter(|t| t.at == At::Joint(joint) && is_local(data, t)).collect();
        let wanted: Vec<&Term> = found[joint].chosen.iter().flat_map(|law| &law.terms).collect();
        if now.len() == wanted.len() && wanted.iter().all(|t| now.iter().any(|own| own.is_like(t))) {
            continue;
        }
        match exchanged_at(data, best, joint, &found[joint], weights).filter(|other| rare(&other.structure) <= most) {
            Some(other) => *best = other,
            None => found[joint] = JointFound::default(),
        }
    }
    *best = slipped(data, best.clone(), weights);
    Ok(found)
}

/// The structure with these laws at a joint instead of its own; `None` where its torque is then not predicted better, or, by fewer numbers, as well.
pub(crate) fn exchanged_at(data: &Data, best: &Fit, joint: usize, found: &JointFound, weights: &Weights) -> Option<Fit> {
    let is_own = |t: &Term| t.at == At::Joint(joint) && is_local(data, t);
    let mut structure = best.structure.clone();
    structure.terms.retain(|t| !is_own(t));
    for term in found.chosen.iter().flat_map(|law| &law.terms) {
        // A shape that was refined already stays.
        let there = best.structure.terms.iter().find(|t| t.given.is_none() && t.is_like(term) && t.shape.len() == term.shape.len());
        if !structure.terms.iter().any(|t| t.is_like(term)) {
            structure.terms.push(there.unwrap_or(term).clone());
        }
    }
    let mut other = tolerated(data, data.fit(&structure, weights)?, weights);
    for index in 0..other.structure.terms.len() {
        if is_own(&other.structure.terms[index]) {
            other = shaped(data, other, index, weights);
        }
    }
    // What is less than a hundredth of a joint's torque is in no measurement by itself.
    let is_little = |fit: &Fit, index: usize| is_own(&fit.structure.terms[index]) && torque_share(data, fit, index) < LEAST_TORQUE;
    while let Some(index) = (0..other.structure.terms.len()).find(|index| is_little(&other, *index)) {
        other = data.fit(&without(&other.structure, index), weights)?;
    }
    let of = |fit: &Fit| by_block_of(data, &fit.unseen, weights, false, &[joint]);
    let is_worse = gain(&of(&other), &of(best)).is_some_and(|g| g.is_sure());
    let is_simpler = other.structure.terms.len() < best.structure.terms.len();
    // A law of fast motion shows in few blocks: what counts is the torque that is left. Held-out logs need not show it, but not the opposite either.
    let ratio = |held_out: bool| {
        let left = |fit: &Fit| data.mean_square(if held_out { &fit.residual } else { &fit.unseen }, joint, held_out);
        left(&other) / left(best).max(f64::MIN_POSITIVE)
    };
    let is_better = ratio(false) < 1.0 - LEAST_SHARE && ratio(true) < 1.0 + LEAST_SHARE;
    (!is_worse && (is_simpler || is_better)).then_some(other)
}
