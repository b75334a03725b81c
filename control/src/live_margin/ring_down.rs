//! How fast an oscillation dies after contacts and disturbances.

use std::f64::consts::TAU;

/// Length of a window of the ring-down, s.
const RING_WINDOW_S: f64 = 0.05;

/// What is slower is the hand, Hz.
pub(crate) const CORNER_HZ: f64 = 8.0;

/// Windows over which a ring-down must hold.
const RING_WINDOWS: usize = 4;

/// Decay rate of the part of a force above 8 Hz: the slope of the logarithm of its RMS over four windows of 50 ms. It is given where the RMS falls
/// (or rises) from each window to the next by about as much. It describes an oscillation, not the stability margin.
#[derive(Debug, Clone)]
pub struct RingDown {
    smoothing: f64,
    low: f64,
    /// What a force that changes evenly leaves above the first corner.
    pub(super) slope: f64,
    pub(super) square_sum: f64,
    filled: u32,
    pub(super) window: u32,
    window_s: f64,
    /// Natural logarithm of the RMS of the last windows, the newest last; NaN where there was too little.
    history: [f64; RING_WINDOWS],
    pub(super) least_force: f64,
}

impl RingDown {
    /// A force below `least_force` RMS, N or N m, is not evaluated.
    pub fn new(least_force: f64, period_s: f64) -> RingDown {
        let window = ((RING_WINDOW_S / period_s).round() as u32).max(4);
        RingDown {
            smoothing: 1.0 - (-TAU * CORNER_HZ * period_s).exp(),
            low: 0.0,
            slope: 0.0,
            square_sum: 0.0,
            filled: 0,
            window,
            window_s: f64::from(window) * period_s,
            history: [f64::NAN; RING_WINDOWS],
            least_force,
        }
    }

    /// One step with the force, N or N m.
    pub fn step(&mut self, force: f64) {
        if !force.is_finite() {
            self.history = [f64::NAN; RING_WINDOWS];
            return;
        }
        self.low += self.smoothing * (force - self.low);
        let fast = force - self.low;
        self.slope += self.smoothing * (fast - self.slope);
        self.square_sum += (fast - self.slope).powi(2);
        self.filled += 1;
        if self.filled == self.window {
            let rms = (self.square_sum / f64::from(self.window)).sqrt();
            self.history.rotate_left(1);
            self.history[RING_WINDOWS - 1] = if rms > self.least_force { rms.ln() } else { f64::NAN };
            (self.filled, self.square_sum) = (0, 0.0);
        }
    }

    /// 1/s, positive where it dies and negative where it grows; `None` where nothing rings.
    pub fn decay_per_s(&self) -> Option<f64> {
        let falls = |i: usize| self.history[i] - self.history[i + 1];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..RING_WINDOWS - 1 {
            if falls(i).is_nan() {
                return None;
            }
            (low, high) = (low.min(falls(i)), high.max(falls(i)));
        }
        let mean = (self.history[0] - self.history[RING_WINDOWS - 1]) / (RING_WINDOWS - 1) as f64;
        (low * high > 0.0 && high - low < 1.5 * mean.abs()).then_some(mean / self.window_s)
    }
}
