//! What is there without an observer: the equation of motion of the whole shaft, with speeds differentiated.

use backdrive_signal::butterworth::Butterworth;
/// `T_C = J_C w_C' + J_A w_A' - T_A`, derivatives as differences of two samples, behind a Butterworth low-pass.
#[derive(Debug, Clone)]
pub struct Derivative {
    inertia: [f64; 2],
    filter: Butterworth,
    before: Option<[f64; 2]>,
    period_s: f64,
}

impl Derivative {
    /// Inertias of engine and dynamometer, kg m2; the low-pass' order and corner, Hz.
    pub fn new(inertia: [f64; 2], order: usize, corner_hz: f64, period_s: f64) -> Derivative {
        Derivative { inertia, filter: Butterworth::new(order, corner_hz, period_s), before: None, period_s }
    }

    /// The engine's torque, N m, of speeds measured now, rad/s, and the dynamometer's torque held until now, N m.
    pub fn step(&mut self, torque: f64, speeds: [f64; 2]) -> f64 {
        let before = self.before.replace(speeds).unwrap_or(speeds);
        let rate = |i: usize| (speeds[i] - before[i]) / self.period_s;
        self.filter.step(self.inertia[0] * rate(0) + self.inertia[1] * rate(1) - torque)
    }
}
