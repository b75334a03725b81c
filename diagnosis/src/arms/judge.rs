//! The judge: the arm simulated in closed loop along logs.
//!
//! The model is fed the measured torque, and a loop adds what it takes to keep the measured motion. What the loop adds is what the model lacks, with
//! friction as exact as the stepper has it, sticking too.

use crate::arms::consistent::consistent;
use crate::arms::physics::Physics;
use crate::arms::regression::Data;
use crate::arms::search::Search;
use crate::arms::weighing::added;
use crate::arms::written::{Reading, model_of};
use backdrive_plant::model::{Hold, Input, InputKind, Model};
use backdrive_plant::robot::Arm;
use backdrive_plant::stepper::{Options, Plant, Segment};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Natural frequency of the loop, Hz, critically damped.
const LOOP_HZ: f64 = 4.0;
/// Time that the loop is given to settle, s.
const SETTLING: f64 = 0.5;
/// Share of its speed that the loop may take of a body within a sample: beyond 2 it would swing up.
const MOST_A_SAMPLE: f64 = 0.5;

/// Gains of the loop at each joint, N m/rad and N m s/rad. The loop is critically damped at 4 Hz at most with the joint's inertia while the others are
/// free. The pose is that of least inertia, because a loop that is stable there is stable everywhere. Loop gains are also limited by the rotor inertia
/// alone, because the link is decoupled inside the backlash. The models that are compared have the same loop, that of the one with most in it. `None`
/// where the model is no arm.
pub fn gains(data: &Data, model: &Model) -> Option<Vec<[f64; 2]>> {
    let arm = model.arm.as_ref()?;
    let period = data.rates.period();
    let w = loop_rate(period);
    let of = |(j, least): (usize, f64)| {
        let rotor = rotor_of(data, model, j).map_or(f64::INFINITY, |body| model.bodies[body].inertia);
        let own = least.min(MOST_A_SAMPLE * rotor / (2.0 * w * period));
        [own * w * w, 2.0 * own * w]
    };
    Some(least_inertia(arm, model).into_iter().enumerate().map(of).collect())
}

/// Natural frequency of the loop, rad/s.
fn loop_rate(period: f64) -> f64 {
    (TAU * LOOP_HZ).min(0.2 / period)
}

/// The body of the motor before a gear that gives way.
fn rotor_of(data: &Data, model: &Model, joint: usize) -> Option<usize> {
    let rotor = format!("{}.rotor", data.problem.joints[joint]);
    model.bodies.iter().position(|b| b.name == rotor)
}

/// Root mean square of the loop's torque at each joint over the held-out logs (or all, where none is held out), as a share of the rms of the measured
/// torque. The loop has these [`gains`], one of each joint; `None` where the model cannot be simulated.
pub fn judge(data: &Data, model: &Model, reading: &Reading, gains: &[[f64; 2]]) -> Option<Vec<f64>> {
    let joints = data.problem.joints.len();
    let held_out = data.fit_count..data.motions.len();
    let motions = if held_out.is_empty() { 0..data.fit_count } else { held_out };
    let mut driven = model.clone();
    driven.outputs.clear();
    driven.axes.clear();
    driven.inputs.clear();
    let arm = model.arm.as_ref().filter(|_| gains.len() == joints)?;
    for (j, body) in arm.bodies.iter().enumerate() {
        // Behind a rotor the motor acts on that.
        let on = rotor_of(data, &driven, j).unwrap_or(*body);
        driven.inputs.push(Input::ideal(&format!("loop_{j}"), InputKind::Force, on, Hold::Linear));
    }
    let period = data.rates.period();
    let (mut added, mut torque, mut count) = (vec![0.0; joints], vec![0.0; joints], 0usize);
    for m in motions {
        let motion = &data.motions[m];
        let mut loaded = None;
        if let Some((_, payload)) = &motion.payload {
            loaded = Some(Model { arm: Some(Box::new(arm.carrying(payload).ok()?)), ..driven.clone() });
        }
        let mut plant = Plant::new(loaded.as_ref().unwrap_or(&driven), period, &Options::default()).ok()?;
        let at = |j: usize, i: usize| motion.position[j][i] - arm.pose[j] - reading.offset[j];
        for (j, body) in arm.bodies.iter().enumerate() {
            plant.set_motion(*body, at(j, 0), motion.velocity[j][0]);
            let rotor = driven.inputs[j].on;
            plant.set_motion(rotor, at(j, 0), motion.velocity[j][0]);
        }
        let fed = |i: usize| {
            let mut read: Vec<f64> = (0..joints).map(|j| motion.torque[j][i]).collect();
            reading.undo(&mut read);
            read
        };
        for i in 0..motion.len().saturating_sub(1) {
            let (now, next) = (fed(i), fed(i + 1));
            let mut segments = Vec::with_capacity(joints);
            for j in 0..joints {
                // Where a gear gives way it is the motor's position that was logged.
                let body = if reading.of_motor[j] { driven.inputs[j].on } else { arm.bodies[j] };
                let more = gains[j][0] * (at(j, i) - plant.position(body)) + gains[j][1] * (motion.velocity[j][i] - plant.velocity(body));
                segments.push(Segment::line(now[j] + more, next[j] + more, period));
                if i as f64 * period > SETTLING {
                    added[j] += more * more;
                    torque[j] += if data.is_passive(j) { data.scale(j, false).powi(2) } else { now[j] * now[j] };
                }
            }
            count += 1;
            plant.step(&segments);
            if !plant.is_finite() {
                return None;
            }
        }
    }
    if count == 0 {
        return None;
    }
    Some(added.iter().zip(&torque).map(|(a, t)| (a / t.max(f64::MIN_POSITIVE)).sqrt()).collect())
}

/// Above which [`Judged::ratio`] a simulation speaks against a term.
pub const AGAINST: f64 = 1.05;

/// What the loop adds with and without a term that a search has added, as shares of the rms torque, by joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Without it, all other parameters refitted.
    pub without: Vec<f64>,
    /// With it.
    pub with: Vec<f64>,
}

impl Judged {
    /// How much the loop adds with the term, over all joints, in times of what it adds without it.
    pub fn ratio(&self) -> f64 {
        // Of each joint in the size of what is added there.
        let sum = |shares: &[f64]| shares.iter().zip(&self.without).map(|(s, w)| (s / w.max(1e-6)).powi(2)).sum::<f64>();
        (sum(&self.with) / sum(&self.without).max(f64::MIN_POSITIVE)).sqrt()
    }
}

/// Judges every term that a search has added by a simulation without it; `None` where the model file cannot say it, or a model cannot be simulated.
pub fn each(data: &Data, search: &Search, gains: &[[f64; 2]], with: Option<&Vec<f64>>) -> Vec<Option<Judged>> {
    let of = |index: usize| {
        let term = &search.best.structure.terms[index];
        let is_said = match term.physics {
            // The logged torque is late, not the arm.
            Physics::Delay => false,
            Physics::CoupledFriction => term.shape.first() == Some(&-1.0),
            // The inertia of the motor before a gear is not known, and the loop acts on that.
            Physics::Compliance | Physics::Backlash => term.at.joint().is_some_and(|j| data.problem.armature[j] > 0.0),
            _ => true,
        };
        let with = with.filter(|_| is_said)?.clone();
        let mut structure = search.best.structure.clone();
        structure.terms.remove(index);
        let less = consistent(data, &data.fit(&structure, &search.weights)?, &search.weights)?;
        let (model, _) = model_of(data, &less).ok()?;
        Some(Judged { without: judge(data, &model, &Reading::of(data, &less), gains)?, with })
    };
    added(&search.best.structure).into_iter().map(of).collect()
}

/// Of each joint the least inertia over the arm's poses that it moves against while all others are free.
fn least_inertia(arm: &Arm, model: &Model) -> Vec<f64> {
    let count = arm.tree.len();
    let mut work = arm.tree.workspace();
    let mut out = vec![f64::INFINITY; count];
    for pose in arm.poses() {
        let mut mass = DMatrix::zeros(count, count);
        arm.tree.mass_matrix(&pose, &mut work, &mut mass);
        for (j, body) in arm.bodies.iter().enumerate() {
            mass[(j, j)] += model.bodies.get(*body).map_or(0.0, |b| b.inertia);
        }
        let Some(inverse) = mass.try_inverse() else { continue };
        for (j, least) in out.iter_mut().enumerate() {
            *least = least.min(1.0 / inverse[(j, j)].max(1e-300));
        }
    }
    out
}
