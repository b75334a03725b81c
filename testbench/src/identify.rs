//! All steps of the identification, in the paper's order.

use crate::dynamometer::linear_part;
use crate::fit::Fitted;
use crate::lag::{Observation, lag};
use crate::maps::{dynamometer_map, engine_map};
use crate::mechanics::{damping_by_poles, inertia_of_dynamometer, refine};
use crate::numbers::Bench;
use crate::record::{BenchError, Record};
use backdrive_control::engine::{Engine, Grid};
use backdrive_control::observer::Shaft;

/// What is known before, and how to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// J_C of the data sheet, kg m2.
    pub engine_inertia: f64,
    /// c of the data sheet, N m/rad.
    pub stiffness: f64,
    /// Most power of the dynamometer by its plate, W.
    pub power: f64,
    /// Shortest stretch that counts as a stationary point, s.
    pub plateau_s: f64,
    /// Pedals (0 to 1) and speeds (rad/s) between which the lag is linear.
    pub lag_points: [Vec<f64>; 2],
    /// The observer of the engine's torque.
    pub observation: Observation,
}

/// What was identified, step by step.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// The bench.
    pub bench: Bench,
    /// d as the poles had it, N m s/rad, before the refinement.
    pub first_damping: f64,
    /// Frequency of the torsional mode in the measured response, Hz.
    pub torsional_hz: f64,
    /// J_C, c, d of the refinement with the friction of the static map alone, as the paper has it.
    pub first: Fitted,
    /// J_C, c, d of the refinement with the engine's lag too, with their errors.
    pub refined: Fitted,
    /// Time constants with their errors, s.
    pub lags: Fitted,
    /// The observed torque of the record with the steps of the pedal, N m.
    pub observed: Vec<f64>,
}

/// Identifies a bench from three records: dragged with excitation; stationary points; steps of the pedal.
///
/// # Errors
/// When a record does not show what a step needs; the error names the step and what to record.
pub fn identify(asked: &Asked, unfired: &Record, stationary: &Record, steps: &Record) -> Result<Identified, BenchError> {
    let map = engine_map(stationary, asked.plateau_s)?;
    let dynamometer = linear_part(unfired, dynamometer_map(stationary, asked.plateau_s)?, asked.power)?;
    let dynamometer_inertia = inertia_of_dynamometer(unfired)?;
    let (damping, frequency) = damping_by_poles(unfired, asked.engine_inertia, dynamometer_inertia)?;
    let shaft = Shaft { engine: asked.engine_inertia, dynamometer: dynamometer_inertia, stiffness: asked.stiffness, damping };
    // First with the friction of the map alone, as the paper does; then again with the lag that was found, which friction has too.
    let mut bench = Bench { shaft, engine: Engine::new(map.clone(), Grid::constant(1e-3)), dynamometer };
    let mut round = || {
        let (shaft, refined) = refine(&bench, unfired)?;
        let observed = asked.observation.torque(&shaft, steps)?;
        let [pedals, speeds] = &asked.lag_points;
        let (times, lags) = lag(&map, steps, &observed, pedals, speeds)?;
        bench = Bench { shaft, engine: Engine::new(map.clone(), times), ..bench.clone() };
        Ok::<_, BenchError>((refined, lags, observed))
    };
    let (first, ..) = round()?;
    let (refined, lags, observed) = round()?;
    Ok(Identified { bench, first_damping: damping, torsional_hz: frequency / std::f64::consts::TAU, first, refined, lags, observed })
}
