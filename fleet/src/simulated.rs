//! A simulated fleet of seven-joint arms: logs along prescribed motions, with friction that differs by unit, recording and temperature.
//!
//! The torque is that of the links by inverse dynamics, with masses that differ from the model's, plus rotor inertia, friction and noise. So a log of 30 s
//! takes a hundredth of a second to make, and the truth of each parameter is known.

use crate::error::FleetError;
use backdrive_plant::model::Model;
use backdrive_plant::robot::Tree;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;
use std::path::Path;

/// Joints.
pub const JOINTS: usize = 7;
/// Samples per second.
pub const RATE: f64 = 100.0;
/// Length of a log, s.
pub const LENGTH: f64 = 30.0;
const DRY: [f64; JOINTS] = [2.0, 2.4, 1.8, 1.6, 0.7, 0.6, 0.4];
const VISCOUS: [f64; JOINTS] = [1.6, 1.8, 1.4, 1.2, 0.5, 0.5, 0.3];
const ROTOR: [f64; JOINTS] = [0.08, 0.08, 0.08, 0.08, 0.03, 0.03, 0.03];
const NOISE: [f64; JOINTS] = [0.15, 0.2, 0.12, 0.12, 0.05, 0.04, 0.03];

/// What a joint is like in one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Dry friction, N m.
    pub dry: f64,
    /// Viscous friction, N m s/rad.
    pub viscous: f64,
    /// Constant torque, N m.
    pub constant: f64,
    /// Rotor's inertia, kg m².
    pub rotor: f64,
    /// Recorded torque per true torque.
    pub gain: f64,
    /// Time by which the recorded torque is late, s.
    pub lag: f64,
    /// Noise of the torque, standard deviation, N m.
    pub noise: f64,
    /// Noise of the position, standard deviation, rad.
    pub position_noise: f64,
    /// Stribeck friction above the dry one at rest, N m.
    pub stribeck: f64,
}

/// The joints of a new unit: 10 % from unit to unit.
pub fn unit(random: &mut ChaCha8Rng) -> [Truth; JOINTS] {
    std::array::from_fn(|j| Truth {
        dry: DRY[j] * (1.0 + 0.1 * normal(random)).max(0.5),
        viscous: VISCOUS[j] * (1.0 + 0.1 * normal(random)).max(0.5),
        constant: 0.1 * DRY[j] * normal(random),
        rotor: ROTOR[j],
        gain: 1.0 + 0.01 * normal(random),
        lag: 0.0,
        noise: NOISE[j],
        position_noise: 2e-5,
        stribeck: 0.0,
    })
}

/// A standard normal number (Box & Muller).
pub fn normal(random: &mut impl Rng) -> f64 {
    let (a, b): (f64, f64) = (random.random_range(f64::MIN_POSITIVE..1.0), random.random_range(0.0..1.0));
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// A random generator for a place in an exam.
pub fn random(seed: u64, unit: usize, recording: usize) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add((unit as u64) << 20).wrapping_add(recording as u64))
}

/// The arm.
pub struct Arm {
    /// The links with true masses: 2 % heavier or lighter than the model's.
    tree: Tree,
    /// Names of the joints.
    pub names: Vec<String>,
}

impl Arm {
    /// Of a model file with a robot of seven joints.
    ///
    /// # Errors
    /// The model cannot be read, or has no robot of seven joints.
    pub fn open(model: &Path) -> Result<Arm, FleetError> {
        let wrong = || FleetError::input(format!("{}: has no robot of {JOINTS} joints", model.display()));
        let arm = Model::load(model).map_err(FleetError::input)?.arm.ok_or_else(wrong)?;
        let mut robot = arm.robot.clone();
        for (index, link) in robot.links.iter_mut().enumerate() {
            if let Some(inertia) = &mut link.inertia {
                let factor = if index % 2 == 0 { 1.02 } else { 0.98 };
                inertia.mass *= factor;
                inertia.about_centre *= factor;
            }
        }
        let mut tree = Tree::new(&robot).map_err(FleetError::input)?;
        (0..tree.len()).for_each(|i| tree.set_armature(i, 0.0));
        if tree.len() != JOINTS {
            return Err(wrong());
        }
        let names = tree.coordinates().iter().map(|c| c.name.clone()).collect();
        Ok(Arm { tree, names })
    }

    /// A log as CSV: a motion drawn by `random`, at `rate` samples per second.
    pub fn log(&self, truth: &[Truth; JOINTS], rate: f64, random: &mut ChaCha8Rng) -> String {
        let waves: Vec<Vec<(f64, f64, f64)>> = (0..JOINTS)
            .map(|_| {
                (0..4)
                    .map(|k| (0.25 / (1.0 + f64::from(k)), random.random_range(0.06..0.5), random.random_range(0.0..std::f64::consts::TAU)))
                    .collect()
            })
            .collect();
        let count = (LENGTH * rate) as usize;
        let references = self.tree.references();
        let mut work = self.tree.workspace();
        let (mut q, mut v, mut a, mut f) = ([0.0; JOINTS], [0.0; JOINTS], [0.0; JOINTS], [0.0; JOINTS]);
        let mut out = String::from("t");
        for what in ["position", "torque"] {
            self.names.iter().for_each(|name| {
                let _ = write!(out, ",{name}.{what}");
            });
        }
        out.push('\n');
        for i in 0..count {
            let t = i as f64 / rate;
            let at = |t: f64, j: usize| {
                waves[j].iter().fold((references[j], 0.0, 0.0), |(q, v, a), (amplitude, hz, phase)| {
                    let w = std::f64::consts::TAU * hz;
                    let (s, c) = (w * t + phase).sin_cos();
                    (q + amplitude * s, v + amplitude * w * c, a - amplitude * w * w * s)
                })
            };
            let _ = write!(out, "{t:.4}");
            for j in 0..JOINTS {
                let position = at(t, j).0 + truth[j].position_noise * normal(random);
                let _ = write!(out, ",{:.6}", (position / 2e-6).round() * 2e-6);
            }
            // The torque of a little earlier, where it was recorded late; the same lag for all joints.
            for j in 0..JOINTS {
                (q[j], v[j], a[j]) = at(t - truth[0].lag, j);
            }
            self.tree.inverse_dynamics(&q, &v, &a, &mut work, &mut f);
            for j in 0..JOINTS {
                let own = &truth[j];
                let level = own.dry + own.stribeck * (-(v[j] / 0.05).powi(2)).exp();
                let torque = f[j] + own.rotor * a[j] + level * (v[j] / 0.003).tanh() + own.viscous * v[j] + own.constant;
                let _ = write!(out, ",{:.4}", own.gain * torque + own.noise * normal(random));
            }
            out.push('\n');
        }
        out
    }
}
