//! Laws of each joint's own torque: those that predict left-out stretches, joint by joint and in several bands, and how sure each is.

use crate::arms::error::ArmError;
use crate::arms::fit::{Structure, Weights};
use crate::arms::inertial::Parameters;
use crate::arms::joint_laws::JointRoom;
use crate::arms::motion::{HIGHEST, on_grid};
use crate::arms::physics::Term;
use crate::arms::regression::Data;
use crate::belief::on_forces::{Belief, belief, nearest};
use crate::equation_error::corners_of;
use crate::equation_error::explore::{Explored, Looked, Same, better, explore};
use crate::output_error::work::Limit;
use crate::tuning::tuning;

/// Laws at a joint at once, at most.
const MOST: usize = 4;
/// Bands in which laws are compared, at least.
const LEAST_BANDS: usize = 2;
/// Stretches of fitted logs for each of them, at least: fewer do not separate one law from several.
const STRETCHES: usize = 6;

/// A law that a joint's torque holds.
#[derive(Debug, Clone)]
pub struct Local {
    /// Its terms, the one that names it last.
    pub terms: Vec<Term>,
    /// How sure it, and its kind, is.
    pub belief: Belief,
    /// What could be in its place, by name and place, with the standard errors by which left-out stretches are predicted worse.
    pub rivals: Vec<(&'static str, Term, f64)>,
}

/// The laws of a joint's torque.
#[derive(Debug, Clone, Default)]
pub struct JointFound {
    /// What was chosen.
    pub chosen: Vec<Local>,
}

/// The logs in several bands.
pub(crate) struct Bands<'a> {
    all: Vec<(Data<'a>, Option<Weights>)>,
    /// By joint: corners of the bands in which its motion is resolved, Hz.
    of_joint: Vec<Vec<f64>>,
}

impl<'a> Bands<'a> {
    /// Of the logs of a regression: for each joint the bands in which its motion is resolved, and the regression's own where there is none.
    pub fn of(data: &Data<'a>) -> Bands<'a> {
        let (logs, period) = (&data.problem.fit, 1.0 / data.rates.grid);
        let corners = |joint: usize| {
            let even: Vec<Vec<f64>> = logs.iter().map(|log| on_grid(&log.t, &log.position[joint], data.rates.grid)).collect();
            let motions: Vec<(&[f64], f64)> = even.iter().map(|q| (q.as_slice(), period)).collect();
            let mut corners = corners_of(&motions, HIGHEST);
            if corners.is_empty() {
                corners.push(data.rates.corner);
            }
            corners
        };
        let of_joint: Vec<Vec<f64>> = (0..data.problem.joints.len()).map(corners).collect();
        let mut distinct: Vec<f64> = of_joint.concat();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup();
        let band = |corner: f64| {
            let mut band = Data::new(data.problem, Some(corner), false).ok()?;
            band.most_tolerance = data.most_tolerance;
            Some((band, None))
        };
        Bands { all: distinct.into_iter().filter_map(band).collect(), of_joint }
    }

    /// Computes what columns are made of with these inertial parameters, and how much rows count.
    ///
    /// # Errors
    /// Where the robot cannot be computed with them.
    pub fn see(&mut self, parameters: &[Parameters], weights: impl Fn(&Data) -> Option<Weights>) -> Result<(), ArmError> {
        for (band, own) in &mut self.all {
            band.see(parameters)?;
            *own = weights(band);
        }
        Ok(())
    }

    /// Those of a joint, the highest first.
    fn of_joint(&self, joint: usize) -> Vec<(&Data<'a>, &Weights)> {
        let corners = self.of_joint.get(joint);
        let is_own = |band: &Data| corners.is_some_and(|own| own.contains(&band.rates.corner));
        self.all.iter().rev().filter(|(band, _)| is_own(band)).filter_map(|(band, weights)| Some((band, weights.as_ref()?))).collect()
    }
}

/// The laws of every joint that has a motor and a torque with its sign, beside what all of them have.
pub(crate) fn laws_of_joints(data: &Data, bands: &Bands, base: &Structure, pool: &[Term], limit: Limit) -> Vec<JointFound> {
    let is_known = |joint: &usize| !data.is_passive(*joint) && !data.unsigned[*joint] && !limit.is_over();
    let rooms_of = |joint: usize| -> Vec<JointRoom> {
        let bands = bands.of_joint(joint);
        bands.iter().filter(|_| is_known(&joint)).map(|(data, weights)| JointRoom::of(data, base, pool, joint, weights)).collect()
    };
    let mut rooms: Vec<Vec<JointRoom>> = (0..data.problem.joints.len()).map(rooms_of).collect();
    let all = rooms.iter().filter_map(|rooms| Some(rooms.first()?.laws.len())).sum();
    rooms.iter_mut().map(|rooms| laws_of_joint(rooms, all).unwrap_or_default()).collect()
}

fn laws_of_joint(rooms: &mut Vec<JointRoom>, all: usize) -> Option<JointFound> {
    let laws = |room: &JointRoom| room.laws.iter().map(|l| l.named().map(|t| (t.physics, t.at))).collect::<Vec<_>>();
    let first = laws(rooms.first()?);
    rooms.retain(|room| laws(room) == first);
    // An answer that hangs on the corner is not sure, and here there is no other corner to see it by.
    if rooms.len() < LEAST_BANDS {
        return None;
    }
    let explored = explore(rooms, MOST.min(rooms.first()?.stretches / STRETCHES), all)?;
    let room = rooms.first()?;
    let chosen = explored.best().laws.iter().enumerate().filter_map(|(place, law)| {
        // The shape is that of the first band, in which the arm is fitted.
        let (_, variant) = explored.best().chosen.first()?.get(place)?;
        let terms = room.laws[*law].variants.get(*variant)?.clone();
        Some(Local { terms, belief: belief(rooms, &explored, *law), rivals: rivals(rooms, &explored, *law) })
    });
    Some(JointFound { chosen: chosen.collect() })
}

/// What could replace a law of the chosen structure: the nearest structure without it, and without its kind.
fn rivals(rooms: &[JointRoom], explored: &Explored, law: usize) -> Vec<(&'static str, Term, f64)> {
    let best = explored.best();
    let other = |rival: &Looked| rival.laws.iter().find(|l| !best.laws.contains(l)).copied();
    let mut out: Vec<(&'static str, Term, f64)> = Vec::new();
    for same in [Same::Law, Same::Kind] {
        let Some(rival) = nearest(rooms, explored, law, same) else { continue };
        let Some(law) = other(rival).and_then(|l| rooms.first()?.laws.get(l)) else { continue };
        let (Some(term), name, behind) = (law.named(), law.name(), better(rival, best).in_errors()) else { continue };
        if behind < tuning().claim.sure && !out.iter().any(|(there, ..)| *there == name) {
            out.push((name, term.clone(), behind));
        }
    }
    out
}
