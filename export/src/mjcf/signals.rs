//! Inputs as actuators, outputs as sensors.

use super::attributes::{Integration, ends, is_mjcf};
use super::network::{Constant, Network};
use crate::left_out::{Change, LeftOut, Part};
use crate::names::unlike;
use crate::xml::{escaped, number};
use backdrive_plant::model::{Input, InputKind, Model, OutputKind};
use backdrive_plant::robot::Limits;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Sections of actuators and sensors, and of the tendons that constant forces between two bodies pull at.
#[derive(Debug, Default)]
pub(super) struct Signals {
    pub actuators: String,
    pub sensors: String,
    pub tendons: String,
    pub left_out: Vec<LeftOut>,
}

/// All signals of a model; `joints` are the names of the joints by body, `names` those of actuators that are there already.
pub(super) fn signals(
    model: &Model,
    network: &Network,
    joints: &[String],
    integration: Integration,
    mut names: BTreeSet<String>,
) -> Signals {
    let mut signals = Signals::default();
    for (index, input) in model.inputs.iter().enumerate() {
        names.insert(input.name.clone());
        let joint = joints.get(input.on).map_or("", String::as_str);
        match input.kind {
            InputKind::Force => {
                signals.actuators += &actuator(model, index, input, joint, integration);
            }
            InputKind::Motion => {
                let why = "MuJoCo cannot prescribe a joint's motion";
                let instead = format!("joint \"{joint}\", heavy, whose qpos and qvel the program sets before each step");
                signals.left_out.push(LeftOut::key(Part::Input, &input.name, "motion", why, None).replaced_by(instead));
            }
        }
    }
    signals.motors(model, joints, &mut names);
    for constant in &network.constants {
        signals.constant(constant, joints, &mut names);
    }
    for index in 0..model.outputs.len() {
        signals.sensor(model, index, joints, integration);
    }
    signals
}

/// A force: limit, delay, lag, as ours; the gear is the gain.
fn actuator(model: &Model, index: usize, input: &Input, joint: &str, integration: Integration) -> String {
    let lag = input.bandwidth.is_finite();
    let mut text = format!(
        "    <{} name=\"{}\" joint=\"{}\" gear=\"{}\"",
        if lag { "general" } else { "motor" },
        escaped(&input.name),
        escaped(joint),
        number(input.gain)
    );
    let of_joint = limits_of(model, input.on).and_then(|limits| limits.effort).filter(|effort| *effort > 0.0).unwrap_or(f64::INFINITY);
    let limit = input.saturation.min(force_limit(model, index).unwrap_or(f64::INFINITY)).min(of_joint) / input.gain.abs();
    // Writing to a String cannot fail.
    let _ = match limit.is_finite() {
        true => write!(text, " ctrllimited=\"true\" ctrlrange=\"{} {}\"", number(-limit), number(limit)),
        false => write!(text, " ctrllimited=\"false\""),
    };
    text += " forcelimited=\"false\"";
    if lag {
        let _ = write!(
            text,
            " dyntype=\"filterexact\" dynprm=\"{}\" gaintype=\"fixed\" gainprm=\"1\" biastype=\"none\"",
            number(1.0 / (TAU * input.bandwidth))
        );
    }
    text += &delay(input.delay, integration.step, "zoh");
    text + "/>\n"
}

/// The robot file's limits of a body that is a joint of the robot.
fn limits_of(model: &Model, body: usize) -> Option<Limits> {
    let arm = model.arm.as_ref()?;
    let coordinate = arm.tree.coordinates().get(arm.bodies.iter().position(|b| *b == body)?)?;
    Some(arm.robot.joints.get(coordinate.joint)?.limits)
}

/// The axis's limit of its motor, N or N m.
fn force_limit(model: &Model, input: usize) -> Option<f64> {
    model.axes.iter().filter(|axis| axis.feedback == input).find_map(|axis| axis.force)
}

/// Attributes of a delay; of one that is no whole number of steps it is the straight line between samples.
pub(super) fn delay(delay: f64, step: f64, whole: &str) -> String {
    if delay <= 0.0 {
        return String::new();
    }
    let steps = delay / step;
    let is_whole = (steps - steps.round()).abs() < 1e-6;
    let samples = if is_whole { steps.round() } else { steps.ceil() };
    let way = if is_whole { whole } else { "linear" };
    format!(" nsample=\"{samples}\" interp=\"{way}\" delay=\"{}\"", number(delay))
}

impl Signals {
    /// A motor on every joint of a robot, where the model itself has none at all and the robot's own file, as a URDF, cannot have any. A joint without effort
    /// has no motor. Where the model has inputs, a joint without one is passive.
    fn motors(&mut self, model: &Model, joints: &[String], names: &mut BTreeSet<String>) {
        let Some(arm) = model.arm.as_ref().filter(|arm| !is_mjcf(arm)) else { return };
        if model.inputs.iter().any(|input| input.kind == InputKind::Force) {
            return;
        }
        for body in arm.bodies.iter().filter(|body| !model.inputs.iter().any(|input| input.on == **body)) {
            let effort = limits_of(model, *body).and_then(|limits| limits.effort);
            let Some(joint) = joints.get(*body).filter(|_| effort != Some(0.0)) else { continue };
            let limits = match effort.filter(|effort| effort.is_finite()) {
                Some(effort) => {
                    let range = format!("\"{} {}\"", number(-effort), number(effort));
                    format!(" ctrllimited=\"true\" ctrlrange={range} forcelimited=\"true\" forcerange={range}")
                }
                None => " ctrllimited=\"false\" forcelimited=\"false\"".to_owned(),
            };
            let name = escaped(&unlike(joint.clone(), names));
            self.actuators += &format!("    <motor name=\"{name}\" joint=\"{}\" gear=\"1\"{limits}/>\n", escaped(joint));
        }
    }

    /// An actuator that pushes without a command.
    fn constant(&mut self, constant: &Constant, joints: &[String], names: &mut BTreeSet<String>) {
        let name = escaped(&unlike(constant.name.clone(), names));
        let (on, force) = match constant.ends.as_slice() {
            &[(body, sign)] => (format!("joint=\"{}\"", escaped(joints.get(body).map_or("", String::as_str))), sign * constant.force),
            both => {
                let tendon = escaped(&constant.name);
                self.tendons += &format!("    <fixed name=\"{tendon}\">{}</fixed>\n", ends(both, joints));
                (format!("tendon=\"{tendon}\""), constant.force)
            }
        };
        self.actuators += &format!(
            "    <!-- a constant force, whatever its command -->\n    <general name=\"{name}\" {on} gear=\"1\" ctrllimited=\"false\" forcelimited=\"false\" dyntype=\"none\" \
             gaintype=\"fixed\" gainprm=\"0\" biastype=\"affine\" biasprm=\"{} 0 0\"/>\n",
            number(force)
        );
    }

    fn sensor(&mut self, model: &Model, index: usize, joints: &[String], integration: Integration) {
        let Some(output) = model.outputs.get(index) else { return };
        let mut leave = |key: &str, why: &str, change: Option<Change>| {
            self.left_out.push(LeftOut::key(Part::Output, &output.name, key, why, change));
        };
        let (tag, body) = match &output.kind {
            OutputKind::Position(body) => ("jointpos", *body),
            OutputKind::Velocity(body) => ("jointvel", *body),
            OutputKind::Acceleration(_) => {
                leave("acceleration", "MuJoCo has no sensor of a joint's acceleration; mjData.qacc has it", None);
                return;
            }
            OutputKind::Force(_) => {
                leave(
                    "force",
                    "MuJoCo has no sensor of one spring's, damper's or friction's force; mjData.qfrc_passive has their sum",
                    None,
                );
                return;
            }
            OutputKind::Reaction(_) => {
                leave("reaction", "MuJoCo has no force of a prescribed motion; inverse dynamics (mj_inverse) gives it", None);
                return;
            }
        };
        let more = "MuJoCo's sensors have noise and delay alone: the program has to add it";
        if output.gain != 1.0 {
            leave("gain", more, Some(Change::NoGain(index)));
        }
        if output.offset != 0.0 {
            leave("offset", more, Some(Change::NoOffset(index)));
        }
        if output.resolution != 0.0 {
            leave("resolution", more, None);
        }
        let joint = joints.get(body).map_or("", String::as_str);
        let mut text = format!("    <{tag} name=\"{}\" joint=\"{}\"", escaped(&output.name), escaped(joint));
        if output.noise > 0.0 {
            let _ = write!(text, " noise=\"{}\"", number(output.noise));
        }
        text += &delay(output.delay, integration.step, "linear");
        self.sensors += &text;
        self.sensors += "/>\n";
    }
}
