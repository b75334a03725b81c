//! The paper's validations: correlations of what the identified bench does with what was measured.

use crate::dynamometer::torque_of;
use crate::lag::{Observation, engine_torque};
use crate::numbers::Bench;
use crate::record::{BenchError, Record};
use crate::simulate::{Trajectory, closed_loop, open_loop};
use backdrive_signal::statistics::correlation;

/// Correlation coefficients, 0 to 1, and the signals that they are of.
pub struct Validation {
    /// w_A of the dragged bench in closed loop.
    pub mechanical_closed: f64,
    /// w_A of the dragged bench under the measured T_A and the map's friction.
    pub mechanical_open: f64,
    /// w_C and w_A of the mechanical model under T_A and the observed T_C.
    pub observer: [f64; 2],
    /// T_C of the engine model with the observed one.
    pub engine: f64,
    /// T_A of the dynamometer model, dragged with excitation, and on the test cycle.
    pub dynamometer: [f64; 2],
    /// w_C and T_A of the whole bench from pedal and wanted speed alone.
    pub whole: [f64; 2],
    /// The dragged bench in closed loop.
    pub dragged: Trajectory,
    /// The mechanical model under T_A and the observed T_C.
    pub fed: Trajectory,
    /// The whole bench.
    pub all: Trajectory,
    /// T_C observed and of the engine model, N m.
    pub engine_torques: [Vec<f64>; 2],
    /// T_A of the dynamometer model on the test cycle, N m.
    pub dyno_torque: Vec<f64>,
}

/// Validates with two records that no identification has seen: `dragged` (pedal at 0) and a test cycle.
///
/// # Errors
/// When the observer has no gains.
pub fn validate(bench: &Bench, observation: &Observation, dragged: &Record, unseen: &Record) -> Result<Validation, BenchError> {
    let loop_dragged = closed_loop(bench, dragged);
    let friction: Vec<f64> = dragged.engine_speed.iter().map(|speed| bench.engine.static_torque(0.0, *speed)).collect();
    let open_dragged = open_loop(&bench.shaft, dragged, &friction, &dragged.torque);
    let observed = observation.torque(&bench.shaft, unseen)?;
    let fed = open_loop(&bench.shaft, unseen, &observed, &unseen.torque);
    let engine = engine_torque(&bench.engine, unseen);
    let dyno_torque = torque_of(&bench.dynamometer, unseen);
    let all = closed_loop(bench, unseen);
    Ok(Validation {
        mechanical_closed: correlation(&loop_dragged.dyno_speed, &dragged.dyno_speed),
        mechanical_open: correlation(&open_dragged.dyno_speed, &dragged.dyno_speed),
        observer: [correlation(&fed.engine_speed, &unseen.engine_speed), correlation(&fed.dyno_speed, &unseen.dyno_speed)],
        engine: correlation(&engine, &observed),
        dynamometer: [correlation(&torque_of(&bench.dynamometer, dragged), &dragged.torque), correlation(&dyno_torque, &unseen.torque)],
        whole: [correlation(&all.engine_speed, &unseen.engine_speed), correlation(&all.dyno_torque, &unseen.torque)],
        dragged: loop_dragged,
        fed,
        all,
        engine_torques: [observed, engine],
        dyno_torque,
    })
}
