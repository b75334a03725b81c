//! A model in motion: compiles a [`Model`] to a stepper that advances by one sample period at a time.
//!
//! - Springs, dampers, inerters and biases are constant matrices, factored once. Over a substep h the
//!   velocity changes by `2 δ`, `(2M/h + D + θ h K/2) δ = F - K (x + h v/2) - D v`, and the position by the mean
//!   velocity. θ = 1 is the implicit midpoint rule. θ = 1/3 gives every undamped mode its frequency to fourth
//!   order and is taken where the substep resolves the fastest one.
//! - A model of such elements alone is advanced by its exact propagator instead (`exact.rs`).
//! - Dry friction is a box-constrained multiplier on the velocity at the end of the substep (Moreau 1988, Jean 1999),
//!   solved for all contacts at once: what sticks has velocity 0, not a small one (`constraints.rs`).
//! - Hysteresis is advanced along its path by the kind's own update. An element that is too stiff for the substep
//!   joins the friction contacts in their implicit solution.

mod advance;
mod ahead;
mod compile;
mod constraints;
mod dense;
mod drive;
mod endpoint;
mod energy;
mod exact;
mod sense;
mod simulate;
mod spline;

pub use ahead::ahead;
pub use energy::Energy;
pub use simulate::simulate;
pub use spline::segments;

use crate::elements::{FrictionLevels, Law};
use crate::model::Model;
use compile::Compiled;
use constraints::Work;
use drive::Drive;
use endpoint::Endpoint;
use sense::Sense;

/// Bodies, at most.
pub const MAX_BODIES: usize = 15;
/// Elements, at most.
pub const MAX_ELEMENTS: usize = 64;

/// Places in the state arrays: free bodies from the first on, ground last, those on motion inputs before it, downwards.
const SLOTS: usize = MAX_BODIES + 1;
const GROUND: usize = SLOTS - 1;
/// Evaluations of a law that a substep takes where it is solved implicitly, beyond one.
const IMPLICIT: usize = 6;

/// Place of the p-th body on a motion input.
const fn prescribed_slot(p: usize) -> usize {
    GROUND - 1 - p
}

type Slots = [f64; SLOTS];

/// How a model is to be stepped.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options {
    /// Substeps in each period; `None` chooses them from the model.
    pub substeps: Option<usize>,
    /// Seed of the noise that outputs add; `None` adds none.
    pub add_noise: Option<u64>,
    /// Whether outputs are rounded to their resolution.
    pub quantise: bool,
}

/// An input over one period: `c0 + c1 s + c2 s² + c3 s³`, s the time since the sample, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Segment {
    /// Rising powers of s.
    pub c: [f64; 4],
}

impl Segment {
    /// The same value throughout.
    pub fn held(value: f64) -> Segment {
        Segment { c: [value, 0.0, 0.0, 0.0] }
    }

    /// A straight line that takes `period` seconds.
    pub fn line(from: f64, to: f64, period: f64) -> Segment {
        Segment { c: [from, (to - from) / period, 0.0, 0.0] }
    }

    /// Value at `s`.
    #[inline]
    pub fn value(&self, s: f64) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        c0 + s * (c1 + s * (c2 + s * c3))
    }

    /// Rate of change at `s`.
    #[inline]
    pub fn slope(&self, s: f64) -> f64 {
        let [_, c1, c2, c3] = self.c;
        c1 + s * (2.0 * c2 + s * 3.0 * c3)
    }

    /// Second derivative at `s`.
    #[inline]
    pub fn curvature(&self, s: f64) -> f64 {
        2.0 * self.c[2] + 6.0 * self.c[3] * s
    }
}

/// Why a model cannot be stepped.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// The sample period is no period.
    #[error("the sample period must be above 0 s, not {0}")]
    Period(f64),
    /// Substeps were asked for, but none.
    #[error("the number of substeps must be from 1 to 100000, not {0}")]
    Substeps(usize),
    /// Nothing resists the body's acceleration.
    #[error("body `{0}` moves freely but has no inertia; give it one, an inerter, or a motion input")]
    Massless(String),
    /// A number that is none, or is out of its range.
    #[error("{place}: {key} must be {expected}, not {value}")]
    Number {
        /// Such as "body `drum`".
        place: String,
        /// The key.
        key: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        value: f64,
    },
    /// A number of an element that is out of range or does not go with another.
    #[error("element `{element}`: {reason}")]
    Element {
        /// The element.
        element: String,
        /// One sentence.
        reason: String,
    },
    /// A place, an element or an input that the model does not have.
    #[error("{0} names something that the model does not have")]
    Dangling(String),
    /// Two motion inputs on one body.
    #[error("inputs `{first}` and `{second}` both prescribe the motion of body `{body}`")]
    MovedTwice {
        /// The body.
        body: String,
        /// An input.
        first: String,
        /// Another.
        second: String,
    },
    /// A reaction is only there where a motion input is.
    #[error("output `{output}` reads the reaction of body `{body}`, which has no motion input")]
    NoReaction {
        /// The output.
        output: String,
        /// The body.
        body: String,
    },
    /// Nothing determines the motion.
    #[error("the equations of motion are singular; a negative stiffness or damping is too large")]
    Singular,
    /// A column of samples is missing.
    #[error("there are no samples for input `{0}`")]
    MissingInput(String),
    /// More than the stepper holds.
    #[error("{count} {what}; at most {limit} are possible")]
    TooMany {
        /// Such as "bodies".
        what: &'static str,
        /// How many.
        count: usize,
        /// How many are possible.
        limit: usize,
    },
}

/// Dry friction at work.
#[derive(Debug, Clone)]
struct FrictionContact {
    first: usize,
    second: usize,
    levels: FrictionLevels,
    /// 0 while it sticks, else the direction in which it slides.
    mode: i8,
    /// Multiplier over the last substep, N.
    force: f64,
    /// Relative velocity before the last substep, m/s.
    velocity_before: f64,
}

/// An element with a force of its own at work.
#[derive(Debug, Clone)]
struct PathElement {
    first: usize,
    second: usize,
    law: Law,
    memory: Vec<f64>,
    /// Where the trial of an implicit solution puts the memory.
    trial: Vec<f64>,
    /// Displacement up to which the memory has come, m.
    reached: f64,
    /// Force at the middle of the last substep, N.
    force: f64,
    /// Relative velocity before the last substep, m/s.
    velocity_before: f64,
    /// Index among the constraints when it is solved implicitly.
    constraint: Option<usize>,
    /// How far ahead of the start of a substep its force is then taken, s.
    ahead: f64,
    /// Whether that is the end of the substep, because it is too stiff for more.
    unresolved: bool,
    /// What its force took out of the bodies so far, J.
    absorbed: f64,
}

/// A model at work. A clone goes on from the same state.
#[derive(Debug, Clone)]
pub struct Plant {
    fixed: Compiled,
    period: f64,
    substep: f64,
    substeps: usize,
    periods: u64,
    x: Slots,
    v: Slots,
    /// Acceleration of prescribed bodies at this instant, m/s².
    prescribed_acceleration: Slots,
    /// Force inputs on each place at the end of the last substep, N.
    pushed: Slots,
    drives: Vec<Drive>,
    frictions: Vec<FrictionContact>,
    paths: Vec<PathElement>,
    work: Box<Work>,
    /// Space for the balance of forces at a sample; always there between calls.
    instant: Option<Box<Endpoint>>,
    sense: Sense,
    energy: Option<energy::Account>,
    exact: Option<exact::Propagator>,
}

impl Plant {
    /// Compiles a model for samples `period_s` seconds apart.
    ///
    /// # Errors
    /// When the model cannot be stepped; the error names what is wrong with it.
    pub fn new(model: &Model, period_s: f64, options: &Options) -> Result<Plant, CompileError> {
        compile::plant(model, period_s, options)
    }

    /// At rest: every position, velocity and memory is zero, and motion inputs are at 0.
    pub fn reset(&mut self) {
        self.start_at(&[]);
    }

    /// At rest, with the bodies on motion inputs where these put them first. `first` holds the first value of each
    /// input in the order of the model (m; those of force inputs are not used); what is missing is 0.
    pub fn start_at(&mut self, first: &[f64]) {
        self.periods = 0;
        self.x = [0.0; SLOTS];
        self.v = [0.0; SLOTS];
        self.prescribed_acceleration = [0.0; SLOTS];
        self.pushed = [0.0; SLOTS];
        for (index, drive) in self.drives.iter_mut().enumerate() {
            drive.reset();
            if drive.moves {
                self.x[drive.slot] = drive.gain * first.get(index).copied().unwrap_or(0.0) + drive.offset;
            }
        }
        for contact in &mut self.frictions {
            contact.mode = 0;
            contact.force = 0.0;
            contact.velocity_before = 0.0;
        }
        for path in &mut self.paths {
            path.memory.fill(0.0);
            path.reached = self.x[path.first] - self.x[path.second];
            path.force = 0.0;
            path.velocity_before = 0.0;
            path.absorbed = 0.0;
        }
        self.restart_energy();
        self.restart_sense();
    }

    /// Sets a free body moving, with the elements' memories as they are; a body on a motion input, or one that is not there, is left
    /// alone. Meant for the start of a record that did not begin at rest. Position in m, velocity in m/s.
    pub fn set_motion(&mut self, body: usize, position: f64, velocity: f64) {
        let Some(slot) = self.fixed.slots.get(body).copied().filter(|slot| *slot < self.fixed.free) else { return };
        self.x[slot] = position;
        self.v[slot] = velocity;
        for path in self.paths.iter_mut().filter(|path| path.first == slot || path.second == slot) {
            path.reached = self.x[path.first] - self.x[path.second];
        }
        self.restart_energy();
        self.restart_sense();
    }

    /// Advances by one period. `inputs` are in the order of the model; a missing one stays at 0.
    pub fn step(&mut self, inputs: &[Segment]) {
        for (index, drive) in self.drives.iter_mut().enumerate() {
            drive.push(inputs.get(index).copied().unwrap_or_default());
        }
        if self.exact.is_some() && self.energy.is_none() {
            self.step_exactly();
        } else {
            self.step_by_substeps();
        }
        self.periods += 1;
    }

    /// Position of a body of the model, m; not a number when there is no such body.
    pub fn position(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.x[*slot])
    }

    /// Velocity of a body of the model, m/s; not a number when there is no such body.
    pub fn velocity(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.v[*slot])
    }

    /// Acceleration of a body of the model under the forces of the period that has just ended, m/s².
    pub fn acceleration(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.endpoint().acceleration[*slot])
    }

    /// Force of an element of the model, N, positive when it is stretched.
    pub fn element_force(&self, element: usize) -> f64 {
        self.force_at(element, &self.endpoint())
    }

    /// Force that the mover exerts on a body with a motion input, N, that body's own inertia included;
    /// 0 for a free body.
    pub fn reaction(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.reaction_at(*slot, &self.endpoint()))
    }

    /// Time since the start, s.
    pub fn time(&self) -> f64 {
        self.periods as f64 * self.period
    }

    /// Whether every position and velocity is a finite number.
    pub fn is_finite(&self) -> bool {
        self.x.iter().chain(&self.v).all(|q| q.is_finite())
    }

    /// Substeps in each period.
    pub fn substeps(&self) -> usize {
        self.substeps
    }

    /// About how much a step of one period computes, in steps of a linear network: contacts and paths add to each substep, those that are solved
    /// implicitly several evaluations of their law.
    pub fn cost(&self) -> u64 {
        let implicit = self.paths.iter().filter(|p| p.constraint.is_some()).count();
        (self.substeps * (1 + self.frictions.len() + self.paths.len() + IMPLICIT * implicit)) as u64
    }
}
