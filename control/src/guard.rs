//! The guard: backs the force gain off when the loop begins to oscillate by its own energy.
//!
//! Two facts must meet in a window of 50 ms: the reflected force oscillates (its part above 8 Hz grows, or stays large),
//! and the force channel puts net energy into the master's port, W = sum F_f(k) (x_m(k+1) - x_m(k)) > 0. A hand that
//! pushes against a passive wall takes energy out of that port, so work done by the operator does not trip it.

use backdrive_msgs::{MAX_AXES, Sample};

const WINDOW_S: f64 = 0.05;
const CORNER_HZ: f64 = 8.0;
/// Growth of the oscillating part over three windows that counts as growing.
const GROWTH: f64 = 1.5;
/// Windows in which a large oscillation must persist.
const PERSISTENT: u32 = 6;
/// What is left of the gain after a back-off.
const BACK_OFF: f64 = 0.8;

/// Why the gain was backed off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// The oscillation grew.
    Growing,
    /// The oscillation neither grew nor died.
    Persistent,
}

impl Reason {
    /// Name of the event.
    pub fn event(self) -> &'static str {
        match self {
            Reason::Growing => "guard_growing",
            Reason::Persistent => "guard_persistent",
        }
    }
}

#[derive(Debug, Clone, Default)]
struct Axis {
    low: f64,
    position: f64,
    force: f64,
    begun: bool,
    square_sum: f64,
    total_sum: f64,
    work: f64,
    history: [f64; 3],
    large_windows: u32,
}

/// Watches the reflected force and the master's motion.
#[derive(Debug, Clone)]
pub struct Guard {
    axes: Vec<Axis>,
    window: u32,
    filled: u32,
    smoothing: f64,
    share: f64,
    target: f64,
    least_force: f64,
}

impl Guard {
    /// `least_force`: oscillation below this RMS is left alone, N or N m.
    pub fn new(axes: usize, least_force: f64, period_s: f64) -> Guard {
        Guard {
            axes: vec![Axis::default(); axes.min(MAX_AXES)],
            window: ((WINDOW_S / period_s).round() as u32).max(4),
            filled: 0,
            smoothing: 1.0 - (-2.0 * std::f64::consts::PI * CORNER_HZ * period_s).exp(),
            share: 1.0,
            target: 1.0,
            least_force,
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

    /// One step, with the force now reflected and the master's newest measurement. Says when it backs off.
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
            axis.total_sum += now * now;
            if let Some(position) = master.map(|m| m.position[index]).filter(|x| !x.is_nan()) {
                if axis.begun {
                    axis.work += axis.force * (position - axis.position);
                }
                (axis.position, axis.begun) = (position, true);
                axis.force = master.map_or(0.0, |m| if m.effort[index].is_nan() { 0.0 } else { m.effort[index] });
            }
        }
        self.filled += 1;
        if self.filled < self.window {
            return None;
        }
        let count = std::mem::take(&mut self.filled) as f64;
        let mut verdict = None;
        for axis in &mut self.axes {
            let (rms, total) = ((axis.square_sum / count).sqrt(), (axis.total_sum / count).sqrt());
            let active = axis.work > 0.0;
            let counts = rms > self.least_force && rms > 0.05 * total;
            let [first, second, third] = axis.history;
            let growing = counts && active && first > 0.0 && second > first && third > second && rms > third && rms > GROWTH * first;
            axis.large_windows = if counts && active && rms > 0.3 * total && rms > 0.9 * third { axis.large_windows + 1 } else { 0 };
            axis.history = [second, third, rms];
            (axis.square_sum, axis.total_sum, axis.work) = (0.0, 0.0, 0.0);
            if growing {
                verdict = Some(Reason::Growing);
            } else if axis.large_windows >= PERSISTENT {
                axis.large_windows = 0;
                verdict = verdict.or(Some(Reason::Persistent));
            }
        }
        if verdict.is_some() {
            self.target *= BACK_OFF;
            self.axes.iter_mut().for_each(|a| a.history = [0.0; 3]);
        }
        verdict
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
}
