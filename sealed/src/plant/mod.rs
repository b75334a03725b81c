//! The hidden plant in time.
//!
//! The integrator is a splitting: drift (positions move with their speeds for half a substep), kick (speeds change at those positions), drift. For
//! conservative forces that is the leapfrog, second order and symplectic, so the energy of a mode stays for any number of periods. Within the kick,
//! damping is integrated by the midpoint rule, which is stable at any size. Dry friction is a force within a box that brings the surfaces to rest if
//! it can (`kick`). So stick is exact, no speed regularises anything, and no event is searched for; a reversal is late by at most a substep. Laws
//! with a memory follow the positions of the kicks, exactly along each piece of their path.

mod assemble;
mod dense;
mod drive;
mod error;
mod joint;
mod kick;
mod loading;
mod regrip;
mod sense;
mod sensor;
mod state;

pub use error::{PlantError, StepError};
pub use state::SealedPlant;

use crate::laws::Path;
use crate::network::Network;
use crate::truth::Truth;

/// The substep resolves the fastest motion that the stiffnesses allow to this phase, rad: its frequency is then off by
/// `phase^2/24`, 1e-4 of itself, and that of a mode ten times slower by 1e-6.
const PHASE_PER_SUBSTEP: f64 = 0.05;

/// Substeps of a period at least, for reversals, dead times and jumps that fall inside it.
const SUBSTEPS_AT_LEAST: usize = 20;

/// The same where a look is enough: the fastest frequency is off by 4e-4 of itself.
const COARSE: (f64, usize) = (0.1, 6);

impl SealedPlant {
    /// The device that `truth` makes of the nominal model (with its grip attached, [`Network::held`]), at rest, its outputs measured
    /// once. `period_s` is the time from one step to the next.
    ///
    /// # Errors
    ///
    /// [`PlantError`]: the truth is not about this model, or the device cannot be simulated.
    pub fn new(nominal: &Network, truth: &Truth, period_s: f64) -> Result<SealedPlant, PlantError> {
        SealedPlant::with_substeps(nominal, truth, period_s, 1)
    }

    /// The same with at least `substeps` substeps of a period. For checks of convergence.
    ///
    /// # Errors
    ///
    /// As [`SealedPlant::new`].
    pub fn with_substeps(nominal: &Network, truth: &Truth, period_s: f64, substeps: usize) -> Result<SealedPlant, PlantError> {
        SealedPlant::resolving(nominal, truth, period_s, (PHASE_PER_SUBSTEP, substeps.max(SUBSTEPS_AT_LEAST)))
    }

    /// The same in about a third of the substeps: where thousands of runs are judged by what they do at large, and none is a recording.
    ///
    /// # Errors
    ///
    /// As [`SealedPlant::new`].
    pub fn coarse(nominal: &Network, truth: &Truth, period_s: f64) -> Result<SealedPlant, PlantError> {
        SealedPlant::resolving(nominal, truth, period_s, COARSE)
    }

    /// Phase of the fastest motion in a substep, rad, at most, and number of substeps at least.
    fn resolving(nominal: &Network, truth: &Truth, period_s: f64, fineness: (f64, usize)) -> Result<SealedPlant, PlantError> {
        if !(period_s.is_finite() && period_s > 0.0) {
            return Err(PlantError::Period(period_s));
        }
        let device = truth.device(nominal)?;
        let mut plant = assemble::assemble(&device, truth, period_s, fineness)?;
        plant.measure();
        Ok(plant)
    }

    /// Takes the first samples of the inputs as where motions begin: the moved bodies stand there, everything else rests
    /// at 0. Forces do not act yet. Measures again, so call it before the first step or not at all.
    ///
    /// # Errors
    ///
    /// [`StepError::Inputs`] and [`StepError::NotFinite`].
    pub fn start(&mut self, inputs: &[f64]) -> Result<(), StepError> {
        self.check(inputs)?;
        for (drive, sample) in self.drives.iter_mut().zip(inputs) {
            drive.start(*sample);
            if drive.is_motion() {
                self.positions[drive.body()] = drive.position(1.0);
            }
        }
        for joint in &mut self.joints {
            joint.last = joint.relative(&self.positions);
        }
        self.measure();
        Ok(())
    }

    /// Carries the device on by one period. A force with zero hold acts with this value through the period; any
    /// other input goes from its last value to this one, which it has at the period's end.
    ///
    /// # Errors
    ///
    /// [`StepError`]; nothing has moved when the inputs are refused.
    pub fn step(&mut self, inputs: &[f64]) -> Result<(), StepError> {
        self.check(inputs)?;
        for (drive, sample) in self.drives.iter_mut().zip(inputs) {
            drive.begin(*sample);
        }
        for number in 0..self.substeps {
            self.substep(number);
        }
        if !self.positions.iter().chain(&self.speeds).all(|value| value.is_finite()) {
            return Err(StepError::RanAway);
        }
        self.measure();
        Ok(())
    }

    fn check(&self, inputs: &[f64]) -> Result<(), StepError> {
        if inputs.len() != self.drives.len() {
            return Err(StepError::Inputs { found: inputs.len(), expected: self.drives.len() });
        }
        match inputs.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(StepError::NotFinite(index)),
            None => Ok(()),
        }
    }

    fn substep(&mut self, number: usize) {
        let h = self.substep_s;
        let share = |substeps: f64| (number as f64 + substeps) / self.substeps as f64;
        // Drift to the middle.
        for body in 0..self.positions.len() {
            self.middle[body] = self.positions[body] + 0.5 * h * self.speeds[body];
        }
        self.applied.fill(0.0);
        for drive in &mut self.drives {
            let body = drive.body();
            if drive.is_motion() {
                self.middle[body] = drive.position(share(0.5));
                self.speeds[body] = drive.speed(share(0.0));
                self.kick.set_moved_speed(body, drive.speed(share(1.0)));
            } else {
                self.applied[body] += drive.mean_force(number as f64 * h, (number + 1) as f64 * h);
            }
        }
        // Kick.
        for index in 0..self.joints.len() {
            let joint = &mut self.joints[index];
            let path = Path { from: joint.last, to: joint.relative(&self.middle), speed: joint.relative(&self.speeds), duration: h };
            joint.path_force = joint.force.path_force(&path, &mut self.memory[joint.memory.clone()]);
            joint.last = path.to;
            joint.push(joint.path_force, &mut self.applied);
        }
        self.kick.strike(&mut self.joints, &mut self.memory, &self.middle, &mut self.speeds, &self.applied);
        // Drift to the end.
        for body in 0..self.positions.len() {
            self.positions[body] = self.middle[body] + 0.5 * h * self.speeds[body];
        }
        for drive in self.drives.iter().filter(|drive| drive.is_motion()) {
            self.positions[drive.body()] = drive.position(share(1.0));
        }
    }

    /// Names of the inputs, in the order of [`SealedPlant::step`].
    pub fn input_names(&self) -> &[String] {
        &self.names.inputs
    }

    /// Names of the outputs, in the order of [`SealedPlant::outputs`].
    pub fn output_names(&self) -> &[String] {
        &self.names.outputs
    }

    /// What the sensors say after the last step: with gain, delay, offset, noise and encoder steps, in this order.
    pub fn outputs(&self) -> &[f64] {
        &self.measured
    }

    /// The same before noise and encoder steps.
    pub fn exact_outputs(&self) -> &[f64] {
        &self.exact
    }

    /// Index of a body of the true device, which has the nominal ones in their order and perhaps more.
    pub fn body(&self, name: &str) -> Option<usize> {
        self.names.bodies.iter().position(|body| body == name)
    }

    /// Index of an element of the true device.
    pub fn element(&self, name: &str) -> Option<usize> {
        self.names.elements.iter().position(|element| element == name)
    }

    /// m, of a body by its index; 0 where there is none.
    pub fn position(&self, body: usize) -> f64 {
        self.positions.get(body).copied().unwrap_or(0.0)
    }

    /// m/s, of a body by its index; 0 where there is none.
    pub fn speed(&self, body: usize) -> f64 {
        self.speeds.get(body).copied().unwrap_or(0.0)
    }

    /// N, of an element by its index, positive when stretched; 0 where there is none.
    pub fn force(&self, element: usize) -> f64 {
        self.element_forces.get(element).copied().unwrap_or(0.0)
    }

    /// Substeps of a period.
    pub fn substeps(&self) -> usize {
        self.substeps
    }
}
