//! The engine's torque by the observer, and its lag from that by output error.

use crate::fit::{Fitted, positive};
use crate::record::{BenchError, Record};
use backdrive_control::engine::{Engine, Grid};
use backdrive_control::observer::{Design, Shaft, System, UnknownInput, Weights, design};

/// Number of steps after which the lag's error is checked.
const EVERY: usize = 20;

/// How an observer is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// Order of magnitude of the noise of both speeds, engine and dynamometer, rad/s.
    pub noise: [f64; 2],
    /// How fast the torque changes, N m/s.
    pub force_rate: f64,
    /// m over the least one, above 1.
    pub back_off: f64,
}

impl Observation {
    /// The gains for a shaft.
    ///
    /// # Errors
    /// When there are none.
    pub fn gains(&self, shaft: &Shaft) -> Result<(System, Design), BenchError> {
        let system = System::shaft(shaft.engine, shaft.dynamometer, shaft.stiffness, shaft.damping, self.noise);
        let found = design(&system, &Weights { rate: self.force_rate.powi(-2), ..Weights::default() }, self.back_off)?;
        Ok((system, found))
    }

    /// The engine's torque of a record, N m, one value per step, by the observer with the dynamometer's torque as the converter estimates it.
    ///
    /// # Errors
    /// When there are no gains.
    pub fn torque(&self, shaft: &Shaft, record: &Record) -> Result<Vec<f64>, BenchError> {
        let (system, found) = self.gains(shaft)?;
        let mut observer = UnknownInput::new(&system, &found.k, &found.l, record.period_s);
        let mut known = 0.0;
        let mut torques = Vec::with_capacity(record.len());
        for k in 0..record.len() {
            observer.step(&[known], Some(&[record.engine_speed[k], record.dyno_speed[k]]));
            torques.push(observer.force(0));
            known = record.torque[k];
        }
        Ok(torques)
    }
}

/// The torque of a Hammerstein engine along a record's pedal and measured speed, N m.
pub fn engine_torque(engine: &Engine, record: &Record) -> Vec<f64> {
    let mut engine = engine.clone();
    record.pedal.iter().zip(&record.engine_speed).map(|(pedal, speed)| engine.step(*pedal, *speed, record.period_s)).collect()
}

/// Time constants, s, on a grid of pedals (0 to 1) and speeds (rad/s), so that the Hammerstein engine along the record has the observed torque.
///
/// # Errors
/// When the fit does not converge: some point of the grid is not stepped to.
pub fn lag(map: &Grid, record: &Record, observed: &[f64], pedals: &[f64], speeds: &[f64]) -> Result<(Grid, Fitted), BenchError> {
    let poor = |what: String| BenchError::Poor { step: "lag of the engine", what };
    let grid = |values: &[f64]| Grid::new(pedals.to_vec(), speeds.to_vec(), values.to_vec());
    let start = vec![1.0; pedals.len() * speeds.len()];
    let first = grid(&start).map_err(|e| poor(e.to_string()))?;
    let fitted = positive(&start, 20, |values| {
        let lag = grid(values).unwrap_or_else(|_| first.clone());
        let torque = engine_torque(&Engine::new(map.clone(), lag), record);
        torque.iter().zip(observed).skip(EVERY).step_by(EVERY).map(|(a, b)| a - b).collect()
    });
    let fitted =
        fitted.ok_or_else(|| poor("some point of its grid is not stepped to; record steps of the pedal about each".to_string()))?;
    Ok((grid(&fitted.values).map_err(|e| poor(e.to_string()))?, fitted))
}
