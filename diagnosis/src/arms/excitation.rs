//! Motions of all joints within their limits that show the inertial parameters well.
//!
//! A Fourier series for each joint, drawn at random, and ranked by the condition of the regressor of the base parameters. See Swevers, Ganseman, Tükel,
//! De Schutter & Van Brussel, Optimal robot excitation and identification, T-RO 13(5), 1997.

use crate::arms::base::{Base, base};
use crate::arms::error::ArmError;
use crate::arms::inertial::COUNT;
use crate::arms::motion::Motion;
use crate::arms::problem::Problem;
use crate::arms::rigid::{regressor, torques};
use nalgebra::DMatrix;
use std::fmt::Write as _;

/// Harmonics of the series.
const HARMONICS: usize = 5;
/// Lengths of a period, s: quick ones show inertia, slow ones friction at low speed.
const PERIODS: [f64; 3] = [12.0, 8.0, 24.0];
/// Series that are drawn.
const DRAWN: usize = 60;
/// Samples of a period at which they are evaluated first.
const LOOKED_AT: usize = 60;
/// Rate of the file, Hz.
pub const RATE: f64 = 100.0;
/// Share of the joint's range that is used, and where the file has no limits, rad or m to either side.
const USED: f64 = 0.8;
/// Share of the largest singular value below which a combination of parameters does not show at all.
const UNSEEN: f64 = 1e-9;
/// See [`USED`].
const REACH: f64 = 1.5;

/// Coefficients of a joint: cosine and sine of each harmonic.
type Series = Vec<[f64; 2]>;

/// A motion that was drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Of each joint.
    series: Vec<Series>,
    /// Condition number of the regressor, each column in the size of its body.
    pub condition: f64,
    /// Length of a period, s.
    pub seconds: f64,
}

/// Draws motions that the joints can follow, those that show the inertial parameters best first. `most`: the largest torque of each joint, N m or N; a
/// motion that takes more is left out, unless all do.
///
/// # Errors
/// Where the robot cannot be computed, or has no joints.
pub fn draw(problem: &Problem, most: &[f64]) -> Result<Vec<Excitation>, ArmError> {
    let bases = base(problem)?;
    let mut random = 1u64;
    let mut draw = || {
        // xorshift64*: the same series on every machine.
        random ^= random >> 12;
        random ^= random << 25;
        random ^= random >> 27;
        (random.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let mut out: Vec<(bool, Excitation)> = Vec::new();
    for number in 0..DRAWN {
        let mut joint = || (1..=HARMONICS).map(|h| [draw() / (h as f64).sqrt(), draw() / (h as f64).sqrt()]).collect();
        let series: Vec<Series> = problem.joints.iter().map(|_| joint()).collect();
        let seconds = PERIODS[number % PERIODS.len()];
        let motion = motion(problem, &series, seconds, LOOKED_AT);
        let torque = torques(&problem.tree, &motion, &[]);
        let too_much = torque.iter().zip(most).any(|(signal, most)| signal.iter().any(|x| x.abs() > *most));
        let condition = condition(problem, &bases, &motion)?;
        out.push((too_much, Excitation { series, condition, seconds }));
    }
    out.sort_by(|a, b| (a.0, a.1.condition).partial_cmp(&(b.0, b.1.condition)).unwrap_or(std::cmp::Ordering::Equal));
    let possible = out.iter().filter(|(too_much, _)| !too_much).count();
    out.truncate(if possible > 0 { possible } else { 1 });
    match out.is_empty() {
        true => Err(ArmError::Robot("the robot has no joints".to_string())),
        false => Ok(out.into_iter().map(|(_, e)| e).collect()),
    }
}

impl Excitation {
    /// The motion at a rate, Hz: one period.
    pub fn motion(&self, problem: &Problem, rate: f64) -> Motion {
        motion(problem, &self.series, self.seconds, (self.seconds * rate).round() as usize)
    }

    /// Times and positions of all joints with a motor, as CSV, at [`RATE`].
    pub fn csv(&self, problem: &Problem) -> String {
        let motion = self.motion(problem, RATE);
        let driven: Vec<usize> = (0..problem.joints.len()).filter(|j| !problem.is_passive(*j)).collect();
        let names: Vec<String> = driven.iter().map(|j| format!("{}.position", problem.joints[*j])).collect();
        let mut csv = format!("t,{}\n", names.join(","));
        for i in 0..motion.len() {
            let row: Vec<String> = driven.iter().map(|j| format!("{:.6}", motion.position[*j][i])).collect();
            // Writing to a String cannot fail.
            let _ = writeln!(csv, "{:.3},{}", i as f64 / RATE, row.join(","));
        }
        csv
    }
}

/// The motion of a series, scaled into the joints' ranges.
fn motion(problem: &Problem, series: &[Series], seconds: f64, count: usize) -> Motion {
    let mut out = Motion {
        name: String::new(),
        position: Vec::new(),
        velocity: Vec::new(),
        acceleration: Vec::new(),
        torque: Vec::new(),
        recorded_velocity: Vec::new(),
        moves: Vec::new(),
        counts: Vec::new(),
        payload: None,
    };
    for (j, coefficients) in series.iter().enumerate() {
        if problem.is_passive(j) {
            // It cannot be moved along a prescribed path. Where the others throw it is not known beforehand, so its own equation does not count here.
            let hangs = at_rest(problem, j);
            out.position.push(vec![hangs; count]);
            out.velocity.push(vec![0.0; count]);
            out.acceleration.push(vec![0.0; count]);
            continue;
        }
        let limits = problem.tree.coordinates().get(j).and_then(|c| problem.robot.joints.get(c.joint)).map(|joint| joint.limits);
        let [low, high] = limits.and_then(|l| l.range).unwrap_or([-REACH, REACH]);
        let (low, high) = (low.max(-2.0 * REACH), high.min(2.0 * REACH));
        let (mut q, mut v, mut a) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        for i in 0..count {
            let t = i as f64 * seconds / count as f64;
            for (h, [c, s]) in coefficients.iter().enumerate() {
                let w = std::f64::consts::TAU * (h + 1) as f64 / seconds;
                let (sin, cos) = (w * t).sin_cos();
                q[i] += c * cos + s * sin;
                v[i] += w * (s * cos - c * sin);
                a[i] -= w * w * (c * cos + s * sin);
            }
        }
        let (least, most) = q.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), x| (l.min(*x), m.max(*x)));
        let fastest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let by_speed = limits.and_then(|l| l.velocity).map_or(f64::INFINITY, |l| 0.8 * l / fastest.max(1e-9));
        let scale = (USED * (high - low) / (most - least).max(1e-9)).min(by_speed);
        let shift = 0.5 * (high + low) - 0.5 * scale * (most + least);
        q.iter_mut().for_each(|x| *x = scale * *x + shift);
        v.iter_mut().chain(a.iter_mut()).for_each(|x| *x *= scale);
        out.position.push(q);
        out.velocity.push(v);
        out.acceleration.push(a);
    }
    out
}

/// Where a joint without a motor is while it is not moved: the middle of its logged positions, rad or m.
fn at_rest(problem: &Problem, joint: usize) -> f64 {
    let logs = || problem.fit.iter().chain(&problem.held_out).flat_map(|log| log.position[joint].iter());
    let count = logs().count().max(1) as f64;
    logs().sum::<f64>() / count
}

fn condition(problem: &Problem, bases: &[Base], motion: &Motion) -> Result<f64, ArmError> {
    let columns = regressor(&problem.robot, &problem.bodies, motion, &[])?;
    let rows = motion.len() * problem.joints.len();
    let flat: Vec<Vec<f64>> = bases
        .iter()
        .map(|b| {
            let scale = problem.bodies.scale[b.of / COUNT][b.of % COUNT];
            columns[b.of].iter().flatten().map(|x| x * scale).collect()
        })
        .collect();
    let matrix = DMatrix::from_fn(rows, flat.len(), |i, j| flat[j][i]);
    let values = matrix.singular_values();
    let most = values.max();
    // What no motor can show is the same for every motion.
    let least = match problem.passive().is_empty() {
        true => values.min(),
        false => values.iter().copied().filter(|x| *x > UNSEEN * most).fold(most, f64::min),
    };
    Ok(most / least.max(f64::MIN_POSITIVE))
}
