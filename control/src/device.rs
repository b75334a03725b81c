//! A simulated device: a model with what is attached to it, stepped at the graph's rate, seen through its axes.

use crate::observer::DesignError;
use backdrive_msgs::MAX_AXES;
use backdrive_plant::elements::Role;
use backdrive_plant::model::{Axis, Fragment, InputKind, Model};
use backdrive_plant::stepper::{CompileError, Options, Plant, Segment};

/// Why a model cannot be a device of a graph.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// The model has no `[[axes]]`.
    #[error("model \"{0}\" has no [[axes]]: a graph needs to know where it is held, pushed and read")]
    NoAxes(String),
    /// A hand is to be estimated where none holds the model.
    #[error("model \"{0}\": it has no grip whose stiffness could be estimated; give the canceller a grip, or omit hand = \"estimated\"")]
    NoHand(String),
    /// A hand cannot change its grip where it is not one of springs and dampers.
    #[error("model \"{0}\": grip_changes need a grip of springs and dampers that holds it; name one such as plant/grips/normal.toml")]
    NoSpringyHand(String),
    /// More axes than a sample carries.
    #[error("model \"{0}\" has {1} axes; at most 8 are possible")]
    TooManyAxes(String, usize),
    /// An input that no axis feeds.
    #[error("model \"{model}\": nothing drives the input \"{input}\" in a graph; name it as an axis' feedback")]
    UndrivenInput {
        /// The model.
        model: String,
        /// The input.
        input: String,
    },
    /// What a node's controller knows or needs is not there.
    #[error(transparent)]
    Controller(#[from] crate::controller::ControllerError),
    /// A force input is needed and a motion input is there, or vice versa.
    #[error("model \"{model}\", axis \"{axis}\": as a {role} its feedback must be a {needed} input")]
    WrongFeedback {
        /// The model.
        model: String,
        /// The axis.
        axis: String,
        /// `master` or `slave`.
        role: &'static str,
        /// `force` or `motion`.
        needed: &'static str,
    },
    /// An input or output that a shaft needs.
    #[error(
        "model \"{model}\" has no input or output \"{signal}\"; a shaft has the torques engine_torque and dyno_torque as inputs, and engine_speed, dyno_speed and shaft_torque as outputs"
    )]
    NoSignal {
        /// The model.
        model: String,
        /// What is not there.
        signal: String,
    },
    /// The gains of an observer cannot be found.
    #[error("model \"{0}\": {1}")]
    Observer(String, DesignError),
    /// The network cannot be stepped.
    #[error("model \"{0}\": {1}")]
    Compile(String, CompileError),
}

/// What an axis of a device is, in indices of the compiled network.
#[derive(Debug, Clone)]
struct Bound {
    feedback: usize,
    measured: usize,
    user: usize,
    hand: Option<usize>,
    /// Elements of the fragment that end on the user's body, and +1 where that is their first end.
    port_forces: Vec<(usize, f64)>,
    /// Elements of the model that are its environment.
    touches: Vec<usize>,
    scale: f64,
}

/// A compiled device.
#[derive(Clone)]
pub struct Device {
    model: Model,
    plant: Plant,
    axes: Vec<Bound>,
    segments: Vec<Segment>,
    outputs: Vec<f64>,
    previous: Vec<f64>,
    period_s: f64,
}

/// Which side of the loop a device is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeviceRole {
    /// Its feedback is a force.
    Master,
    /// Its feedback is a commanded motion, or a force that a controller commands; of all its axes the same.
    Slave,
}

/// How a device is simulated.
#[derive(Debug, Clone, Default)]
pub struct DeviceOptions {
    /// Substeps per period; chosen from the model where `None`.
    pub substeps: Option<usize>,
    /// Seed of the sensors' noise; no noise where `None`.
    pub noise_seed: Option<u64>,
    /// Whether sensors round to their resolution.
    pub quantise: bool,
}

impl Device {
    /// Attaches `fragment` (a grip, an environment) to the user's body of every axis and compiles.
    pub fn new(
        model: &Model,
        fragment: Option<&Fragment>,
        role: DeviceRole,
        period_s: f64,
        options: &DeviceOptions,
    ) -> Result<Device, DeviceError> {
        let mut model = model.clone();
        let name = model.name.clone();
        if model.axes.is_empty() {
            return Err(DeviceError::NoAxes(name));
        }
        if model.axes.len() > MAX_AXES {
            return Err(DeviceError::TooManyAxes(name, model.axes.len()));
        }
        let mut axes = Vec::new();
        // A model that holds its user may have the hand as a motion input: it is the intent of the axis.
        let own_hands = model.own_hands();
        for (index, axis) in model.axes.clone().iter().enumerate() {
            let kind = model.inputs[axis.feedback].kind;
            let (role_name, needed, fits) = match role {
                DeviceRole::Master => ("master", "force", kind == InputKind::Force),
                DeviceRole::Slave => match model.inputs[model.axes[0].feedback].kind {
                    InputKind::Motion => ("slave that follows commands", "motion", kind == InputKind::Motion),
                    InputKind::Force => ("slave that is driven by forces", "force", kind == InputKind::Force),
                },
            };
            if !fits {
                return Err(DeviceError::WrongFeedback { model: name, axis: axis.name.clone(), role: role_name, needed });
            }
            axes.push(attach(&mut model, axis, index, fragment));
        }
        for (axis, hand) in own_hands {
            axes[axis].hand = Some(hand);
        }
        for (index, input) in model.inputs.iter().enumerate() {
            if !axes.iter().any(|a| a.feedback == index || a.hand == Some(index)) {
                return Err(DeviceError::UndrivenInput { model: name, input: input.name.clone() });
            }
        }
        // A negative delay is the time by which the recordings had a motion too late; in a loop a motion is known when it happens.
        for input in model.inputs.iter_mut().filter(|i| i.kind == InputKind::Motion) {
            input.delay = input.delay.max(0.0);
        }
        let options = Options { substeps: options.substeps, add_noise: options.noise_seed, quantise: options.quantise };
        let plant = Plant::new(&model, period_s, &options).map_err(|e| DeviceError::Compile(name, e))?;
        let (inputs, outputs) = (model.inputs.len(), model.outputs.len());
        Ok(Device {
            model,
            plant,
            axes,
            segments: vec![Segment::held(0.0); inputs],
            outputs: vec![0.0; outputs],
            previous: vec![0.0; inputs],
            period_s,
        })
    }

    /// The network as compiled, with what was attached.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Counts energies from the next start on: [`Plant::track_energy`].
    pub fn track_energy(&mut self) {
        self.plant.track_energy();
    }

    /// Whether its feedback is a force.
    pub fn is_driven_by_force(&self) -> bool {
        self.axes.first().is_some_and(|axis| self.model.inputs[axis.feedback].kind == InputKind::Force)
    }

    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.axes.len()
    }

    /// The axis as the model file describes it.
    pub fn axis(&self, axis: usize) -> &Axis {
        &self.model.axes[axis]
    }

    /// The compiled network.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Whether the axis has a hand whose motion is the operator's intent.
    pub fn has_hand(&self, axis: usize) -> bool {
        self.axes[axis].hand.is_some()
    }

    /// Starts at rest, with the feedback (force, or commanded motion at the tip) and the hand of each axis where they are given.
    pub fn start(&mut self, feedback: &[f64], hand: &[f64]) {
        for (index, axis) in self.axes.iter().enumerate() {
            self.previous[axis.feedback] = feedback.get(index).copied().unwrap_or(0.0);
            if let Some(input) = axis.hand {
                self.previous[input] = hand.get(index).copied().unwrap_or(0.0);
            }
        }
        let first = self.previous.clone();
        self.plant.start_at(&first);
        self.plant.outputs(&mut self.outputs);
    }

    /// Advances by one period: every force is held at `force`, every motion runs in a straight line to its new value.
    /// `feedback` is what the feedback input carries (a force: held over the period that ends now; a motion: reached now).
    pub fn step(&mut self, feedback: &[f64], hand: &[f64]) {
        for (index, axis) in self.axes.iter().enumerate() {
            let value = feedback.get(index).copied().unwrap_or(0.0);
            self.segments[axis.feedback] = match self.model.inputs[axis.feedback].kind {
                InputKind::Force => Segment::held(value),
                InputKind::Motion => Segment::line(self.previous[axis.feedback], value, self.period_s),
            };
            self.previous[axis.feedback] = value;
            if let Some(input) = axis.hand {
                let value = hand.get(index).copied().unwrap_or(0.0);
                self.segments[input] = Segment::line(self.previous[input], value, self.period_s);
                self.previous[input] = value;
            }
        }
        self.plant.step(&self.segments);
        self.plant.outputs(&mut self.outputs);
    }

    /// Measured position of an axis at the tip, m or rad.
    pub fn measured(&self, axis: usize) -> f64 {
        let axis = &self.axes[axis];
        axis.scale * self.outputs[axis.measured]
    }

    /// Position of the user's body (of a slave: of its tip), m or rad. Simulation knows it; a sensor may not.
    pub fn user_position(&self, axis: usize) -> f64 {
        self.plant.position(self.axes[axis].user)
    }

    /// Velocity of the user's body, m/s or rad/s.
    pub fn user_velocity(&self, axis: usize) -> f64 {
        self.plant.velocity(self.axes[axis].user)
    }

    /// Force that the attached grip or environment exerts on the user's body, N or N m, positive along +x.
    pub fn port_force(&self, axis: usize) -> f64 {
        let axis = &self.axes[axis];
        let attached: f64 = axis.port_forces.iter().map(|(element, sign)| -sign * self.plant.element_force(*element)).sum();
        attached + axis.touches.iter().map(|element| self.plant.force_on(*element, axis.user)).sum::<f64>()
    }

    /// Elements of the network whose force on an axis' user's body is that of the attached grip or environment.
    pub fn touching(&self, axis: usize) -> Vec<usize> {
        let axis = &self.axes[axis];
        axis.port_forces.iter().map(|(element, _)| *element).chain(axis.touches.iter().copied()).collect()
    }

    /// Displacement across an element of the network, m or rad; not a number where there is none.
    pub fn across(&self, element: usize) -> f64 {
        let at = |place: Option<usize>| place.map_or(0.0, |body| self.plant.position(body));
        self.model.elements.get(element).map_or(f64::NAN, |element| at(element.between[0]) - at(element.between[1]))
    }

    /// Energy of the springs of the attached grip in its initial state, J, on an axis whose hand is `stretch` (m or rad) from the user's body.
    pub(crate) fn spring_energy(&self, axis: usize, stretch: f64) -> f64 {
        let stiffness = |element: usize| match self.model.elements[element].law.role() {
            Role::Linear(linear) => linear.stiffness,
            _ => 0.0,
        };
        0.5 * stretch * stretch * self.axes[axis].port_forces.iter().map(|(element, _)| stiffness(*element)).sum::<f64>()
    }

    /// Puts the hand of an axis at another position, without a motion between the two.
    pub(crate) fn move_hand(&mut self, axis: usize, position: f64) {
        if let Some(input) = self.axes[axis].hand {
            self.previous[input] = position;
        }
    }

    /// See [`Plant::exchange_laws`].
    pub(crate) fn exchange_laws(&mut self, other: &mut Plant) {
        self.plant.exchange_laws(other);
    }

    /// Whether the state is finite.
    pub fn is_finite(&self) -> bool {
        self.plant.is_finite()
    }
}

fn attach(model: &mut Model, axis: &Axis, index: usize, fragment: Option<&Fragment>) -> Bound {
    let mut bound = Bound {
        feedback: axis.feedback,
        measured: axis.measured,
        user: axis.user,
        hand: None,
        port_forces: Vec::new(),
        touches: axis.touches.clone(),
        scale: axis.scale,
    };
    // A model whose user is part of it (a fitted second-order master) takes no grip.
    if let Some(fragment) = fragment.filter(|_| !axis.holds_user) {
        let several = model.axes.len() > 1;
        let prefix = if several { format!("{}{}", fragment.network.name, index) } else { fragment.network.name.clone() };
        let attached = model.attach(fragment, axis.user, &prefix);
        bound.hand = attached.hand_input;
        for element in attached.elements {
            let between = model.elements[element].between;
            for (end, sign) in [(0, 1.0), (1, -1.0)] {
                if between[end] == Some(axis.user) {
                    bound.port_forces.push((element, sign));
                }
            }
        }
    }
    bound
}
