//! Joints that a search has coupled: which pairs, and whether they are too many to be belts.

use crate::arms::fit::Structure;
use crate::arms::physics::{At, Term};
use crate::arms::problem::Problem;
use crate::arms::weighing::added;

/// Pairs of joints of which one's motor carries torque of the other, by an effect that a search has added.
fn coupled_pairs(structure: &Structure) -> Vec<(usize, usize)> {
    let pair = |index: usize| match structure.terms[index].at {
        At::Pair(j, k) => Some((j.min(k), j.max(k))),
        At::Joint(_) | At::Base => None,
    };
    let mut pairs: Vec<(usize, usize)> = added(structure).into_iter().filter_map(pair).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

/// Whether a term couples two joints while others are coupled too. A belt or differential couples two joints. Where the torques of several pairs follow each
/// other, one cause that acts on all of them is likelier: a base that moves, or bodies of another shape.
pub(crate) fn is_coupled_by_many(structure: &Structure, term: &Term) -> bool {
    matches!(term.at, At::Pair(..)) && coupled_pairs(structure).len() > 1
}

/// What a user should know of an arm on which more than one pair of joints is coupled.
pub(crate) fn coupled_by_many(problem: &Problem, structure: &Structure) -> Option<String> {
    let coupled = coupled_pairs(structure);
    let name = |joint: usize| problem.joints.get(joint).map_or("", String::as_str);
    let names: Vec<String> = coupled.iter().map(|(j, k)| format!("{} and {}", name(*j), name(*k))).collect();
    (coupled.len() > 1).then(|| {
        format!(
            "the torques of {} pairs of joints follow each other ({}). One cause for all is likelier than as many belts: a base that moves, bodies of another \
             shape, or wrong torque constants. No coupling is asserted. Fix the base and log again, or check the inertial parameters of the robot file",
            coupled.len(),
            names.join(", ")
        )
    })
}
