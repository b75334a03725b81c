//! The guard: reduces the force gain when the loop is, or is about to be, above its stability limit.
//!
//! It watches the reflected force and the master's motion; what they do must be the loop's doing and not the hand's. The measure is the net energy
//! that the force channel puts into the master's port, `W = sum F_f(k) (x_m(k+1) - x_m(k))`. A hand that pushes against a passive wall extracts
//! energy from that port, so a trip requires `W > 0`.
//!
//! - **Growing**: in windows of 50 ms the part of the force above 8 Hz grows by half over four windows, with `W > 0`.
//! - **Persistent**: that part stays large, with `W > 0`, over six windows.
//! - **Runaway**, a canceller that subtracts too much at rest. Over five windows the force grows by increments of which each is more than 1.15 times
//!   the one before, at a ratio that does not fall. The master yields along the force (`W > 0`). That is an exponential. A passive wall without a
//!   canceller pushes harder only while the hand moves into it, against the force; on release the master moves along the force while the force falls.
//!   Behind a good canceller a hand that pushes (as `t`, `t^2`, `t^3`) has ratios that fall. Below its stability limit an over-cancelling loop
//!   creeps, but slower and slower. Windows of 5 to 160 ms are watched at once, so that fast and slow ones are seen after about as many e-foldings. A
//!   thing that itself pushes the slave ever harder is taken for a run-away.
//! - **Thin margin**, where there is a dither: the critical gain of [`crate::live_margin`] is below 1.25 times the gain, also at the upper end of its
//!   standard deviation.
//!
//! A reduced gain stays reduced until new gains are requested: it does not creep up again to find the limit a second time.

use crate::live_margin::CORNER_HZ;
use backdrive_msgs::{MAX_AXES, Sample};

const WINDOW_S: f64 = 0.05;
/// Growth of the oscillating part over three windows that counts as growing.
const GROWTH: f64 = 1.5;
/// Growth over three windows beyond which the gain is reduced by more at once.
const FAST_GROWTH: f64 = 3.0;
/// Windows in which a large oscillation must persist.
const PERSISTENT: u32 = 6;
/// The same soon after a back-off.
const STILL_PERSISTENT: u32 = 4;
/// Changes of sign of the part above 8 Hz over four windows, at least: a force that slides away has none.
const CROSSINGS: u32 = 3;
/// Time after a back-off within which the next one takes more, s.
const AGAIN_S: f64 = 1.0;
/// Remaining share of the gain after a back-off.
const BACK_OFF: f64 = 0.8;
/// The same where it grows fast, runs away, or has next to no margin.
const FAST_BACK_OFF: f64 = 0.6;
/// The same where the last back-off did not end it.
const AGAIN_BACK_OFF: f64 = 0.5;
/// A hand's time constant, damping over stiffness, s, rather long. An over-cancelling loop at `c` times its critical gain runs away at about
/// `(c - 1)` over it, so the rate gives the distance above the limit.
const HAND_S: f64 = 0.1;
/// Share of the critical gain, as estimated from the rate of a run-away, that remains.
const OF_EDGE: f64 = 0.7;
/// Least that is left after one back-off.
const LEAST_LEFT: f64 = 0.1;
/// Shortest window of the watch for a run-away, s; each further one is twice as long.
const SHORTEST_S: f64 = 0.005;
/// Window lengths of the watch for a run-away: up to 160 ms.
const LENGTHS: usize = 6;
/// Ratio of successive increments of a force that runs away, at least.
const RATIO: f64 = 1.15;
/// What may be lost of that ratio over two windows.
const STEADY: f64 = 0.98;
/// A force that runs away is at least this many times as large as an oscillation that is left alone.
const LARGE: f64 = 5.0;
/// A margin below this is thin.
pub const THIN_MARGIN: f64 = 1.25;
/// The margin that a back-off from a thin one aims at.
const ROOM: f64 = 1.5;

/// Why the gain was backed off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// The oscillation grew.
    Growing,
    /// The oscillation neither grew nor died.
    Persistent,
    /// Force and master ran away together, ever faster.
    Runaway,
    /// The stability limit that the dither shows is near.
    ThinMargin,
}

impl Reason {
    /// Name of the event.
    pub fn event(self) -> &'static str {
        match self {
            Reason::Growing => "guard_growing",
            Reason::Persistent => "guard_persistent",
            Reason::Runaway => "guard_runaway",
            Reason::ThinMargin => "guard_thin_margin",
        }
    }
}

#[derive(Debug, Clone, Default)]
struct Axis {
    low: f64,
    position: f64,
    low_position: f64,
    fast_position: f64,
    low_effort: f64,
    fast_effort: f64,
    begun: bool,
    square_sum: f64,
    total_sum: f64,
    /// Work of the force above 8 Hz in the window at hand and the last three, J.
    work: [f64; 4],
    history: [f64; 3],
    /// Changes of sign in the window at hand and the last three, and the sign now.
    crossings: [u32; 4],
    is_above: bool,
    large_windows: u32,
    /// Sums of the shortest window at hand.
    force_sum: f64,
    position_sum: f64,
    drift: Drift,
}

/// Means of force and position over windows of one length.
#[derive(Debug, Clone, Copy, Default)]
struct Means {
    /// Sums of the window at hand, and halves of it that are in them.
    sums: [f64; 2],
    halves: u32,
    /// Of the last five windows, the newest last.
    force: [f64; 5],
    position: [f64; 5],
    filled: usize,
}

impl Means {
    /// A window is over.
    fn push(&mut self, force: f64, position: f64) {
        self.force.rotate_left(1);
        self.position.rotate_left(1);
        (self.force[4], self.position[4]) = (force, position);
        self.filled = (self.filled + 1).min(5);
    }

    /// Ratio of the newest increments of a force that runs away.
    fn runaway(&self, least: f64) -> Option<f64> {
        let side = self.force[4].signum();
        let size = |i: usize| side * self.force[i];
        let grown = |i: usize| size(i + 1) - size(i);
        let along = |i: usize| side * (self.position[i + 1] - self.position[i]);
        let [first, second, third] = [grown(1) / grown(0), grown(2) / grown(1), grown(3) / grown(2)];
        let is_one = self.filled == 5
            && size(0) >= 0.0
            && size(4) > least
            // A creep that is lost in the force is none.
            && size(4) - size(0) > (0.25 * size(4)).max(least)
            && grown(0) > 0.0
            && first.min(second).min(third) > RATIO
            && third > STEADY * first
            && (1..4).all(|i| along(i) > 0.0);
        is_one.then_some(third)
    }
}

/// The watch for a run-away, over windows of all lengths.
#[derive(Debug, Clone, Copy, Default)]
struct Drift {
    lengths: [Means; LENGTHS],
}

impl Drift {
    /// A shortest window is over; the growth in such a window, as an exponent, of what runs away.
    fn push(&mut self, force: f64, position: f64, least: f64) -> Option<f64> {
        let (mut force, mut position, mut found) = (force, position, None);
        for (length, means) in self.lengths.iter_mut().enumerate() {
            means.push(force, position);
            if found.is_none() {
                found = means.runaway(least).map(|ratio| ratio.ln() / f64::from(1u32 << length));
            }
            // The next length takes this one's windows in pairs.
            means.sums = [means.sums[0] + 0.5 * force, means.sums[1] + 0.5 * position];
            means.halves += 1;
            if means.halves < 2 {
                break;
            }
            [force, position] = std::mem::take(&mut means.sums);
            means.halves = 0;
        }
        if found.is_some() {
            *self = Drift::default();
        }
        found
    }
}

/// Watches the reflected force and the master's motion.
#[derive(Debug, Clone)]
pub struct Guard {
    axes: Vec<Axis>,
    window: u32,
    filled: u32,
    shortest: u32,
    short_filled: u32,
    smoothing: f64,
    share: f64,
    target: f64,
    least_force: f64,
    /// Steps since the last back-off.
    since_last: u32,
    period_s: f64,
}

impl Guard {
    /// `least_force`: oscillation below this RMS is left alone, N or N m.
    pub fn new(axes: usize, least_force: f64, period_s: f64) -> Guard {
        Guard {
            axes: vec![Axis::default(); axes.min(MAX_AXES)],
            window: ((WINDOW_S / period_s).round() as u32).max(4),
            filled: 0,
            shortest: ((SHORTEST_S / period_s).round() as u32).max(1),
            short_filled: 0,
            smoothing: 1.0 - (-2.0 * std::f64::consts::PI * CORNER_HZ * period_s).exp(),
            share: 1.0,
            target: 1.0,
            least_force,
            since_last: u32::MAX,
            period_s,
        }
    }

    /// Share of the wanted gain that is allowed now, 0 to 1.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Share that the gain is on its way to.
    pub fn target(&self) -> f64 {
        self.target
    }

    /// New gains have been asked for: start again from the full gain.
    pub fn restore(&mut self) {
        self.target = 1.0;
    }

    /// The margin at [`Guard::target`], as a factor on the gain, and its standard deviation as a share of it.
    pub fn margin(&mut self, factor: f64, deviation: f64) -> Option<Reason> {
        // What is not a number is no margin.
        let is_thin = factor > 0.0 && factor * (1.0 + deviation) < THIN_MARGIN;
        if is_thin {
            self.target *= (factor / ROOM).clamp(FAST_BACK_OFF, BACK_OFF);
        }
        is_thin.then_some(Reason::ThinMargin)
    }

    /// One step, with the force now reflected and the master's newest measurement. Returns the event when it backs off.
    pub fn step(&mut self, force: &[f64; MAX_AXES], master: Option<&Sample>) -> Option<Reason> {
        // The share follows its target within a window, so that a back-off is no jolt.
        self.share += (self.target - self.share) * (4.0 / self.window as f64).min(1.0);
        if (self.share - self.target).abs() < 1e-6 {
            self.share = self.target;
        }
        for (index, axis) in self.axes.iter_mut().enumerate() {
            let now = force[index];
            axis.low += self.smoothing * (now - axis.low);
            axis.square_sum += (now - axis.low).powi(2);
            // What is below the least force has no sign of its own.
            if (now - axis.low).abs() > 0.5 * self.least_force && (now > axis.low) != axis.is_above {
                axis.is_above = now > axis.low;
                axis.crossings[3] += 1;
            }
            axis.total_sum += now * now;
            axis.force_sum += now;
            if let Some(position) = master.map(|m| m.position[index]).filter(|x| !x.is_nan()) {
                let effort = master.map_or(0.0, |m| if m.effort[index].is_nan() { 0.0 } else { m.effort[index] });
                if !axis.begun {
                    (axis.low_position, axis.low_effort, axis.begun) = (position, effort, true);
                }
                // The same filter for both, so that their product keeps its phase.
                axis.low_position += self.smoothing * (position - axis.low_position);
                let fast_position = position - axis.low_position;
                axis.work[3] += axis.fast_effort * (fast_position - axis.fast_position);
                axis.low_effort += self.smoothing * (effort - axis.low_effort);
                (axis.position, axis.fast_position, axis.fast_effort) = (position, fast_position, effort - axis.low_effort);
            }
            axis.position_sum += axis.position;
        }
        self.since_last = self.since_last.saturating_add(1);
        let runaway = self.drift();
        let oscillation = self.oscillation();
        let (reason, left) = runaway.or(oscillation)?;
        // If one back-off did not end it, the loop is further above the limit than that.
        let left = if self.is_again() { left.min(AGAIN_BACK_OFF) } else { left };
        self.since_last = 0;
        self.target *= left;
        Some(reason)
    }

    fn is_again(&self) -> bool {
        f64::from(self.since_last) * self.period_s < AGAIN_S
    }

    /// Why and how much to back off for a force that runs away.
    fn drift(&mut self) -> Option<(Reason, f64)> {
        self.short_filled += 1;
        if self.short_filled < self.shortest {
            return None;
        }
        let count = f64::from(std::mem::take(&mut self.short_filled));
        let seconds = count * self.period_s;
        let mut fastest: Option<f64> = None;
        for axis in &mut self.axes {
            let (force, position) = (axis.force_sum / count, axis.position_sum / count);
            (axis.force_sum, axis.position_sum) = (0.0, 0.0);
            if let Some(growth) = axis.drift.push(force, position, LARGE * self.least_force) {
                fastest = Some(fastest.unwrap_or(0.0).max(growth / seconds));
            }
        }
        let rate = fastest?;
        Some((Reason::Runaway, (OF_EDGE / (1.0 + rate * HAND_S)).clamp(LEAST_LEFT, FAST_BACK_OFF)))
    }

    /// Why and how much to back off for an oscillation.
    fn oscillation(&mut self) -> Option<(Reason, f64)> {
        self.filled += 1;
        if self.filled < self.window {
            return None;
        }
        let count = std::mem::take(&mut self.filled) as f64;
        let patience = if self.is_again() { STILL_PERSISTENT } else { PERSISTENT };
        let (mut verdict, mut left) = (None, BACK_OFF);
        for axis in &mut self.axes {
            let (rms, total) = ((axis.square_sum / count).sqrt(), (axis.total_sum / count).sqrt());
            let active = axis.work.iter().sum::<f64>() > 0.0;
            axis.work.rotate_left(1);
            axis.work[3] = 0.0;
            let oscillates = axis.crossings.iter().sum::<u32>() >= CROSSINGS;
            let counts = oscillates && rms > self.least_force && rms > 0.05 * total;
            let [first, second, third] = axis.history;
            let growing = counts && active && first > 0.0 && second > first && third > second && rms > third && rms > GROWTH * first;
            axis.large_windows = if counts && active && rms > 0.3 * total && rms > 0.9 * third { axis.large_windows + 1 } else { 0 };
            axis.history = [second, third, rms];
            axis.crossings.rotate_left(1);
            axis.crossings[3] = 0;
            (axis.square_sum, axis.total_sum) = (0.0, 0.0);
            if growing {
                verdict = Some(Reason::Growing);
                if rms > FAST_GROWTH * first {
                    left = FAST_BACK_OFF;
                }
            } else if axis.large_windows >= patience {
                axis.large_windows = 0;
                verdict = verdict.or(Some(Reason::Persistent));
            }
        }
        verdict.map(|reason| (reason, left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Drives the guard with an oscillation of growing amplitude; `lag` in radians of the force behind the motion.
    fn drive(growth_per_s: f64, phase: f64) -> Vec<Reason> {
        let mut guard = Guard::new(1, 0.02, 1e-3);
        let mut reasons = Vec::new();
        for step in 0..1500 {
            let t = step as f64 * 1e-3;
            let amplitude = (growth_per_s * t).exp();
            let w = 2.0 * std::f64::consts::PI * 40.0;
            let mut force = [0.0; MAX_AXES];
            force[0] = 0.2 * amplitude * (w * t + phase).sin();
            let mut master = Sample::new(1);
            (master.position[0], master.effort[0]) = (1e-3 * amplitude * (w * t).sin(), force[0]);
            reasons.extend(guard.step(&force, Some(&master)));
        }
        reasons
    }

    #[test]
    fn an_active_growing_oscillation_trips_it_and_a_damped_or_dying_one_does_not() {
        // A force that leads the motion puts energy in; one that lags takes it out.
        assert!(drive(5.0, 0.8).contains(&Reason::Growing));
        assert!(drive(0.0, 0.8).contains(&Reason::Persistent));
        assert!(drive(5.0, -0.8).is_empty());
        assert!(drive(-5.0, 0.8).is_empty());
    }

    /// Drives the guard with a force `-size(t)` and a master that gives way by `gives` m/N of it.
    fn slide(size: impl Fn(f64) -> f64, gives: f64, seconds: f64) -> Vec<(f64, Reason)> {
        let mut guard = Guard::new(1, 0.02, 1e-3);
        let mut reasons = Vec::new();
        for step in 0..(seconds * 1e3) as usize {
            let t = step as f64 * 1e-3;
            let mut force = [0.0; MAX_AXES];
            force[0] = -size(t);
            let mut master = Sample::new(1);
            (master.position[0], master.effort[0]) = (0.005 + gives * force[0], force[0]);
            reasons.extend(guard.step(&force, Some(&master)).map(|reason| (t, reason)));
        }
        reasons
    }

    #[test]
    fn a_run_away_trips_it_at_any_rate() {
        for rate in [1.2, 3.0, 15.0, 90.0] {
            let found = slide(|t| 0.5 + 0.1 * (rate * t).exp(), 1e-3, 5.0 / rate + 1.0);
            let Some((t, Reason::Runaway)) = found.first() else { panic!("{rate}: {found:?}") };
            assert!(rate * t < 5.0, "{rate}/s: after {} e-foldings", rate * t);
            // The same force from a hand that goes into the wall.
            assert!(slide(|t| 0.5 + 0.1 * (rate * t).exp(), -1e-3, 5.0 / rate + 1.0).is_empty());
        }
    }

    #[test]
    fn pushing_and_creeping_behind_a_canceller_is_no_run_away() {
        for power in 1..=3 {
            for duration in [0.1, 0.3, 1.0, 3.0] {
                let push = |t: f64| 3.0 * ((t - 0.2) / duration).clamp(0.0, 1.0).powi(power);
                assert!(slide(push, 1e-3, duration + 0.5).is_empty(), "t^{power} over {duration} s");
            }
        }
        // Below its stability limit the loop creeps to where it rests.
        for rate in [0.5, 5.0, 50.0] {
            assert!(slide(|t| 4.0 * (1.0 - (-rate * t).exp()), 1e-3, 4.0).is_empty(), "{rate}");
            // And a release.
            assert!(slide(|t| 4.0 * (-rate * t).exp(), 1e-3, 4.0).is_empty(), "{rate}");
        }
    }

    #[test]
    fn a_thin_margin_counts_only_where_it_is_sure_and_is_widened_once() {
        let mut guard = Guard::new(1, 0.02, 1e-3);
        assert_eq!(guard.margin(1.3, 0.01), None);
        assert_eq!(guard.margin(1.2, 0.1), None);
        assert_eq!(guard.margin(f64::NAN, 0.1), None);
        assert_eq!(guard.margin(1.1, 0.05), Some(Reason::ThinMargin));
        assert!((guard.target() - 1.1 / 1.5).abs() < 1e-12);
        assert_eq!(guard.margin(1.5, 0.05), None);
        guard.restore();
        assert_eq!(guard.target(), 1.0);
    }
}
