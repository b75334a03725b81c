//! Faults that logs of an arm show before any effect is fitted: units, signs, swapped columns and joints, rates that are none, joints that do not
//! move.

use crate::arms::log::Log;
use crate::arms::physics::range;
use crate::arms::problem::Problem;
use crate::arms::regression::Data;
use crate::arms::rigid::torques;
use crate::audit::Weight;
use crate::verdict::Remark;
use backdrive_signal::statistics::rms;

/// A range of a joint that turns that no arm has, rad: degrees read as radians.
const TURNS: f64 = 12.0;
/// Share of its usual speed by which a rate from the drive may differ from the derivative of the position.
const RATE_DIFFERS: f64 = 0.3;
/// Range of a joint that rests, rad or m.
const RESTS: f64 = 1e-3;
/// Correlation of torques from which on an order of columns counts as explained.
const EXPLAINED: f64 = 0.8;

fn remark(what: &str, place: String, message: String, weight: Weight) -> Remark {
    Remark { what: what.to_string(), place, message, weight }
}

/// All remarks, those that matter most first.
pub fn audit(problem: &Problem, data: &Data) -> Vec<Remark> {
    let mut out = Vec::new();
    for log in problem.fit.iter().chain(&problem.held_out) {
        clock(log, &mut out);
    }
    for (j, joint) in problem.joints.iter().enumerate() {
        of_joint(problem, data, j, joint, &mut out);
    }
    torques_fit(problem, data, &mut out);
    for limit in &data.clipped {
        let log = data.motions.get(limit.log).map_or("", |motion| motion.name.as_str());
        let message = format!(
            "stands at its limit of {:.4} in {:.1} % of the samples: it is clipped; these samples are ignored",
            limit.level,
            100.0 * limit.share
        );
        out.push(remark("saturated", format!("{log}, {}.torque", problem.joints[limit.joint]), message, Weight::Caution));
    }
    for (joint, _) in problem.joints.iter().zip(&data.unsigned).filter(|(_, unsigned)| **unsigned) {
        let message = "never changes its sign while the joint moves both ways: it was logged without its sign (rectified). Nothing is claimed at this joint; \
                       log the signed torque or current"
            .to_string();
        out.push(remark("sign", format!("{joint}.torque"), message, Weight::Caution));
    }
    for unused in &data.unused {
        let message = format!("({}) is not used: {}; its force is treated as part of the unexplained torque", unused.kind, unused.why);
        out.push(remark("element", unused.place(&problem.model_file), message, Weight::Caution));
    }
    out.sort_by_key(|r| std::cmp::Reverse(r.weight));
    out
}

fn clock(log: &Log, out: &mut Vec<Remark>) {
    let steps: Vec<f64> = log.t.windows(2).map(|w| w[1] - w[0]).collect();
    let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    let scatter = rms(steps.iter().map(|s| s - mean)) / mean.max(1e-12);
    if scatter > 0.02 {
        let message =
            format!("the clock is irregular: steps of {:.2} ms vary by {:.0} %; the logged times are used", 1e3 * mean, 100.0 * scatter);
        out.push(remark("clock", log.name.clone(), message, Weight::Note));
    }
}

fn of_joint(problem: &Problem, data: &Data, j: usize, joint: &str, out: &mut Vec<Remark>) {
    let logs = || problem.fit.iter().chain(&problem.held_out);
    let wide = range(problem.fit.iter().flat_map(|l| l.position[j].iter().copied()));
    let turns = problem.tree.coordinates()[j].kind == backdrive_plant::robot::JointKind::Revolute;
    if wide < RESTS {
        let message = "never moves in the logs for fitting: its friction and inertia cannot be identified; move it".to_string();
        out.push(remark("constant", format!("{joint}.position"), message, Weight::Unusable));
    } else if turns && wide > TURNS {
        let message = format!(
            "has a range of {wide:.0} rad, which is {:.1} turns: it looks like degrees; set unit = \"deg\" in [joints.{joint}]",
            wide / std::f64::consts::TAU
        );
        out.push(remark("unit", format!("{joint}.position"), message, Weight::Caution));
    }
    let torque = range(logs().flat_map(|l| l.torque[j].iter().copied()));
    if data.is_passive(j) {
        // It has no motor, and the set states this.
    } else if rms(logs().flat_map(|l| l.torque[j].iter().copied())) == 0.0 {
        let message = format!(
            "is 0 in all samples: the column is empty or the wrong one. If this joint has no motor, set torque = 0 in [joints.{joint}] of \
                set.toml"
        );
        out.push(remark("constant", format!("{joint}.torque"), message, Weight::Unusable));
    } else if torque == 0.0 {
        let message = "is constant: no motor has a constant torque while its arm moves; name the column of its torque".to_string();
        out.push(remark("constant", format!("{joint}.torque"), message, Weight::Unusable));
    }
    // The rate from the drive beside the derivative.
    let (mut off, mut size, mut product, mut own) = (0.0, 0.0, 0.0, 0.0);
    for motion in &data.motions {
        let Some(recorded) = &motion.recorded_velocity[j] else { continue };
        for (a, b) in recorded.iter().zip(&motion.velocity[j]) {
            off += (a - b) * (a - b);
            size += b * b;
            product += a * b;
            own += a * a;
        }
    }
    if size > 0.0 && own > 0.0 && wide >= RESTS {
        let (share, factor, alike) = ((off / size).sqrt(), product / size, product / (size * own).sqrt());
        if share > RATE_DIFFERS {
            let message = if alike < -0.9 {
                "has the opposite sign of the derivative of the position: one of the two columns has the wrong sign".to_string()
            } else if alike > 0.97 {
                format!("is {factor:.3} times the derivative of the position: it has another unit")
            } else {
                format!(
                    "is not the derivative of the position (it differs by {:.0} %): another joint's column, or filtered heavily; it is not used",
                    100.0 * share
                )
            };
            out.push(remark("unit", format!("{joint}.velocity"), message, Weight::Caution));
        }
    }
}

/// Measured torque beside what the nominal links take: signs, and joints whose columns are swapped.
fn torques_fit(problem: &Problem, data: &Data, out: &mut Vec<Remark>) {
    let joints = problem.joints.len();
    let mut correlation = vec![vec![0.0; joints]; joints];
    let (mut own, mut other) = (vec![0.0; joints], vec![0.0; joints]);
    for motion in &data.motions[..data.fit_count] {
        let nominal = torques(&problem.tree, motion, &[]);
        for j in 0..joints {
            own[j] += motion.torque[j].iter().map(|x| x * x).sum::<f64>();
            other[j] += nominal[j].iter().map(|x| x * x).sum::<f64>();
            for k in 0..joints {
                correlation[j][k] += motion.torque[j].iter().zip(&nominal[k]).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
    for j in 0..joints {
        for k in 0..joints {
            correlation[j][k] /= (own[j] * other[k]).sqrt().max(f64::MIN_POSITIVE);
        }
    }
    for j in 0..joints {
        if correlation[j][j] < -EXPLAINED {
            let message = "has the opposite sign of the torque that the links need: set scale = -1 for it or for the position".to_string();
            out.push(remark("sign", format!("{}.torque", problem.joints[j]), message, Weight::Caution));
        }
        for k in 0..j {
            let straight = correlation[j][j].min(correlation[k][k]);
            if correlation[j][k].min(correlation[k][j]) > EXPLAINED && straight < 0.5 * EXPLAINED {
                let (a, b) = (&problem.joints[j], &problem.joints[k]);
                let message = format!("each fits the other joint: the torque columns of {a} and {b} may be swapped");
                out.push(remark("sign", format!("{a}.torque and {b}.torque"), message, Weight::Caution));
            }
        }
    }
    swapped_positions(problem, data, out);
}

/// Whether the links' torque fits the measured one far better where two joints' positions change places.
fn swapped_positions(problem: &Problem, data: &Data, out: &mut Vec<Remark>) {
    let joints = problem.joints.len();
    let left = |swap: Option<(usize, usize)>| -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for motion in &data.motions[..data.fit_count] {
            let mut motion = motion.clone();
            if let Some((a, b)) = swap {
                motion.position.swap(a, b);
                motion.velocity.swap(a, b);
                motion.acceleration.swap(a, b);
            }
            let nominal = torques(&problem.tree, &motion, &[]);
            for j in 0..joints {
                let size: f64 = motion.torque[j].iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
                sum += motion.torque[j].iter().zip(&nominal[j]).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / size;
                all += 1.0;
            }
        }
        sum / f64::max(all, 1.0)
    };
    let straight = left(None);
    for j in 0..joints {
        for k in 0..j {
            if straight > 0.5 && left(Some((j, k))) < 0.2 * straight {
                let (a, b) = (&problem.joints[j], &problem.joints[k]);
                let message =
                    format!("with the positions of {a} and {b} exchanged, the links need the measured torque: the columns are swapped");
                out.push(remark("sign", format!("{a}.position and {b}.position"), message, Weight::Caution));
            }
        }
    }
}
