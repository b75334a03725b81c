//! The shaft between an engine and a dynamometer: a model file in time, driven by two torques.

use crate::core::{Core, Events, Port, Tick};
use crate::device::{DeviceError, DeviceOptions};
use crate::freshness::Freshness;
use backdrive_msgs::Sample;
use backdrive_plant::model::{InputKind, Model};
use backdrive_plant::stepper::{Options, Plant, Segment};

/// The inputs that a model of a shaft has: torques on its two ends, N m.
pub const TORQUES: [&str; 2] = ["engine_torque", "dyno_torque"];
/// The outputs that it has: both speeds, rad/s, and the torque that it carries, N m.
pub const SENSORS: [&str; 3] = ["engine_speed", "dyno_speed", "shaft_torque"];

/// Inputs `engine`, `dynamometer` (effort, held from step to step); outputs `engine`, `dynamometer` (measured velocity), `coupling` (effort =
/// measured torque of the shaft, positive where the engine is ahead).
///
/// At step k it is first carried from k-1 to k under the torques of step k-1 (so its inputs come with a delay of one step), then measured. A
/// torque that is missing is held.
pub struct ShaftNode {
    plant: Plant,
    /// Per input of the model, which torque drives it.
    drives: Vec<usize>,
    sensors: [usize; 3],
    segments: Vec<Segment>,
    values: Vec<f64>,
    torques: [f64; 2],
    fresh: [Freshness; 2],
    started: bool,
    was_finite: bool,
}

impl ShaftNode {
    /// A shaft at rest.
    ///
    /// # Errors
    /// When the model lacks one of [`TORQUES`] or [`SENSORS`], has another input, or cannot be stepped.
    pub fn new(model: &Model, period_s: f64, options: &DeviceOptions) -> Result<ShaftNode, DeviceError> {
        let lacks = |name: &str| DeviceError::NoSignal { model: model.name.clone(), signal: name.to_string() };
        let mut drives = Vec::new();
        for input in &model.inputs {
            match TORQUES.iter().position(|name| input.name == *name).filter(|_| input.kind == InputKind::Force) {
                Some(which) => drives.push(which),
                None => return Err(DeviceError::UndrivenInput { model: model.name.clone(), input: input.name.clone() }),
            }
        }
        if let Some(name) = TORQUES.iter().find(|name| !model.inputs.iter().any(|i| i.name == **name)) {
            return Err(lacks(name));
        }
        let sensor = |name: &str| model.outputs.iter().position(|o| o.name == name).ok_or_else(|| lacks(name));
        let sensors = [sensor(SENSORS[0])?, sensor(SENSORS[1])?, sensor(SENSORS[2])?];
        let options = Options { substeps: options.substeps, add_noise: options.noise_seed, quantise: options.quantise };
        let plant = Plant::new(model, period_s, &options).map_err(|e| DeviceError::Compile(model.name.clone(), e))?;
        let (segments, values) = (vec![Segment::held(0.0); model.inputs.len()], vec![0.0; model.outputs.len()]);
        Ok(ShaftNode {
            plant,
            drives,
            sensors,
            segments,
            values,
            torques: [0.0; 2],
            fresh: Default::default(),
            started: false,
            was_finite: true,
        })
    }
}

impl Core for ShaftNode {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        for which in 0..2 {
            if let Some(sample) = self.fresh[which].new_sample(&inputs[which], |s| s.effort[0]) {
                self.torques[which] = sample.effort[0];
            }
        }
        if self.started {
            for (segment, which) in self.segments.iter_mut().zip(&self.drives) {
                *segment = Segment::held(self.torques[*which]);
            }
            self.plant.step(&self.segments);
        }
        self.started = true;
        self.plant.outputs(&mut self.values);
        let finite = self.plant.is_finite();
        if !finite && self.was_finite {
            events.push("state_not_finite", tick.time_s, 2);
        }
        self.was_finite = finite;
        for axis in 0..outputs[0].len() {
            outputs[0].velocity[axis] = self.values[self.sensors[0]];
            outputs[1].velocity[axis] = self.values[self.sensors[1]];
            outputs[2].effort[axis] = self.values[self.sensors[2]];
        }
    }
}
