//! What a report draws: torque and its predictions on a log, friction against velocity, and the motion to record next.

use crate::arms::excitation::{Excitation, RATE};
use crate::arms::fit::Fit;
use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::Data;
use crate::arms::search::Search;
use backdrive_plant::robot::JointKind;

/// Points of a law's line.
const LINE: usize = 400;

/// Of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnJoint {
    /// Its name.
    pub name: String,
    /// Units of its position, velocity and torque.
    pub units: [&'static str; 3],
    /// Times, s from the log's first sample.
    pub time: Vec<f64>,
    /// Measured torque through the filter of the regression.
    pub measured: Vec<f64>,
    /// What the refitted nominal model leaves of it.
    pub left_refit: Vec<f64>,
    /// What the diagnosed model leaves of it.
    pub left_diagnosed: Vec<f64>,
    /// Friction against velocity.
    pub friction: Friction,
}

/// Friction of a joint against its velocity, over all logs, of rows in which it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// Velocities.
    pub velocity: Vec<f64>,
    /// The torque that remains by the diagnosed model without the joint's terms of friction.
    pub torque: Vec<f64>,
    /// The line of the terms of friction: velocities.
    pub line_velocity: Vec<f64>,
    /// The same: torques, friction that grows with the load at the mean load.
    pub line: Vec<f64>,
    /// Whether some of it grows with the load.
    pub by_load: bool,
}

/// All joints, and what to record next.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// The log, and whether it was held out.
    pub log: (String, bool),
    /// Each joint.
    pub joints: Vec<DrawnJoint>,
    /// Times of the motion to record next, s.
    pub next_time: Vec<f64>,
    /// Positions of each joint in it.
    pub next_position: Vec<Vec<f64>>,
}

/// From fits; `moving`: rows that count while joints move, `whole`: all of them.
pub fn drawn(moving: &Data, whole: &Data, search: &Search, next: &Excitation) -> Drawn {
    let held = whole.fit_count < whole.motions.len();
    // The first held-out log, else the first one.
    let log = if held { whole.fit_count } else { 0 };
    let [refit, diagnosed] = [&search.refit, &search.best].map(|f| whole.residual_of(f));
    let joints = whole
        .problem
        .tree
        .coordinates()
        .iter()
        .enumerate()
        .map(|(j, coordinate)| {
            let rows = whole.layout.of(log, j);
            DrawnJoint {
                name: coordinate.name.clone(),
                units: match coordinate.kind {
                    JointKind::Prismatic => ["m", "m/s", "N"],
                    _ => ["rad", "rad/s", "N m"],
                },
                time: (0..rows.len()).map(|row| whole.rates.time_of(row)).collect(),
                measured: whole.torque[rows.clone()].to_vec(),
                left_refit: refit[rows.clone()].to_vec(),
                left_diagnosed: diagnosed[rows].to_vec(),
                friction: friction(moving, &search.best, j),
            }
        })
        .collect();
    let log = (whole.motions.get(log).map_or(String::new(), |m| m.name.clone()), held);
    let next_position = next.motion(whole.problem, RATE).position;
    let next_time = (0..next_position.first().map_or(0, Vec::len)).map(|i| i as f64 / RATE).collect();
    Drawn { log, joints, next_time, next_position }
}

/// Whether a term is friction of its joint.
fn is_friction(term: &Term, joint: usize) -> bool {
    let law = matches!(
        term.physics,
        Physics::Damper
            | Physics::Coulomb
            | Physics::Stribeck
            | Physics::LoadFriction
            | Physics::Presliding
            | Physics::AsymmetricDamper
            | Physics::QuadraticDrag
            | Physics::Bias
    );
    law && term.at == At::Joint(joint)
}

fn friction(data: &Data, fit: &Fit, joint: usize) -> Friction {
    let terms: Vec<(&Term, f64)> = fit
        .structure
        .terms
        .iter()
        .zip(&fit.places)
        .filter(|(t, _)| is_friction(t, joint))
        .filter_map(|(t, p)| Some((t, *fit.values.get(p.start)?)))
        .collect();
    let slip = &fit.structure.slip;
    let columns: Vec<_> = terms.iter().filter_map(|(t, x)| Some((data.columns(t, slip).first()?.clone(), *x))).collect();
    let (mut velocity, mut torque) = (Vec::new(), Vec::new());
    for (m, motion) in data.motions.iter().enumerate() {
        let speeds = data.rates.rows(&motion.velocity[joint]);
        let moves = data.rates.rows(&motion.moves[joint]);
        for ((row, v), moves) in data.layout.of(m, joint).zip(speeds).zip(moves) {
            if moves > 0.98 {
                velocity.push(v);
                torque.push(fit.residual[row] + columns.iter().map(|(c, x)| c[row] * x).sum::<f64>());
            }
        }
    }
    let fastest = velocity.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let load = mean_load(data, slip, joint);
    let at = |v: f64| -> f64 { terms.iter().map(|(t, x)| x * law(t, v, load)).sum() };
    let line_velocity: Vec<f64> = (0..=LINE).map(|i| fastest * (2.0 * i as f64 / LINE as f64 - 1.0)).collect();
    let line = line_velocity.iter().map(|v| at(*v)).collect();
    let by_load = terms.iter().any(|(t, _)| t.physics == Physics::LoadFriction);
    Friction { velocity, torque, line_velocity, line, by_load }
}

/// Mean size of what a joint passes on while it moves, N m or N.
fn mean_load(data: &Data, slip: &[f64], joint: usize) -> f64 {
    let size = |physics| {
        let columns = data.columns(&Term::new(physics, At::Joint(joint), Vec::new()), slip);
        columns.first().map_or(0.0, |c| c.iter().map(|x| x.abs()).sum::<f64>())
    };
    size(Physics::LoadFriction) / size(Physics::Coulomb).max(f64::MIN_POSITIVE)
}

/// Torque per number of a term at a steady velocity.
fn law(term: &Term, v: f64, load: f64) -> f64 {
    let sign = if v == 0.0 { 0.0 } else { v.signum() };
    let shape = term.shape.first().copied().unwrap_or(1.0);
    match term.physics {
        Physics::Damper => v,
        Physics::Coulomb | Physics::Presliding => sign,
        Physics::Stribeck => sign * (-(v / shape).powi(2)).exp(),
        Physics::LoadFriction => sign * load,
        Physics::AsymmetricDamper => v.abs(),
        Physics::QuadraticDrag => v * v.abs(),
        Physics::Bias => 1.0,
        _ => 0.0,
    }
}
