//! Elements of the nominal model that the regression has no terms for: their torque along the measured motion, with the parameters that the file states.
//!
//! A law of the path alone, with any memory, needs no fit: the stepper moves a body along the motion, and the torque for that is the element's torque.

use crate::arms::motion::Motion;
use backdrive_plant::elements::Law;
use backdrive_plant::model::{Body, Element, Hold, Input, InputKind, Model, Motion as Kind, Output, OutputKind};
use backdrive_plant::stepper::{Options, simulate};
use std::path::Path;

/// An element whose torque is computed along the motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Stated {
    /// Its name in the model.
    pub name: String,
    /// The joints at its ends, each with the sign of its displacement in the element's.
    pub ends: Vec<(usize, f64)>,
    /// Its law.
    pub law: Law,
}

/// An element whose torque is not taken into account.
#[derive(Debug, Clone, PartialEq)]
pub struct Unused {
    /// Its name in the model.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// Why.
    pub why: String,
}

impl Unused {
    /// Where it stands: the file, its line where that is found, and the element.
    pub fn place(&self, file: &Path) -> String {
        let quoted = [format!("\"{}\"", self.name), format!("'{}'", self.name)];
        let is_name = |line: &str| line.trim_start().starts_with("name") && quoted.iter().any(|name| line.contains(name.as_str()));
        let line = backdrive_plant::input_file::read_to_string(file).ok().and_then(|text| text.lines().position(is_name));
        let line = line.map_or(String::new(), |line| format!(":{}", line + 1));
        let file = file.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        format!("{file}{line}: element \"{}\"", self.name)
    }
}

/// Its torque at each sample of a motion, before the signs of its ends, N m or N. `pose`: where the positions of the model are 0; `period`: between samples, s.
///
/// # Errors
/// In words, where its law cannot be computed by itself.
pub fn torque(stated: &Stated, motion: &Motion, pose: &[f64], period: f64) -> Result<Vec<f64>, String> {
    if matches!(stated.law, Law::LoadFriction(_) | Law::GearLoss(_)) {
        return Err("its friction depends on a load that is not known between two joints".to_string());
    }
    let at = |i: usize| {
        stated.ends.iter().map(|(joint, sign)| sign * (motion.position[*joint][i] - pose.get(*joint).copied().unwrap_or(0.0))).sum()
    };
    let path: Vec<f64> = (0..motion.len()).map(at).collect();
    let mut model = Model { motion: Kind::Rotation, ..Model::default() };
    model.bodies.push(Body { name: "joint".to_string(), inertia: 0.0 });
    model.elements.push(Element { name: stated.name.clone(), between: [Some(0), None], law: stated.law.clone() });
    model.inputs.push(Input::ideal("motion", InputKind::Motion, 0, Hold::Linear));
    model.outputs.push(Output {
        name: "torque".to_string(),
        kind: OutputKind::Reaction(0),
        gain: 1.0,
        delay: 0.0,
        offset: 0.0,
        resolution: 0.0,
        noise: 0.0,
    });
    let mut found =
        simulate(&model, &[path], period, &Options::default()).map_err(|e| format!("it cannot be simulated separately: {e}"))?;
    let torque = found.pop().unwrap_or_default();
    match torque.len() == motion.len() && torque.iter().all(|x| x.is_finite()) {
        true => Ok(torque),
        false => Err("its torque along the motion is not finite".to_string()),
    }
}
