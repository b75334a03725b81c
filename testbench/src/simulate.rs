//! A bench simulated with identified numbers.

use crate::numbers::Bench;
use crate::record::Record;
use backdrive_control::dynamometer::Dynamometer;
use backdrive_control::observer::Shaft;
use nalgebra::DMatrix;

/// What a simulated bench did, one value per step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    /// w_C, rad/s.
    pub engine_speed: Vec<f64>,
    /// w_A, rad/s.
    pub dyno_speed: Vec<f64>,
    /// T_A, N m.
    pub dyno_torque: Vec<f64>,
    /// T_C, N m.
    pub engine_torque: Vec<f64>,
}

/// The shaft from step to step, exact for torques that are held: twist, w_C, w_A.
#[derive(Debug, Clone)]
pub(crate) struct Stepper {
    step: [[f64; 5]; 3],
    state: [f64; 3],
}

impl Stepper {
    pub(crate) fn new(shaft: &Shaft, period_s: f64, speeds: [f64; 2]) -> Stepper {
        let Shaft { engine: jc, dynamometer: ja, stiffness: c, damping: d } = *shaft;
        let rows = [[0.0, 1.0, -1.0, 0.0, 0.0], [-c / jc, -d / jc, d / jc, 1.0 / jc, 0.0], [c / ja, d / ja, -d / ja, 0.0, 1.0 / ja]];
        let all = DMatrix::from_fn(5, 5, |i, j| if i < 3 { rows[i][j] * period_s } else { 0.0 }).exp();
        Stepper { step: std::array::from_fn(|i| std::array::from_fn(|j| all[(i, j)])), state: [0.0, speeds[0], speeds[1]] }
    }

    pub(crate) fn speeds(&self) -> [f64; 2] {
        [self.state[1], self.state[2]]
    }

    /// One period under the torques of engine and dynamometer, N m.
    pub(crate) fn step(&mut self, engine: f64, dynamometer: f64) {
        let [a, b, c] = self.state;
        let all = [a, b, c, engine, dynamometer];
        self.state = self.step.map(|row| row.iter().zip(all).map(|(m, x)| m * x).sum());
    }
}

/// The shaft under torques that are given, from the record's first speeds: it integrates, so errors of the torques add up.
pub fn open_loop(shaft: &Shaft, record: &Record, engine: &[f64], dynamometer: &[f64]) -> Trajectory {
    let mut stepper = Stepper::new(shaft, record.period_s, [record.engine_speed[0], record.dyno_speed[0]]);
    let mut found = Trajectory { engine_torque: engine.to_vec(), dyno_torque: dynamometer.to_vec(), ..Trajectory::default() };
    for (engine, dynamometer) in engine.iter().zip(dynamometer) {
        let [c, a] = stepper.speeds();
        found.engine_speed.push(c);
        found.dyno_speed.push(a);
        stepper.step(*engine, *dynamometer);
    }
    found
}

/// The whole bench under pedal, wanted speed and added torque of a record alone, with the record's speed control: nothing of what was measured
/// enters. `speeds` is where it begins, rad/s.
pub fn closed_loop(bench: &Bench, record: &Record) -> Trajectory {
    let period = record.period_s;
    let mut stepper = Stepper::new(&bench.shaft, period, [record.engine_speed[0], record.dyno_speed[0]]);
    let mut machine = Dynamometer::new(bench.dynamometer.clone(), period);
    let (mut engine, mut control) = (bench.engine.clone(), record.control);
    let mut found = Trajectory::default();
    for k in 0..record.len() {
        let [speed, dyno_speed] = stepper.speeds();
        let command = control.step(record.setpoint[k], speed, record.added[k], period).0;
        let torque = machine.step(command, dyno_speed).0;
        let combustion = engine.step(record.pedal[k], speed, period);
        found.engine_speed.push(speed);
        found.dyno_speed.push(dyno_speed);
        found.dyno_torque.push(torque);
        found.engine_torque.push(combustion);
        stepper.step(combustion, torque);
    }
    found
}
