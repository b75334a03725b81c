//! A device as data: bodies, elements, inputs, outputs, axes.

use crate::effects::site::GROUND;
use crate::laws::Law;
use serde::{Deserialize, Serialize};

/// Index of a body; `None` is ground.
pub type Place = Option<usize>;

/// The description of a device: bodies, what joins them, and the signals that drive it and are read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Network {
    /// The model file that states this.
    pub nominal: Named,
    /// The grip that holds it, where one does.
    pub grip: Option<Named>,
    /// The bodies, in the file's order; hands that hold it come after them.
    pub bodies: Vec<Body>,
    /// What joins them.
    pub elements: Vec<Element>,
    /// What drives it, in the order of [`crate::plant::SealedPlant::step`].
    pub inputs: Vec<Input>,
    /// What is measured, in the order of [`crate::plant::SealedPlant::outputs`].
    pub outputs: Vec<Output>,
    /// Where a graph holds, pushes and reads it.
    pub axes: Vec<Axis>,
}

/// A file by its name and its bytes.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Named {
    /// The short name that it gives itself.
    pub name: String,
    /// SHA-256 of its text, in hexadecimal.
    pub sha256: String,
}

/// A rigid body on one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// kg.
    pub inertia: f64,
}

/// A law of force between two places.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Its name, unique in the network.
    pub name: String,
    /// The two places; the force is positive when the first is ahead.
    pub between: [Place; 2],
    /// The law.
    pub law: Law,
    /// Whether it belongs to the hand that holds the device and not to the device.
    pub of_grip: bool,
}

/// How an input goes on between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// The sample holds until the next one.
    Zero,
    /// Straight from the last sample to this one.
    Linear,
    /// A cubic from the last sample to this one, whose slopes come from samples that were.
    Cubic,
}

/// What an input does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputKind {
    /// A force onto the body, N.
    Force,
    /// The body's position, m: the body moves with the input.
    Motion,
}

/// A signal that drives the device.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// Force or motion.
    pub kind: InputKind,
    /// The body that it acts on.
    pub on: usize,
    /// Between samples.
    pub hold: Hold,
    /// Factor, first of all.
    pub gain: f64,
    /// N, limit of the magnitude, after the gain; infinite when there is none.
    pub saturation: f64,
    /// s, after the limit.
    pub delay: f64,
    /// Hz, first-order lag after the delay; infinite when there is none.
    pub bandwidth: f64,
    /// N per m/s, force lost to the driven body's speed, behind all of these.
    pub back_emf: f64,
}

/// What an output reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputKind {
    /// m.
    Position(usize),
    /// m/s.
    Velocity(usize),
    /// m/s2.
    Acceleration(usize),
    /// N, of these elements together.
    Force(Vec<usize>),
    /// N, what the mover exerts on the body that an input moves.
    Reaction(usize),
}

/// A signal that is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// What it reads.
    pub kind: OutputKind,
    /// Factor, first of all.
    pub gain: f64,
    /// s, after the gain.
    pub delay: f64,
    /// In the output's unit, after the delay.
    pub offset: f64,
    /// In the output's unit, encoder step; 0 when there is none.
    pub resolution: f64,
}

/// Where a graph holds, pushes and reads the device.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// The body that a grip attaches to.
    pub user: usize,
    /// Whether the hand is in the device's own parameters, so that no grip attaches.
    pub holds_user: bool,
    /// Index of the input that moves the hand that holds it, once one does.
    pub hand: Option<usize>,
    /// Index of the input that carries the reflected force.
    pub feedback: usize,
    /// Index of the output that is the measured position.
    pub measured: usize,
    /// Factor from the output to metres at the tip.
    pub scale: f64,
}

impl Network {
    /// Index of the body of this name.
    pub fn body(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
    }

    /// Index of the element of this name.
    pub fn element(&self, name: &str) -> Option<usize> {
        self.elements.iter().position(|element| element.name == name)
    }

    /// Index of the input of this name.
    pub fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|input| input.name == name)
    }

    /// Index of the output of this name.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|output| output.name == name)
    }

    /// The name of a place, `ground` included.
    pub fn place_name(&self, place: Place) -> &str {
        place.and_then(|index| self.bodies.get(index)).map_or(GROUND, |body| body.name.as_str())
    }

    /// The place of this name; `None` where no body has it.
    pub fn place(&self, name: &str) -> Option<Place> {
        if name == GROUND { Some(None) } else { self.body(name).map(Some) }
    }

    /// Whether a motion input moves the body.
    pub fn is_moved(&self, body: usize) -> bool {
        self.inputs.iter().any(|input| input.kind == InputKind::Motion && input.on == body)
    }

    /// The number under a path such as `bodies.drum` or `elements.cable.stiffness`; `None` where there is none that a
    /// nominal model could have wrong ([`Law::number_keys`]).
    pub fn number_mut(&mut self, path: &str) -> Option<&mut f64> {
        if let Some(name) = path.strip_prefix("bodies.") {
            let index = self.body(name)?;
            return Some(&mut self.bodies[index].inertia);
        }
        let (name, key) = path.strip_prefix("elements.")?.rsplit_once('.')?;
        let index = self.element(name)?;
        self.elements[index].law.number_mut(key)
    }

    /// Every path of [`Network::number_mut`] that belongs to the device, not to its grip, and is not 0.
    pub fn number_paths(&self) -> Vec<String> {
        let mut copy = self.clone();
        let bodies = self.bodies.iter().map(|body| format!("bodies.{}", body.name));
        let elements = self
            .elements
            .iter()
            .filter(|element| !element.of_grip)
            .flat_map(|element| element.law.number_keys().iter().map(|key| format!("elements.{}.{key}", element.name)));
        bodies.chain(elements).filter(|path| copy.number_mut(path).is_some_and(|value| *value != 0.0)).collect()
    }
}
