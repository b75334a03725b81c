//! The residual torque of each joint after a fit: how much of it the sensors' noise explains, and what it correlates with.
//!
//! Only rows in which the joint moves count: at rest dry friction is anything between its levels, and does not determine a law.

use crate::arms::fit::Fit;
use crate::arms::log::Log;
use crate::arms::motion::{ORDER, power_below};
use crate::arms::regression::{Data, correlation_time};
use crate::verdict::Where;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use nalgebra::DMatrix;
use std::ops::Range;

/// Share of a joint's rms torque from which on what remains is much: some times what models of joint friction leave behind on good arms.
pub const MUCH: f64 = 0.05;
/// Multiple of what the noise explains from which on what remains is more than that. The noise is estimated to within some tens of percent.
pub const ABOVE_NOISE: f64 = 2.0;
/// Multiple of the filter's own correlation time from which on what remains is called slow.
const SLOW: f64 = 2.0;
/// Share of the residual that has to follow a state of the arm for this to be reported.
const FOLLOWS: f64 = 0.4;
/// Classes of a state, within each of which the mean is taken.
const CLASSES: usize = 6;
/// Poses in which the inertia is evaluated.
const POSES: usize = 10;

/// What remains at one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Left {
    /// Its rms, as a share of the rms torque.
    pub share: f64,
    /// What noise of the sensors would leave, as a share of the same.
    pub noise: f64,
    /// Where it shows; `None` where it is little, or what the noise explains.
    pub shows: Option<Where>,
}

/// What remains at each joint, of held-out logs where there are some.
pub fn left(data: &Data, fit: &Fit) -> Vec<Left> {
    let held = data.fit_count < data.motions.len();
    let motions = if held { data.fit_count..data.motions.len() } else { 0..data.fit_count };
    let noise = noise(data, motions.clone());
    (0..data.problem.joints.len())
        .map(|joint| {
            let rms = data.scale(joint, held).max(f64::MIN_POSITIVE);
            let share = data.mean_square(&fit.residual, joint, held).sqrt() / rms;
            let noise = noise[joint] / rms;
            let is_much = !data.unsigned[joint] && share > MUCH && share > ABOVE_NOISE * noise;
            let shows = if is_much { shows(data, fit, joint, motions.clone()) } else { None };
            Left { share, noise, shows }
        })
        .collect()
}

/// Standard deviation of what the sensors' noise leaves in the rows of each joint, N m or N.
///
/// The torque's own is taken from differences of its samples, the positions' from their steps. Both are propagated as white noise through the filters of
/// the regression, positions twice differentiated and times the inertia that the joint feels.
fn noise(data: &Data, motions: Range<usize>) -> Vec<f64> {
    let joints = data.problem.joints.len();
    let logs: Vec<&Log> = data.problem.fit.iter().chain(&data.problem.held_out).collect();
    let inertia = inertia(data, motions.clone());
    let mut square = vec![0.0; joints];
    let count = motions.len().max(1) as f64;
    for log in motions.filter_map(|m| logs.get(m)) {
        let rate = (log.t.len().max(2) - 1) as f64 / (log.t.last().unwrap_or(&1.0) - log.t.first().unwrap_or(&0.0)).max(1e-9);
        let [plain, twice] = gains(data.rates.corner, rate);
        let of_positions: Vec<f64> = log.position.iter().map(|q| twice * white(q).max(step(q) / 12f64.sqrt())).collect();
        for (j, square) in square.iter_mut().enumerate() {
            let own = (plain * white(&log.torque[j])).powi(2);
            let moved: f64 = of_positions.iter().enumerate().map(|(k, a)| (inertia[(j, k)] * a).powi(2)).sum();
            *square += (own + moved) / count;
        }
    }
    square.into_iter().map(f64::sqrt).collect()
}

/// Of white noise of deviation 1 at this rate: what the filter leaves of it, and of its second derivative.
fn gains(corner: f64, rate: f64) -> [f64; 2] {
    let count = ((20.0 * rate / corner).ceil() as usize).clamp(64, 200_000);
    let mut pulse = vec![0.0; count];
    pulse[count / 2] = 1.0;
    let response = LowPass::butterworth(ORDER, corner.min(0.45 * rate), rate).both_ways(&pulse);
    let twice = derivative(&derivative(&response, 1.0 / rate), 1.0 / rate);
    [response, twice].map(|r| r.iter().map(|x| x * x).sum::<f64>().sqrt())
}

/// Standard deviation of white noise in a signal, by its third differences: slow motion has none, and the median leaves jumps aside.
fn white(samples: &[f64]) -> f64 {
    let mut all: Vec<f64> = samples.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    if all.is_empty() {
        return 0.0;
    }
    let middle = all.len() / 2;
    // Of a normal variable the median of its size is 0.6745 deviations; the squared binomials of third order add up to 20.
    *all.select_nth_unstable_by(middle, f64::total_cmp).1 / (0.6745 * 20f64.sqrt())
}

/// The smallest step of a signal; 0 where it has none.
fn step(samples: &[f64]) -> f64 {
    let least = samples.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// Mass matrix, the mean over some poses of the logs.
fn inertia(data: &Data, motions: Range<usize>) -> DMatrix<f64> {
    let joints = data.problem.joints.len();
    let tree = &data.problem.tree;
    let mut work = tree.workspace();
    let (mut sum, mut mass) = (DMatrix::zeros(joints, joints), DMatrix::zeros(joints, joints));
    let mut count = 0.0f64;
    for motion in motions.filter_map(|m| data.motions.get(m)) {
        for i in (0..motion.len()).step_by((motion.len() / POSES).max(1)) {
            let pose: Vec<f64> = motion.position.iter().map(|q| q[i]).collect();
            tree.mass_matrix(&pose, &mut work, &mut mass);
            sum += &mass;
            count += 1.0;
        }
    }
    sum /= count.max(1.0);
    for (j, armature) in data.problem.armature.iter().enumerate() {
        sum[(j, j)] += armature;
    }
    sum
}

/// When, at which frequencies and in which state it shows; `None` without rows.
fn shows(data: &Data, fit: &Fit, joint: usize, motions: Range<usize>) -> Option<Where> {
    let rows = |m: usize| &fit.residual[data.layout.of(m, joint)];
    let correlation = motions.clone().map(|m| correlation_time(rows(m))).fold(1.0, f64::max);
    // Which state it follows is asked of all logs: of the held-out ones alone few turns are independent.
    let everywhere = 0..data.motions.len();
    let count: usize = everywhere.clone().map(|m| data.layout.count(m)).sum();
    let independent = count as f64 / correlation;
    let state = state(data, fit, joint, everywhere, independent);
    // White noise below the corner has a correlation time of 1 / (2 corner).
    let own = (0.5 / data.rates.corner / data.rates.row_period()).max(1.0);
    let rate = 1.0 / data.rates.row_period();
    let longest = motions.clone().max_by_key(|m| data.layout.count(*m))?;
    let band_hz = [0.1, 0.9].map(|share| power_below(rows(longest), rate, share));
    let square = |b: &&crate::arms::layout::Block| {
        let part = &rows(b.motion)[b.rows.clone()];
        part.iter().map(|x| x * x).sum::<f64>() / part.len().max(1) as f64
    };
    let worst = data.blocks.iter().filter(|b| b.motion == longest).max_by(|a, b| square(a).total_cmp(&square(b)))?;
    let time = vec![[worst.rows.start, worst.rows.end].map(|row| data.rates.time_of(row))];
    let state = state.unwrap_or_else(|| {
        let pace = if correlation > SLOW * own { "slow" } else { "as fast as filtered noise, such as from the drive" };
        match independent < 2.0 * CLASSES as f64 {
            true => format!("{pace}; the logs are too short to show what it correlates with"),
            false => format!("{pace}, and correlates with no position, velocity, acceleration or torque of a joint"),
        }
    });
    Some(Where { time, band_hz, state: Some(state), class: None })
}

/// The state that what remains follows most, in words.
fn state(data: &Data, fit: &Fit, joint: usize, motions: Range<usize>, independent: f64) -> Option<String> {
    let residual: Vec<f64> = motions.clone().flat_map(|m| fit.residual[data.layout.of(m, joint)].iter().copied()).collect();
    let mut best: Option<(f64, String)> = None;
    for (k, name) in data.problem.joints.iter().enumerate() {
        for what in ["position", "velocity", "acceleration", "torque"] {
            let signal: Vec<f64> = motions
                .clone()
                .filter_map(|m| data.motions.get(m))
                .flat_map(|m| {
                    data.rates.rows(match what {
                        "position" => &m.position[k],
                        "velocity" => &m.velocity[k],
                        "acceleration" => &m.acceleration[k],
                        _ => &m.torque[k],
                    })
                })
                .collect();
            let share = explained(&residual, &signal, independent);
            if best.as_ref().is_none_or(|(most, _)| share > *most) {
                best = Some((share, format!("correlates with the {what} of {name}")));
            }
        }
    }
    best.filter(|(share, _)| *share > FOLLOWS).map(|(share, words)| format!("{words} ({:.0} % of it)", 100.0 * share))
}

/// Share of the mean square of samples that their means within classes of a signal explain, less what chance explains.
fn explained(samples: &[f64], signal: &[f64], independent: f64) -> f64 {
    let total: f64 = samples.iter().map(|x| x * x).sum();
    if total <= 0.0 || samples.len() != signal.len() || independent < 2.0 * CLASSES as f64 {
        return 0.0;
    }
    let mut order: Vec<usize> = (0..samples.len()).collect();
    order.sort_by(|a, b| signal[*a].total_cmp(&signal[*b]));
    let size = samples.len().div_ceil(CLASSES);
    let of_class = |class: &[usize]| class.iter().map(|i| samples[*i]).sum::<f64>().powi(2) / class.len() as f64;
    let share = order.chunks(size).map(of_class).sum::<f64>() / total;
    1.0 - (1.0 - share) * (independent - 1.0) / (independent - CLASSES as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_signal::statistics::rms;

    /// Even numbers between -1 and 1: deviation 1/√3.
    fn even(count: usize) -> Vec<f64> {
        let mut state = 9u64;
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
            })
            .collect()
    }

    #[test]
    fn noise_is_told_beside_a_motion_that_jumps() {
        let noise = even(4000);
        let wave = |i: usize| 40.0 * (i as f64 * 0.01).sin() + if (i / 500).is_multiple_of(2) { 5.0 } else { -5.0 };
        let samples: Vec<f64> = noise.iter().enumerate().map(|(i, x)| wave(i) + x).collect();
        let told = white(&samples) * 3f64.sqrt();
        assert!((told - 1.0).abs() < 0.1, "{told}");
    }

    #[test]
    fn what_a_filter_leaves_of_white_noise_is_what_its_pulse_says() {
        let (corner, rate) = (10.0, 500.0);
        let noise = even(60_000);
        let filter = LowPass::butterworth(ORDER, corner, rate);
        let through = filter.both_ways(&noise);
        let twice = derivative(&derivative(&through, 1.0 / rate), 1.0 / rate);
        let [plain, second] = gains(corner, rate).map(|g| g / 3f64.sqrt());
        assert!((rms(&through) / plain - 1.0).abs() < 0.1, "{} {plain}", rms(&through));
        assert!((rms(&twice) / second - 1.0).abs() < 0.1, "{} {second}", rms(&twice));
    }

    #[test]
    fn what_follows_a_signal_is_told_from_what_does_not() {
        let signal = even(2000);
        let follows: Vec<f64> = signal.iter().map(|x| x * x - 0.33).collect();
        assert!(explained(&follows, &signal, 2000.0) > 0.8);
        let other: Vec<f64> = even(2100).split_off(100);
        assert!(explained(&other, &signal, 2000.0).abs() < 0.02);
        // With too few independent samples nothing is reported.
        assert_eq!(explained(&follows, &signal, 10.0), 0.0);
    }
}
