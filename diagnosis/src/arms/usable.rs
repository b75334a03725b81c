//! Which samples of the logged torque may be used, and at which joints: clipped torque is left out, and a joint's torque without its sign is not used.

use crate::arms::log::Log;
use crate::arms::motion::{Motion, Rates};
use crate::arms::rigid::Signals;
use crate::audit::limits_reached;
use backdrive_signal::statistics::rms;

/// Share of samples at which the links need torque of the other sign, from which on a torque of one sign is taken to be rectified.
const OTHER_SIGN: f64 = 0.05;
/// The least of a torque of one sign, as a share of its largest value, at which it touches 0 as a rectified one does.
const TOUCHES: f64 = 0.02;
/// Share of the time that a joint has to move in either direction.
const EITHER_WAY: f64 = 0.05;

/// A torque that stands at a limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Clipped {
    /// Index of the log, those for fitting first.
    pub log: usize,
    /// The joint.
    pub joint: usize,
    /// The limit, N m or N.
    pub level: f64,
    /// Share of the log's samples that stand there.
    pub share: f64,
}

/// Where the torque of the logs stands at a limit: one that a log shows is looked for in all, for a motor has the same limit in each.
pub fn clipped(logs: &[&Log], joints: usize) -> Vec<Clipped> {
    let mut out = Vec::new();
    for joint in 0..joints {
        let all = || logs.iter().flat_map(|log| log.torque[joint].iter().copied());
        let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let near = 1e-4 * (high - low);
        let mut levels: Vec<f64> = Vec::new();
        for (level, _) in logs.iter().flat_map(|log| limits_reached(&log.torque[joint])) {
            // What other logs exceed is no limit.
            let is_end = (level - low).abs() <= near || (level - high).abs() <= near;
            if is_end && !levels.iter().any(|l| (l - level).abs() <= near) {
                levels.push(level);
            }
        }
        for level in levels {
            for (log, found) in logs.iter().enumerate() {
                let count = found.torque[joint].iter().filter(|x| (**x - level).abs() <= near).count();
                if count > 1 {
                    out.push(Clipped { log, joint, level, share: count as f64 / found.torque[joint].len() as f64 });
                }
            }
        }
    }
    out
}

/// Sets to 0 what does not count of a motion, with what the filter smears.
pub fn leave_out(motion: &mut Motion, log: &Log, clipped: &[&Clipped], rates: &Rates) {
    let (Some(first), smeared) = (log.t.first(), rates.smeared()) else { return };
    for limit in clipped {
        let torque = &log.torque[limit.joint];
        let near = 1e-4 * torque.iter().fold(limit.level.abs(), |m, x| m.max((x - limit.level).abs()));
        let counts = &mut motion.counts[limit.joint];
        for (t, _) in log.t.iter().zip(torque).filter(|(_, x)| (**x - limit.level).abs() <= near) {
            let at = (t - first) / rates.period();
            let from = (at.floor() as usize).saturating_sub(smeared).min(counts.len());
            let to = (at.ceil() as usize + smeared + 1).min(counts.len());
            counts[from..to].fill(0.0);
        }
    }
}

/// By joint: whether its torque was logged without its sign. It never has one of the two signs while the joint moves both ways, and it comes to 0 and goes no
/// further. It reaches 0 exactly, or nearly where the links need torque of both signs. `load`: torque of the links along each motion.
pub fn unsigned(logs: &[&Log], motions: &[Motion], load: &[Signals], joints: usize) -> Vec<bool> {
    let of_joint = |joint: usize| {
        let torque = || logs.iter().flat_map(|log| log.torque[joint].iter().copied());
        let (low, high) = torque().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let sign = if low >= 0.0 && high > 0.0 {
            1.0
        } else if high <= 0.0 && low < 0.0 {
            -1.0
        } else {
            return false;
        };
        let share = |of: &dyn Fn(&Motion) -> (usize, usize)| {
            let (some, all) = motions.iter().map(of).fold((0, 0), |(a, b), (x, y)| (a + x, b + y));
            some as f64 / all.max(1) as f64
        };
        let usual = rms(motions.iter().flat_map(|m| m.velocity[joint].iter().copied()));
        let moves = |way: f64| share(&|m: &Motion| (m.velocity[joint].iter().filter(|v| way * **v > 0.1 * usual).count(), m.len()));
        if usual == 0.0 || moves(1.0) < EITHER_WAY || moves(-1.0) < EITHER_WAY {
            return false;
        }
        let size = rms(load.iter().flat_map(|l| l[joint].iter().copied()));
        let other: usize = load.iter().map(|l| l[joint].iter().filter(|x| sign * **x < -0.1 * size).count()).sum();
        let all: usize = load.iter().map(|l| l[joint].len()).sum();
        let (least, most) = (low.abs().min(high.abs()), low.abs().max(high.abs()));
        // A motor that works against a large constant torque has one sign as well, but does not touch 0.
        least == 0.0 || (least <= TOUCHES * most && other as f64 > OTHER_SIGN * all.max(1) as f64)
    };
    (0..joints).map(of_joint).collect()
}
