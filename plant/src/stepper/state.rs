//! A model at work: its state, and what can be asked of it.

use super::account::Account;
use super::compiled::{Compiled, Share};
use super::constraints::Work;
use super::contact::FrictionContact;
use super::drive::Drive;
use super::instant::Endpoint;
use super::links::Links;
use super::motion::Motion;
use super::path::PathElement;
use super::propagator::Propagator;
use super::segment::Segment;
use super::sensor::Sense;
use super::slots::{GROUND, SLOTS, Slots};

/// Evaluations of a law that a substep takes where it is solved implicitly, beyond one.
const IMPLICIT: usize = 6;

/// What a costly law adds to a substep, in steps of a linear network.
const COSTLY: usize = 6;

/// What the links of a robot add to a substep, in steps of a linear network, for each pair of coordinates.
const LINKS: usize = 5;

/// Below this a force has no lever on a joint, m or, of a slide, 1.
const NO_LEVER: f64 = 1e-9;

/// The balance of forces at a sample, in steps of a linear network.
const BALANCE: usize = 3;

/// A model at work. A clone goes on from the same state.
#[derive(Debug, Clone)]
pub struct Plant {
    pub(super) fixed: Compiled,
    pub(super) period: f64,
    pub(super) substep: f64,
    pub(super) substeps: usize,
    pub(super) periods: u64,
    pub(super) x: Slots,
    pub(super) v: Slots,
    /// Acceleration of prescribed bodies at this instant, m/s².
    pub(super) prescribed_acceleration: Slots,
    /// Force inputs on each place at the end of the last substep, N.
    pub(super) pushed: Slots,
    pub(super) drives: Vec<Drive>,
    pub(super) frictions: Vec<FrictionContact>,
    pub(super) paths: Vec<PathElement>,
    pub(super) work: Box<Work>,
    /// Space for a substep; always there between substeps.
    pub(super) motion: Option<Box<Motion>>,
    /// Space for the balance of forces at a sample; always there between calls.
    pub(super) instant: Option<Box<Endpoint>>,
    pub(super) sense: Sense,
    pub(super) energy: Option<Account>,
    pub(super) exact: Option<Propagator>,
    pub(super) links: Option<Box<Links>>,
}

impl Plant {
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
            contact.reset();
        }
        self.links_here();
        for path in &mut self.paths {
            path.memory.fill(0.0);
            path.reached = self.x[path.first] - self.x[path.second];
            path.force = 0.0;
            path.velocity_before = 0.0;
            path.rise = 1.0;
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
        self.links_here();
        let points = self.fixed.points.places();
        let moved = |place: usize| place == slot || points.contains(&place);
        for path in self.paths.iter_mut().filter(|path| moved(path.first) || moved(path.second)) {
            path.reached = self.x[path.first] - self.x[path.second];
        }
        self.restart_energy();
        self.restart_sense();
    }

    /// Advances by one period. `inputs` are in the order of the model; a missing one stays at 0.
    pub fn step(&mut self, inputs: &[Segment]) {
        self.take(inputs);
        if self.exact.is_some() && self.energy.is_none() {
            self.step_exactly();
        } else {
            self.step_by_substeps(&mut ());
        }
        self.periods += 1;
    }

    /// The inputs of the period that begins now.
    pub(super) fn take(&mut self, inputs: &[Segment]) {
        for (index, drive) in self.drives.iter_mut().enumerate() {
            drive.push(inputs.get(index).copied().unwrap_or_default());
        }
    }

    /// Position of a body of the model, m; not a number when there is no such body.
    #[inline]
    pub fn position(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.x[*slot])
    }

    /// Velocity of a body of the model, m/s; not a number when there is no such body.
    #[inline]
    pub fn velocity(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.v[*slot])
    }

    /// Acceleration of a body of the model under the forces of the period that has just ended, m/s².
    pub fn acceleration(&self, body: usize) -> f64 {
        self.fixed.slots.get(body).map_or(f64::NAN, |slot| self.endpoint().acceleration[*slot])
    }

    /// Force of an element of the model, N, positive when it is stretched.
    pub fn element_force(&self, element: usize) -> f64 {
        self.force_without_balance(element).unwrap_or_else(|| self.force_at(element, &self.endpoint()))
    }

    /// Force of an element on a body of the model, N or N m: of one at a point of a robot what it is on a joint, `Jᵀ F`. 0 where it does not reach the
    /// body; not a number when there is no such body or element.
    pub fn force_on(&self, element: usize, body: usize) -> f64 {
        let (Some(slot), Some([first, second])) = (self.fixed.slots.get(body), self.ends_of(element)) else { return f64::NAN };
        let share = |place: usize| self.fixed.points.share(place, *slot);
        let lever = share(second) - share(first);
        // A joint whose axis the force meets has no lever but what rounding leaves, and is not touched.
        if lever.abs() > NO_LEVER { lever * self.element_force(element) } else { 0.0 }
    }

    /// Places of an element's ends.
    fn ends_of(&self, element: usize) -> Option<[usize; 2]> {
        match *self.fixed.elements.get(element)? {
            Share::Linear(_, first, second) => Some([first, second]),
            Share::Friction(contact) => self.frictions.get(contact).map(|c| [c.first, c.second]),
            Share::Path(path) => self.paths.get(path).map(|p| [p.first, p.second]),
        }
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
        // 0 times what is no number is none; the unused places are 0.
        let mut sum = 0.0;
        for places in [0..self.fixed.free, self.fixed.points.places(), GROUND - self.fixed.prescribed..GROUND] {
            for (x, v) in self.x[places.clone()].iter().zip(&self.v[places]) {
                sum += 0.0 * x + 0.0 * v;
            }
        }
        sum == 0.0
    }

    /// Approximate computation of a step of one period, in steps of a linear network. Contacts and paths add to each substep, those that are solved
    /// implicitly several evaluations of their law, and costly laws more.
    pub fn cost(&self) -> u64 {
        let (implicit, costly) = self.dear();
        let links = self.links.as_ref().map_or(0, |links| LINKS * links.len() * links.len());
        (self.substeps * (1 + links + self.frictions.len() + self.paths.len() + IMPLICIT * implicit + COSTLY * costly) + self.balances())
            as u64
    }

    /// The same of derivatives by one parameter that are carried along (see [`crate::stepper::Tangents`]).
    pub fn cost_of_a_lane(&self) -> u64 {
        let (implicit, costly) = self.dear();
        ((self.substeps * (1 + self.paths.len() + 2 * implicit + COSTLY * costly)).div_ceil(2) + self.balances()) as u64
    }

    /// What reading the outputs of a sample takes where it needs the balance of forces.
    fn balances(&self) -> usize {
        if self.sense.reads_forces { BALANCE } else { 0 }
    }

    /// How many laws are solved implicitly, and how many are costly.
    fn dear(&self) -> (usize, usize) {
        (self.paths.iter().filter(|p| p.constraint.is_some()).count(), self.paths.iter().filter(|p| p.law.is_costly()).count())
    }

    /// Substeps in each period.
    pub fn substeps(&self) -> usize {
        self.substeps
    }
}
