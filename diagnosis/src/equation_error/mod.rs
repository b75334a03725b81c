//! Laws looked at on forces along a measured motion.
//!
//! Where the motion of a body and the force on it are both known, the force of a law along that motion is known without a simulation of the rest. So every
//! law, and every pair, is compared with the force in a band in which the motion is resolved. It is judged by its prediction of held-out stretches.

mod band;
pub(crate) mod explore;
pub(crate) mod gram;
mod inverse;
mod on_forces;
pub(crate) mod room;
mod search;

pub(crate) use band::corners_of;
use band::{corners, is_known};
pub(crate) use inverse::{inverse, with_model};
pub use on_forces::OnForces;
pub(crate) use search::search_on_forces;

use crate::belief::on_forces::{Figures, figures};
use crate::recordings::problem::Problem;

/// What was examined on forces, for those who calibrate its confidence: the effect of each law that is claimed, with its figures for the law and for its
/// kind.
pub fn figures_of(problem: &Problem) -> Vec<(String, [Figures; 2])> {
    let rooms: Vec<room::Room> = match is_known(problem) {
        true => corners(problem).into_iter().filter_map(|corner| room::Room::of(problem, corner, &[])).collect(),
        false => Vec::new(),
    };
    let Some(explored) = explore::explore(&rooms, crate::options::EFFECTS, 0) else { return Vec::new() };
    let one = |law: &usize| (rooms[0].named(*law).physics.name.to_string(), figures(&rooms, &explored, *law));
    explored.best().laws.iter().map(one).collect()
}
