//! One number of a device that may be another than its model states: what it changes, where it is looked for, and what it is called.

use crate::cause_kind::CauseKind;
use crate::trial::Trial;
use backdrive_nodes::graph::{DeviceFiles, NodeKind, Settings};
use backdrive_plant::elements::Law;
use backdrive_plant::model::{InputKind, Model};
use serde::Serialize;
use std::f64::consts::TAU;

/// What is changed. Factors are 1 where the model is right, times are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Knob {
    /// Every force of the grip.
    Grip,
    /// Springs of the grip.
    GripSprings,
    /// Dampers of the grip.
    GripDampers,
    /// Every mass of the device.
    Masses,
    /// The mass at the handle or the tip.
    HeldMass,
    /// The force that a motor makes of its command: a wrong torque constant.
    Motor,
    /// Every force of the device's own elements.
    Forces,
    /// Time constant of a lag between command and force, s.
    MotorLag,
    /// Delay between command and force, s.
    MotorDelay,
    /// The measured position.
    Sensor,
    /// Every force of a slave's servo.
    Servo,
    /// The motion that a slave makes of its command.
    Command,
    /// Time constant of a lag before a slave's servo, s.
    CommandLag,
    /// Delay before a slave's servo, s.
    CommandDelay,
    /// Every force of what the slave touches.
    Wall,
}

/// Knobs of a master, the simplest explanation first.
const OF_A_MASTER: [Knob; 9] = [
    Knob::Grip,
    Knob::Motor,
    Knob::Masses,
    Knob::HeldMass,
    Knob::Sensor,
    Knob::MotorLag,
    Knob::MotorDelay,
    Knob::GripSprings,
    Knob::Forces,
];

/// Knobs of a slave that follows a command.
const OF_A_SLAVE: [Knob; 6] = [Knob::Servo, Knob::Masses, Knob::Wall, Knob::Command, Knob::CommandLag, Knob::CommandDelay];

impl Knob {
    /// Those that a device has.
    pub fn all(kind: NodeKind, files: &DeviceFiles) -> Vec<Knob> {
        let all: &[Knob] = match kind {
            NodeKind::Master => &OF_A_MASTER,
            NodeKind::Slave => &OF_A_SLAVE,
            _ => &[],
        };
        let fits = |knob: &&Knob| match knob {
            Knob::Grip | Knob::GripSprings | Knob::GripDampers | Knob::Wall => files.fragment.is_some(),
            _ => files.model.is_some(),
        };
        all.iter().filter(fits).copied().collect()
    }

    /// Where the model is right.
    pub fn neutral(self) -> f64 {
        if self.is_time() { 0.0 } else { 1.0 }
    }

    /// Whether its value is a time, s.
    pub fn is_time(self) -> bool {
        matches!(self, Knob::MotorLag | Knob::MotorDelay | Knob::CommandLag | Knob::CommandDelay)
    }

    /// Values from which a search starts, beside the neutral one.
    pub fn starts(self, period_s: f64) -> Vec<f64> {
        if self.is_time() {
            // From one row to where a loop of a few hertz turns round.
            return [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0].iter().map(|ms| 1e-3 * ms).filter(|s| *s >= period_s).collect();
        }
        let factors = [0.05, 0.12, 0.25, 0.4, 0.6, 0.8, 1.25, 1.6, 2.3, 3.5, 5.5, 9.0];
        let signed = matches!(self, Knob::Motor | Knob::Sensor | Knob::Command);
        signed.then_some(-1.0).into_iter().chain(factors).collect()
    }

    /// Values that are possible.
    pub fn bounds(self) -> [f64; 2] {
        match self {
            _ if self.is_time() => [0.0, 0.25],
            Knob::Motor | Knob::Sensor | Knob::Command => [-20.0, 20.0],
            _ => [0.02, 50.0],
        }
    }

    /// Gives a node's device this value.
    pub fn apply(self, trial: &mut Trial, node: &str, value: f64) {
        let settings = trial.graph.nodes.iter_mut().find(|n| n.name == node).map(|n| &mut n.settings);
        let Some(Settings::Master(files) | Settings::Slave(files)) = settings else { return };
        self.put(files, value);
    }

    /// The same of the files of a device.
    pub fn put(self, files: &mut DeviceFiles, value: f64) {
        match self {
            Knob::Grip | Knob::Wall => files.fragment.iter_mut().for_each(|f| f.scale(value)),
            Knob::GripSprings | Knob::GripDampers => {
                let elements = files.fragment.iter_mut().flat_map(|f| f.network.elements.iter_mut());
                let wanted = |law: &Law| matches!((self, law), (Knob::GripSprings, Law::Spring(_)) | (Knob::GripDampers, Law::Damper(_)));
                elements.filter(|e| wanted(&e.law)).for_each(|e| e.law = e.law.scaled(value));
            }
            _ => files.model.iter_mut().for_each(|model| self.of_model(model, value)),
        }
    }

    /// Takes a value back that [`Knob::put`] gave.
    pub fn undo(self, files: &mut DeviceFiles, value: f64) {
        match self {
            Knob::MotorLag | Knob::CommandLag => {
                let Some(model) = &mut files.model else { return };
                let feedbacks: Vec<usize> = model.axes.iter().map(|a| a.feedback).collect();
                for input in feedbacks {
                    if let Some(input) = model.inputs.get_mut(input) {
                        let own = 1.0 / (TAU * input.bandwidth) - value;
                        input.bandwidth = if own > 1e-3 * value { 1.0 / (TAU * own) } else { f64::INFINITY };
                    }
                }
            }
            Knob::MotorDelay | Knob::CommandDelay => self.put(files, -value),
            _ if value != 0.0 => self.put(files, 1.0 / value),
            _ => {}
        }
    }

    fn of_model(self, model: &mut Model, value: f64) {
        let users: Vec<usize> = model.axes.iter().map(|a| a.user).collect();
        let feedbacks: Vec<usize> = model.axes.iter().map(|a| a.feedback).collect();
        let moved: Vec<usize> = model.inputs.iter().filter(|i| i.kind == InputKind::Motion).map(|i| i.on).collect();
        match self {
            Knob::Masses => model.bodies.iter_mut().for_each(|b| b.inertia *= value),
            Knob::HeldMass => {
                for user in users {
                    if let Some(body) = model.bodies.get_mut(user) {
                        body.inertia *= value;
                    }
                }
            }
            Knob::Forces => model.elements.iter_mut().for_each(|e| e.law = e.law.scaled(value)),
            Knob::Servo => {
                let of_servo = |between: &[Option<usize>; 2]| between.iter().flatten().any(|body| moved.contains(body));
                model.elements.iter_mut().filter(|e| of_servo(&e.between)).for_each(|e| e.law = e.law.scaled(value));
            }
            Knob::Motor | Knob::Command => {
                for input in feedbacks {
                    if let Some(input) = model.inputs.get_mut(input) {
                        input.gain *= value;
                    }
                }
            }
            Knob::MotorLag | Knob::CommandLag if value > 0.0 => {
                for input in feedbacks {
                    if let Some(input) = model.inputs.get_mut(input) {
                        // Of two lags in series the time constants add up to first order.
                        let own = if input.bandwidth.is_finite() { 1.0 / (TAU * input.bandwidth) } else { 0.0 };
                        input.bandwidth = 1.0 / (TAU * (own + value));
                    }
                }
            }
            Knob::MotorDelay | Knob::CommandDelay => {
                for input in feedbacks {
                    if let Some(input) = model.inputs.get_mut(input) {
                        input.delay += value;
                    }
                }
            }
            Knob::Sensor => {
                let measured: Vec<usize> = model.axes.iter().map(|a| a.measured).collect();
                for output in measured {
                    if let Some(output) = model.outputs.get_mut(output) {
                        output.gain *= value;
                    }
                }
            }
            Knob::Grip | Knob::GripSprings | Knob::GripDampers | Knob::Wall | Knob::MotorLag | Knob::CommandLag => {}
        }
    }

    /// What it is as a cause.
    pub fn cause(self, value: f64) -> CauseKind {
        match self {
            Knob::Grip | Knob::GripSprings | Knob::GripDampers => CauseKind::Grip,
            Knob::Masses | Knob::HeldMass => CauseKind::Inertia,
            Knob::Motor | Knob::Sensor | Knob::Command if value < 0.0 => CauseKind::WrongSign,
            Knob::Motor | Knob::Forces => CauseKind::TorqueConstant,
            Knob::MotorLag | Knob::CommandLag => CauseKind::FilterLag,
            Knob::MotorDelay | Knob::CommandDelay => CauseKind::Delay,
            Knob::Sensor | Knob::Command => CauseKind::ScaledSensor,
            Knob::Servo => CauseKind::Servo,
            Knob::Wall => CauseKind::Environment,
        }
    }

    /// What is what, in words: `a factor of 1.6 on the force of the motor`.
    pub fn words(self, value: f64) -> String {
        match self {
            Knob::Grip => format!("the hand grips {value:.3} times as firmly as the grip in the graph"),
            Knob::GripSprings => format!("the grip is {value:.3} times as stiff as in the graph"),
            Knob::GripDampers => format!("the grip damps {value:.3} times as much as in the graph"),
            Knob::Masses => format!("its masses are {value:.3} times those of its model"),
            Knob::HeldMass => format!("the mass at its handle or tip is {value:.3} times that of its model"),
            Knob::Motor if value < 0.0 => format!("its motor pushes {value:.3} times what is commanded: its sign is wrong"),
            Knob::Motor => {
                format!("its motor pushes {value:.3} times what is commanded: one factor on all its forces, a wrong torque constant")
            }
            Knob::Forces => {
                format!("all its own forces are {value:.3} times those of its model: a wrong torque constant when they were measured")
            }
            Knob::MotorLag => format!("its motor lags its command by a low-pass of {:.1} Hz", 1.0 / (TAU * value.max(1e-9))),
            Knob::MotorDelay => format!("its motor acts {:.2} ms after its command", 1e3 * value),
            Knob::Sensor if value < 0.0 => format!("its measured position is {value:.3} times its motion: the sign of its sensor is wrong"),
            Knob::Sensor => format!("its measured position is {value:.3} times its motion"),
            Knob::Servo => format!(
                "its servo is {value:.3} times as strong as in its model: stiffness and damping together, as by a wrong torque constant"
            ),
            Knob::Command if value < 0.0 => format!("it moves {value:.3} times its command: a sign is wrong"),
            Knob::Command => format!("it moves {value:.3} times its command"),
            Knob::CommandLag => format!("it follows its command behind a low-pass of {:.1} Hz", 1.0 / (TAU * value.max(1e-9))),
            Knob::CommandDelay => format!("it follows its command {:.2} ms later than its model", 1e3 * value),
            Knob::Wall => format!("what it touches is {value:.3} times as stiff as in the graph"),
        }
    }

    /// What would put it right.
    pub fn repair(self, node: &str) -> String {
        match self {
            Knob::Grip | Knob::GripSprings | Knob::GripDampers => "hold the handle as the graph states".to_string(),
            Knob::Masses | Knob::HeldMass => format!("give {node} the masses of its model"),
            Knob::Motor | Knob::Forces => format!("correct the torque constant of {node}'s motor"),
            Knob::MotorLag => format!("remove the low-pass before {node}'s motor"),
            Knob::MotorDelay => format!("remove the delay before {node}'s motor"),
            Knob::Sensor => format!("correct the scale and the sign of {node}'s position sensor"),
            Knob::Servo => format!("set {node}'s servo as its model states"),
            Knob::Command => format!("correct the scale and the sign of {node}'s command"),
            Knob::CommandLag => format!("remove the low-pass before {node}'s servo"),
            Knob::CommandDelay => format!("remove the delay before {node}'s servo"),
            Knob::Wall => "touch what the graph states".to_string(),
        }
    }

    /// The hand and what the slave touches are not for the user to repair.
    pub fn can_be_repaired(self) -> bool {
        !matches!(self, Knob::Grip | Knob::GripSprings | Knob::GripDampers | Knob::Wall)
    }
}
