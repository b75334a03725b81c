//! The joints of a recording, each with its motion, its effort, and the torque of the model's links.

use crate::error::FleetError;
use backdrive_diagnosis::arms::log::Log;
use backdrive_diagnosis::arms::motion::{Motion, Rates};
use backdrive_diagnosis::arms::problem::Problem as Arm;
use backdrive_diagnosis::arms::rigid::torques;
use backdrive_diagnosis::arms::usable::{clipped, leave_out};
use backdrive_diagnosis::recordings::noise::{step_of, white};
use backdrive_plant::model::{InputKind, Model, OutputKind};
use backdrive_plant::set::RecordingSet;
use backdrive_servo::problem::{Problem as Servo, is_servo};
use backdrive_servo::record::Record;
use backdrive_sets::Recordings;
use std::path::Path;

/// Rows of a regression, at the least.
pub const LEAST_ROWS: usize = 24;

/// A joint of a recording, on the grid of the regression.
pub struct JointData {
    /// Its name.
    pub name: String,
    /// Whether it was recorded by commands and positions: its effort is then the command less the position, rad or m.
    pub is_servo: bool,
    /// Rates of the grid.
    pub rates: Rates,
    /// Samples per second as recorded, Hz.
    pub rate_hz: f64,
    /// Position, rad or m.
    pub position: Vec<f64>,
    /// Velocity, rad/s or m/s.
    pub velocity: Vec<f64>,
    /// Acceleration, rad/s² or m/s².
    pub acceleration: Vec<f64>,
    /// Torque or force, N m or N; of a servo the command less the position, rad or m.
    pub effort: Vec<f64>,
    /// Torque of the model's links, N m or N; `None` where there is no model of them.
    pub load: Option<Vec<f64>>,
    /// 1 where a sample counts, 0 where the joint rests or its torque is clipped.
    pub counts: Vec<f64>,
    /// White noise of the recorded position, standard deviation, rad or m.
    pub position_noise: Option<f64>,
    /// Step of the recorded position, rad or m; `None` where it has none.
    pub position_step: Option<f64>,
    /// White noise of the recorded effort, standard deviation, in the unit of the effort.
    pub effort_noise: Option<f64>,
    /// Displacement over which dry friction turns its direction, rad or m.
    pub turn: f64,
    /// Of a servo: commands and positions as recorded.
    pub record: Option<Record>,
}

/// The joints of the one recording of a set.
///
/// # Errors
/// The recording cannot be read, or is of no joints with torques or commands.
pub fn joints_of(set: &RecordingSet, model: Option<&Path>) -> Result<Vec<JointData>, FleetError> {
    if is_servo(set) {
        return servo(set, model);
    }
    let Some(path) = model else {
        return Err(FleetError::input(format!(
            "{}: has no commands of servos, and no model is named; give one with --model MODEL.toml, or model = \"...\" in the manifest",
            set.fit.first().map_or("the recording", String::as_str)
        )));
    };
    match Model::load(path).map_err(FleetError::input)?.arm.is_some() {
        true => arm(set, path),
        false => one_axis(set, path),
    }
}

/// By torques of an arm.
fn arm(set: &RecordingSet, model: &Path) -> Result<Vec<JointData>, FleetError> {
    let problem = Arm::open(set, Some(model)).map_err(FleetError::input)?;
    let Some(log) = problem.fit.first() else { return Err(FleetError::input("the recording is empty")) };
    let (rates, mut motion) = grid(log)?;
    let limits = clipped(&[log], problem.joints.len());
    leave_out(&mut motion, log, &limits.iter().collect::<Vec<_>>(), &rates);
    let load = match &motion.payload {
        Some((link, payload)) => {
            let robot = problem.robot.with_mass_at(*link, payload.mass, payload.at);
            torques(&backdrive_diagnosis::arms::rigid::tree_of(&robot).map_err(FleetError::input)?, &motion, &[])
        }
        None => torques(&problem.tree, &motion, &[]),
    };
    let mut load: Vec<Option<Vec<f64>>> = load.into_iter().map(Some).collect();
    let names = problem.joints.iter().enumerate().filter(|(j, _)| !problem.is_passive(*j));
    Ok(names.map(|(j, name)| joint(name, false, log, &motion, &rates, j, load[j].take())).collect())
}

/// By commands and positions.
fn servo(set: &RecordingSet, model: Option<&Path>) -> Result<Vec<JointData>, FleetError> {
    let problem = Servo::open(set, model).map_err(FleetError::input)?;
    let mut out = Vec::new();
    for own in &problem.joints {
        let Some(record) = own.fit.first() else { continue };
        let error = record.command.iter().zip(&record.position).map(|(u, q)| u - q).collect();
        let log = log_of(&record.name, &record.t, record.position.clone(), error);
        let (rates, motion) = grid(&log)?;
        let gravity = (!record.gravity.is_empty()).then(|| {
            let along = record.gravity.iter().zip(&record.position).map(|([a, b, c], q)| a * q.cos() + b * q.sin() + c).collect();
            let of = Log { position: vec![along], ..log_of(&record.name, &record.t, Vec::new(), record.position.clone()) };
            Motion::of(&of, &rates).position.remove(0)
        });
        out.push(JointData { record: Some(record.clone()), ..joint(&own.name, true, &log, &motion, &rates, 0, gravity) });
    }
    Ok(out)
}

/// A device of one axis with one force and one position: one joint without links.
fn one_axis(set: &RecordingSet, model: &Path) -> Result<Vec<JointData>, FleetError> {
    let recordings = Recordings::Set(Box::new(set.clone()));
    let problem = backdrive_sets::open::open(&recordings, Some(model), None, &[]).map_err(FleetError::input)?.problem;
    let (inputs, outputs) = (&problem.model.inputs, &problem.model.outputs);
    let force = inputs.iter().position(|input| matches!(input.kind, InputKind::Force));
    let position = outputs.iter().position(|output| matches!(output.kind, OutputKind::Position(_)));
    let (Some(force), Some(position), 1, Some(record)) = (force, position, inputs.len(), problem.fit.first()) else {
        return Err(FleetError::input(format!(
            "{}: triage takes arms, position servos, and devices with one force and a position; use --what fit or --what diagnose",
            model.display()
        )));
    };
    let Some(moved) = record.outputs.get(position).cloned().flatten() else {
        return Err(FleetError::input(format!("{}: has no column \"{}\"", record.name, outputs[position].name)));
    };
    let count = moved.len().min(record.inputs[force].len());
    let t: Vec<f64> = (0..count).map(|i| i as f64 * record.period).collect();
    let log = log_of(&record.name, &t, moved[..count].to_vec(), record.inputs[force][..count].to_vec());
    let (rates, motion) = grid(&log)?;
    Ok(vec![joint(&outputs[position].name, false, &log, &motion, &rates, 0, None)])
}

fn log_of(name: &str, t: &[f64], position: Vec<f64>, effort: Vec<f64>) -> Log {
    Log { name: name.to_string(), t: t.to_vec(), position: vec![position], velocity: vec![None], torque: vec![effort], payload: None }
}

/// The log on the grid of the regression.
fn grid(log: &Log) -> Result<(Rates, Motion), FleetError> {
    let rates = Rates::of(&[log], None);
    let motion = Motion::of(log, &rates);
    let rows = rates.rows(&vec![0.0; motion.len()]).len();
    match rows < LEAST_ROWS {
        true => Err(FleetError::input(format!(
            "{}: is too short for a regression: {rows} rows below {:.1} Hz; record some seconds more",
            log.name, rates.corner
        ))),
        false => Ok((rates, motion)),
    }
}

fn joint(name: &str, is_servo: bool, log: &Log, motion: &Motion, rates: &Rates, j: usize, load: Option<Vec<f64>>) -> JointData {
    let counts = motion.moves[j].iter().zip(&motion.counts[j]).map(|(a, b)| a * b).collect();
    JointData {
        name: name.to_string(),
        is_servo,
        rates: *rates,
        rate_hz: rates.grid,
        position: motion.position[j].clone(),
        velocity: motion.velocity[j].clone(),
        acceleration: motion.acceleration[j].clone(),
        effort: motion.torque[j].clone(),
        load,
        counts,
        position_noise: white(&log.position[j]),
        position_step: step_of(&log.position[j]),
        effort_noise: noise_beside_jumps(&log.torque[j]),
        turn: turn(&log.position[j]),
        record: None,
    }
}

/// A displacement that the sensor can resolve, within 0.02 % to 2 % of the range, as the regression of arms begins with.
fn turn(position: &[f64]) -> f64 {
    let (low, high) = position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    let wide = (high - low).max(1e-9);
    let step = position.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    let resolved = if step.is_finite() { 2.0 * step } else { 0.0 };
    resolved.clamp(2e-4 * wide, 2e-2 * wide)
}

/// Standard deviation of the white noise of a torque. Dry friction jumps at every reversal, and the median of second differences does not see these few
/// samples; those of white noise have √6 times its deviation. `None` where most samples repeat the step of a coarse sensor.
fn noise_beside_jumps(samples: &[f64]) -> Option<f64> {
    let second: Vec<f64> = samples.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    let noise = 1.482_602_218_505_602 * backdrive_signal::statistics::median(second)? / 6f64.sqrt();
    (noise > 0.0).then_some(noise)
}
