//! What a target cannot hold, and the model without it.

use backdrive_plant::elements::{Damper, Law};
use backdrive_plant::model::{Model, OutputKind};
use backdrive_plant::robot::{Robot, Tree};
use backdrive_plant::servo::Number;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// What of a model it is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// An element of the network.
    Element,
    /// A body of the network, or a joint.
    Body,
    /// An input.
    Input,
    /// An output.
    Output,
    /// The robot file: links, and what the file holds besides.
    Robot,
}

/// Something of a model that is not in the exported text.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// What it is.
    pub part: Part,
    /// Its name in the model.
    pub name: String,
    /// Kind of an element (`lugre`), key of an input, an output or a body (`delay`).
    pub kind: String,
    /// Why the target cannot hold it; a sentence without its full stop.
    pub why: String,
    /// What stands in its place; `None` where nothing does.
    pub instead: Option<String>,
    /// What makes the model the exported one; empty where its motion and its outputs stay as they are.
    pub changes: Vec<Change>,
}

/// A change to a model, by index.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// An element has this law.
    Law(usize, Law),
    /// An element pushes with nothing.
    NoElement(usize),
    /// A body moves with another: its inertia, what hangs on it and what drives it are the other's, and nothing is between them.
    Join(usize, usize),
    /// A body has this inertia, kg or kg m².
    Inertia(usize, f64),
    /// An input is not limited.
    NoSaturation(usize),
    /// An input acts at once.
    NoDelay(usize),
    /// An input has no lag.
    NoLag(usize),
    /// An output is read without its factor.
    NoGain(usize),
    /// An output is read at once.
    NoOutputDelay(usize),
    /// An output is read without its offset.
    NoOffset(usize),
    /// A link of the robot has this inertia about its centre of mass, kg m².
    LinkInertia(usize, Matrix3<f64>),
    /// Free fall is this, m/s².
    Gravity(Vector3<f64>),
    /// The motors do not hold the weight of the links.
    NotCompensated,
    /// A servo's parameter has the value at which it does nothing.
    NoServo(usize, Number),
    /// A servo's parameter is greater by this.
    MoreServo(usize, Number, f64),
}

impl Change {
    /// Changes the model. What the model does not have is passed over.
    pub fn apply(&self, model: &mut Model) {
        match self {
            Change::Law(element, law) => set(&mut model.elements, *element, |e| e.law = law.clone()),
            // Outputs name elements by index, so it stays and pushes with nothing.
            Change::NoElement(element) => set(&mut model.elements, *element, |e| e.law = Law::Damper(Damper { damping: 0.0 })),
            Change::Join(body, into) => join(model, *body, *into),
            Change::Inertia(body, inertia) => set(&mut model.bodies, *body, |b| b.inertia = *inertia),
            Change::NoSaturation(input) => set(&mut model.inputs, *input, |i| i.saturation = f64::INFINITY),
            Change::NoDelay(input) => set(&mut model.inputs, *input, |i| i.delay = 0.0),
            Change::NoLag(input) => set(&mut model.inputs, *input, |i| i.bandwidth = f64::INFINITY),
            Change::NoGain(output) => set(&mut model.outputs, *output, |o| o.gain = 1.0),
            Change::NoOutputDelay(output) => set(&mut model.outputs, *output, |o| o.delay = 0.0),
            Change::NoOffset(output) => set(&mut model.outputs, *output, |o| o.offset = 0.0),
            Change::LinkInertia(link, about_centre) => of_the_robot(model, |robot| {
                if let Some(inertia) = robot.links.get_mut(*link).and_then(|link| link.inertia.as_mut()) {
                    inertia.about_centre = *about_centre;
                }
            }),
            Change::Gravity(gravity) => of_the_robot(model, |robot| robot.gravity = *gravity),
            Change::NotCompensated => model.arm.iter_mut().for_each(|arm| arm.gravity_compensated = false),
            Change::MoreServo(servo, n, by) => set(&mut model.servos, *servo, |s| s.numbers[*n] += by),
            Change::NoServo(servo, n) => set(&mut model.servos, *servo, |s| s.numbers[*n] = n.facts().nothing),
        }
    }
}

/// A robot that cannot be computed with the change stays unchanged.
fn of_the_robot(model: &mut Model, change: impl FnOnce(&mut Robot)) {
    let Some(arm) = model.arm.as_mut() else { return };
    let mut robot = arm.robot.clone();
    change(&mut robot);
    if let Ok(mut tree) = Tree::new(&robot) {
        (0..tree.len()).for_each(|coordinate| tree.set_armature(coordinate, 0.0));
        (arm.robot, arm.tree) = (robot, tree);
    }
}

fn set<T>(list: &mut [T], index: usize, change: impl FnOnce(&mut T)) {
    if let Some(one) = list.get_mut(index) {
        change(one);
    }
}

/// The body stays in the list, with nothing on it, so that indices stay.
fn join(model: &mut Model, body: usize, into: usize) {
    let Some(inertia) = model.bodies.get(body).map(|b| b.inertia) else { return };
    set(&mut model.bodies, into, |b| b.inertia += inertia);
    let moved = |place: usize| if place == body { into } else { place };
    for element in &mut model.elements {
        element.between = element.between.map(|place| place.map(moved));
        if element.between == [Some(into); 2] {
            (element.between, element.law) = ([Some(into), None], Law::Damper(Damper { damping: 0.0 }));
        }
    }
    model.inputs.iter_mut().for_each(|input| input.on = moved(input.on));
    model.axes.iter_mut().for_each(|axis| axis.user = moved(axis.user));
    for output in &mut model.outputs {
        match &mut output.kind {
            OutputKind::Position(b) | OutputKind::Velocity(b) | OutputKind::Acceleration(b) | OutputKind::Reaction(b) => *b = moved(*b),
            OutputKind::Force(_) => {}
        }
    }
}

/// The exported model: with all changes.
pub fn change_all(model: &Model, left_out: &[LeftOut]) -> Model {
    let mut changed = model.clone();
    left_out.iter().flat_map(|left| &left.changes).for_each(|change| change.apply(&mut changed));
    changed
}

impl LeftOut {
    /// Whether the model moves differently without it. What a robot file has besides its mechanics, such as meshes, does not move.
    pub fn matters(&self) -> bool {
        self.part != Part::Robot || !self.changes.is_empty()
    }

    /// An element of which nothing is left, or another law.
    pub(crate) fn element(model: &Model, index: usize, why: impl Into<String>, instead: Option<(Law, String)>) -> LeftOut {
        let (name, kind) = model.elements.get(index).map_or_else(Default::default, |e| (e.name.clone(), e.law.kind().name.to_owned()));
        let change = instead.as_ref().map_or(Change::NoElement(index), |(law, _)| Change::Law(index, law.clone()));
        LeftOut { part: Part::Element, name, kind, why: why.into(), instead: instead.map(|i| i.1), changes: vec![change] }
    }

    /// A key of an input, an output or a body.
    pub(crate) fn key(part: Part, name: &str, key: &str, why: impl Into<String>, change: Option<Change>) -> LeftOut {
        let changes = change.into_iter().collect();
        LeftOut { part, name: name.to_owned(), kind: key.to_owned(), why: why.into(), instead: None, changes }
    }

    /// The same, with what stands in its place.
    pub(crate) fn replaced_by(self, instead: impl Into<String>) -> LeftOut {
        LeftOut { instead: Some(instead.into()), ..self }
    }
}
