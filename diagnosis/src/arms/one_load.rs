//! Joints at which the logs do not distinguish friction that grows with the load from friction of one level.

use crate::arms::fit::{Fit, Structure, Weights};
use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::Data;

/// Separation that is enough, standard deviations: the claim that a search makes takes about as much.
pub(crate) const ENOUGH: f64 = 4.0;

/// The other friction at a joint that has one of the two.
pub(crate) struct Exchanged {
    /// Which term of the structure it replaces.
    pub index: usize,
    /// The structure with it.
    pub rival: Structure,
}

/// The exchange at a joint, where the logs do not decide it; `None` where the joint has neither law or both.
pub(crate) fn exchanged(data: &Data, best: &Fit, weights: &Weights, joint: usize) -> Option<Exchanged> {
    let at = |physics| best.structure.terms.iter().position(|t| t.physics == physics && t.at == At::Joint(joint));
    let (index, other) = match (at(Physics::Coulomb), at(Physics::LoadFriction)) {
        (Some(index), None) => (index, Physics::LoadFriction),
        (None, Some(index)) => (index, Physics::Coulomb),
        _ => return None,
    };
    let mut rival = best.structure.clone();
    rival.terms[index] = Term::new(other, At::Joint(joint), Vec::new());
    let terms = vec![(best.structure.terms[index].clone(), best.values[best.places[index].clone()].to_vec())];
    let separation = data.gram(&rival, &terms, weights, 1.0)?.left().sqrt();
    (separation < ENOUGH).then_some(Exchanged { index, rival })
}

/// The joints at which the logs do not decide it.
pub(crate) fn under_one_load(data: &Data, best: &Fit, weights: &Weights) -> Vec<usize> {
    (0..data.problem.joints.len()).filter(|joint| exchanged(data, best, weights, *joint).is_some()).collect()
}
