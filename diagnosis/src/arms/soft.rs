//! What a joint passes on through a gear that gives way: a spring between motor and link, or play.
//!
//! The position sensor sits on the motor, as in most drives, and the link lags behind it by δ. With M the inertia that the link has about its joint, and
//! `load` the torque that it would take on a rigid gear, the torque that passes through the gear is
//!
//! ```text
//! f(δ, dδ/dt) = load - M d²δ/dt²
//! ```
//!
//! (the elastic joint of M. Spong, ASME J. Dyn. Sys. 109 (1987) 310-319, with the motor's motion given), with the other joints as they were measured. f is k δ with a little damping, or 0 within the gap and that of a stiff stop beyond. What this changes in the torque of every joint
//! is then read from the inverse dynamics of the arm in its altered motion.

use crate::arms::motion::{Motion, ORDER};
use crate::arms::rigid::{Signals, difference};
use backdrive_plant::robot::Tree;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use std::f64::consts::TAU;

/// Damping of a soft gear, as a share of the critical one; below its resonance little depends on it.
pub(crate) const DAMPING: f64 = 0.1;
/// Resonance of the link at the stops of the play, Hz, and its damping: stops are stiff, and hardly bounce.
const STOP_HZ: f64 = 50.0;
/// See [`STOP_HZ`].
const STOP_DAMPING: f64 = 0.5;
/// Up to which share of the link's resonance its lag is followed: nearer to it everything depends on an unknown damping.
const BELOW: f64 = 0.6;
/// Rounds in which the torque that passes through the gear follows the link; each leaves less than a half of what the one before left.
const ROUNDS: usize = 4;
/// Steps in a period of the resonance.
const STEPS: f64 = 40.0;

/// How a gear gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gear {
    /// A spring of this stiffness, N m/rad or N/m, on which the link is followed below its resonance, as what passes through it, over k.
    Spring(f64),
    /// The same, on which the link swings with little damping.
    Swinging(f64),
    /// Play of this width in all, rad or m.
    Play(f64),
}

/// How far a link lags behind its motor, rad or m, and at which rate. `load`: torque on a rigid gear, `inertia`: of the link about the joint.
pub fn lag(load: &[f64], inertia: &[f64], period: f64, gear: Gear) -> [Vec<f64>; 2] {
    let (mut lag, mut rate) = (Vec::with_capacity(load.len()), Vec::with_capacity(load.len()));
    let mean = (inertia.iter().sum::<f64>() / inertia.len().max(1) as f64).max(f64::MIN_POSITIVE);
    let (stiffness, damping, gap) = match gear {
        Gear::Spring(k) | Gear::Swinging(k) => (k, 2.0 * DAMPING * (k * mean).sqrt(), 0.0),
        Gear::Play(gap) => {
            let w = TAU * STOP_HZ;
            (mean * w * w, 2.0 * STOP_DAMPING * mean * w, gap)
        }
    };
    let least = inertia.iter().copied().fold(f64::INFINITY, f64::min).max(1e-3 * mean);
    let fastest = (stiffness / least).sqrt() / TAU;
    let steps = ((period * fastest * STEPS).ceil() as usize).clamp(1, 1000);
    let h = period / steps as f64;
    let first = load.first().copied().unwrap_or(0.0);
    let mut x = first / stiffness + 0.5 * gap * first.signum();
    let mut v = 0.0;
    for i in 0..load.len() {
        lag.push(x);
        rate.push(v);
        let (now, next) = (load[i], load.get(i + 1).copied().unwrap_or(load[i]));
        let mass = inertia.get(i).copied().unwrap_or(mean).max(least);
        for s in 0..steps {
            let torque = now + (next - now) * (s as f64 + 0.5) / steps as f64;
            let beyond = x - x.max(-0.5 * gap).min(0.5 * gap);
            let touches = gap <= 0.0 || beyond != 0.0;
            let mut passed = stiffness * beyond + if touches { damping * v } else { 0.0 };
            // A stop pushes, and does not pull.
            if gap > 0.0 && passed * beyond < 0.0 {
                passed = 0.0;
            }
            v += h * (torque - passed) / mass;
            x += h * v;
        }
    }
    [lag, rate]
}

/// What a gear that gives way at a joint changes in the torque of every joint along a motion, N m or N. `load` and `inertia` as in [`lag`].
pub fn change(tree: &Tree, motion: &Motion, joint: usize, load: &Signals, inertia: &[f64], period: f64, gear: Gear) -> Signals {
    let mut altered = motion.clone();
    let mut alter = |x: &[f64], v: &[f64]| {
        let less = |signal: &[f64], by: &[f64]| signal.iter().zip(by).map(|(s, b)| s - b).collect();
        altered.position[joint] = less(&motion.position[joint], x);
        altered.velocity[joint] = less(&motion.velocity[joint], v);
        altered.acceleration[joint] = less(&motion.acceleration[joint], &derivative(v, period));
        crate::arms::rigid::torques(tree, &altered, &[])
    };
    let changed = match gear {
        Gear::Play(_) | Gear::Swinging(_) => {
            let [x, v] = lag(&load[joint], inertia, period, gear);
            alter(&x, &v)
        }
        Gear::Spring(stiffness) => {
            let mean = (inertia.iter().sum::<f64>() / inertia.len().max(1) as f64).max(f64::MIN_POSITIVE);
            let resonance = (stiffness / mean).sqrt() / TAU;
            let slow = LowPass::butterworth(ORDER, (BELOW * resonance).min(0.4 / period), 1.0 / period);
            let mut torque = load.clone();
            for _ in 0..ROUNDS {
                let x: Vec<f64> = slow.both_ways(&torque[joint]).iter().map(|t| t / stiffness).collect();
                torque = alter(&x, &derivative(&x, period));
            }
            torque
        }
    };
    difference(&changed, load, 1.0)
}

/// Inertia of each joint about itself along a motion, the others held, kg m² or kg.
pub fn inertia(tree: &Tree, motion: &Motion) -> Signals {
    let count = tree.len();
    let mut work = tree.workspace();
    let mut matrix = nalgebra::DMatrix::zeros(count, count);
    let mut out = vec![Vec::with_capacity(motion.len()); count];
    let mut q = vec![0.0; count];
    for i in 0..motion.len() {
        q.iter_mut().zip(&motion.position).for_each(|(q, p)| *q = p[i]);
        tree.mass_matrix(&q, &mut work, &mut matrix);
        out.iter_mut().enumerate().for_each(|(j, s)| s.push(matrix[(j, j)]));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_follows_its_load_and_play_crosses_its_gap() {
        // Half a hertz on a resonance of 20 Hz: the lag is the static one, larger by (f/f0)².
        let (period, inertia) = (1e-3, vec![0.2; 4000]);
        let load: Vec<f64> = (0..4000).map(|i| (TAU * 0.5 * f64::from(i) * period).cos()).collect();
        let k = 0.2 * (TAU * 20.0f64).powi(2);
        let [x, _] = lag(&load, &inertia, period, Gear::Spring(k));
        let worst = x.iter().zip(&load).skip(2000).map(|(x, l)| (k * x - l).abs()).fold(0.0, f64::max);
        assert!(worst < 0.01, "{worst}");
        // A load that grows as r t from the middle of its sign: x = r t³/(6 M) until the gap is crossed.
        let rising: Vec<f64> = (0..4000).map(|i| f64::from(i - 1000) * period).collect();
        let gap = 0.02;
        let [x, _] = lag(&rising, &inertia, period, Gear::Play(gap));
        let crossing = 1000 + x[1000..].iter().position(|x| *x > 0.5 * gap).expect("crosses");
        let expected = (6.0 * 0.2 * gap).cbrt();
        let took = (crossing - 1000) as f64 * period;
        assert!((took - expected).abs() < 0.03 * expected, "{took} {expected}");
    }
}
