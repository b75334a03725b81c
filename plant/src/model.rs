//! A model as data: the network of bodies and elements that a model file describes.
//!
//! Names are resolved: a place is an index into [`Model::bodies`], and `None` is ground.

use crate::elements::Law;
use crate::robot::Arm;
use crate::servo::ServoJoint;

/// Whether the axes are linear or rotational. The units follow: m, N, kg or rad, N m, kg m².
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Motion {
    /// m, N, kg.
    #[default]
    Translation,
    /// rad, N m, kg m².
    Rotation,
}

/// A place in the network: the index of a body, or `None` for ground.
pub type Place = Option<usize>;

/// A device, a grip or an environment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// Short id.
    pub name: String,
    /// One line for a person; may be empty.
    pub title: String,
    /// Where the numbers come from; may be empty.
    pub source: String,
    /// Linear or rotational.
    pub motion: Motion,
    /// Every body but ground.
    pub bodies: Vec<Body>,
    /// Springs, dampers, friction, hysteresis, contacts.
    pub elements: Vec<Element>,
    /// What drives it.
    pub inputs: Vec<Input>,
    /// What is measured.
    pub outputs: Vec<Output>,
    /// Where a graph holds, pushes and reads it.
    pub axes: Vec<Axis>,
    /// The robot whose joints are bodies of the network; `None` for a device without one.
    pub arm: Option<Box<Arm>>,
    /// Joints that a position servo drives, by name: they are simulated from recorded commands and are no bodies of the network.
    pub servos: Vec<ServoJoint>,
}

impl Model {
    /// Whether a body is a point of a robot's link.
    pub fn is_point(&self, body: usize) -> bool {
        self.arm.as_ref().is_some_and(|arm| arm.is_point(body))
    }
}

/// A body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Unique in the model.
    pub name: String,
    /// kg or kg m², at least 0. It is 0 only where an inerter or a motion input makes that possible, for a joint of a robot, whose links have theirs, and for a
    /// point of one.
    pub inertia: f64,
}

/// An element between two places.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Unique in the model.
    pub name: String,
    /// Its ends. With `x` the displacement of the first less that of the second, the force on the first is `-f`.
    pub between: [Place; 2],
    /// Kind and parameters.
    pub law: Law,
}

/// How an input runs between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// The value of the last sample.
    Zero,
    /// A straight line to the next.
    Linear,
    /// A not-a-knot cubic spline through all samples.
    Cubic,
}

/// What an input does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputKind {
    /// A force onto a body.
    Force,
    /// Prescribes a body's position.
    Motion,
}

impl InputKind {
    /// Unit of what it applies, in a translation; [`crate::describe::unit_for`] gives that of a rotation.
    pub fn unit(self) -> &'static str {
        match self {
            InputKind::Force => "N",
            InputKind::Motion => "m",
        }
    }
}

/// A signal that drives the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name of the signal in a recording.
    pub name: String,
    /// Force or motion.
    pub kind: InputKind,
    /// The driven body.
    pub on: usize,
    /// Between samples.
    pub hold: Hold,
    /// First what the actuation does: `u` becomes `gain * u`.
    pub gain: f64,
    /// Then the limit of its magnitude, N or N m; infinite when there is none.
    pub saturation: f64,
    /// Then a delay, s. For a motion it may be negative: the body was ahead of the recording; see [`crate::stepper::ahead`].
    pub delay: f64,
    /// Then a first-order lag of this corner, Hz; infinite when there is none.
    pub bandwidth: f64,
    /// Force lost in proportion to the driven body's velocity, behind delay and lag, N per m/s.
    pub back_emf: f64,
    /// For a motion, m: where the body is when the recorded value is 0, as with an encoder that counts from where it was switched on.
    pub offset: f64,
}

impl Input {
    /// A signal that reaches its body unchanged: without an actuator's gain, limit, delay or lag.
    pub fn ideal(name: &str, kind: InputKind, on: usize, hold: Hold) -> Input {
        Input {
            name: name.to_owned(),
            kind,
            on,
            hold,
            gain: 1.0,
            saturation: f64::INFINITY,
            delay: 0.0,
            bandwidth: f64::INFINITY,
            back_emf: 0.0,
            offset: 0.0,
        }
    }
}

/// What an output measures.
#[derive(Debug, Clone, PartialEq)]
pub enum OutputKind {
    /// Position of a body.
    Position(usize),
    /// Velocity of a body.
    Velocity(usize),
    /// Acceleration of a body.
    Acceleration(usize),
    /// Sum of the forces of these elements.
    Force(Vec<usize>),
    /// Force that the mover exerts on a prescribed body, that body's own inertia included.
    Reaction(usize),
}

impl OutputKind {
    /// Unit of what it measures in a translation; [`crate::describe::unit_for`] gives that of a rotation.
    pub fn unit(&self) -> &'static str {
        match self {
            OutputKind::Position(_) => "m",
            OutputKind::Velocity(_) => "m/s",
            OutputKind::Acceleration(_) => "m/s²",
            OutputKind::Force(_) | OutputKind::Reaction(_) => "N",
        }
    }
}

/// A signal that a recording is compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name of the signal in a recording.
    pub name: String,
    /// What is measured.
    pub kind: OutputKind,
    /// First what the sensor adds: a factor.
    pub gain: f64,
    /// Then a delay, s.
    pub delay: f64,
    /// Then an offset, in the output's unit.
    pub offset: f64,
    /// Then rounding to this step; 0 when there is none.
    pub resolution: f64,
    /// Standard deviation of added noise, in the output's unit, before rounding; 0 when there is none. Only a node set adds it.
    pub noise: f64,
}

/// One axis of a device in a graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Such as `forward`.
    pub name: String,
    /// The body that a grip or an environment attaches to.
    pub user: usize,
    /// Whether the model already holds the user's hand (a master fitted as held), so that no grip is attached.
    pub holds_user: bool,
    /// Elements of the model that are what the axis touches, where the model has that in it; their force on the user's body is that of the environment. On a
    /// robot's joint it is that of the wall at a point, through the transposed Jacobian.
    pub touches: Vec<usize>,
    /// Index of the input that carries the reflected force (of a slave: the command).
    pub feedback: usize,
    /// Index of the output that is the measured position.
    pub measured: usize,
    /// Metres (or rad) at the tip per unit of the measured output.
    pub scale: f64,
    /// Limits of motion at the tip, m or rad.
    pub travel: Option<[f64; 2]>,
    /// Largest force of the motor, N or N m.
    pub force: Option<f64>,
    /// Largest change of that force, N/s or N m/s.
    pub force_rate: Option<f64>,
    /// Largest speed that may be commanded, m/s or rad/s.
    pub speed: Option<f64>,
}

/// A fragment: a network that attaches to a body of a device, a grip or an environment.
///
/// Its [`Model`] has a first body named `port`, of no inertia, that stands for the body it is attached to.
#[derive(Debug, Clone, PartialEq)]
pub struct Fragment {
    /// Body 0 is the port.
    pub network: Model,
    /// The body whose motion is the operator's intent, if there is one (`hand`).
    pub hand: Option<usize>,
}
