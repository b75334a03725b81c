//! The hidden plant as the master of a graph: its inputs and outputs at a sample, and nothing else.

use crate::network::{InputKind, Network};
use crate::plant::{PlantError, SealedPlant, StepError};
use crate::truth::Truth;

/// A change of the grip in a run.
///
/// The hand tightens or loosens where it is: the handle stays, and the force of the hand's spring; from then on that follows with the new stiffness. So
/// the point that the spring pulls to is taken along, and the spring's energy changes from `F^2 / 2k` to `F^2 / 2k'`, which the muscle gives or takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regrip {
    /// s, when.
    pub at_s: f64,
    /// Factor on stiffness and damping of the hand of this run, from then on.
    pub scale: f64,
}

/// How a run uses the device.
#[derive(Debug, Clone, PartialEq)]
pub struct MasterOptions {
    /// s, sampling period of the graph.
    pub period_s: f64,
    /// Which run of the device it is: every one has sensor noise of its own.
    pub run: u32,
    /// How firm the hand grips in this run: factor on stiffness and damping of the true grip.
    pub firmness: f64,
    /// How it changes its grip in this run, times ascending.
    pub regrips: Vec<Regrip>,
    /// Whether a look is enough, as [`SealedPlant::coarse`] gives it.
    pub coarse: bool,
}

/// A device that cannot be a master.
#[derive(Debug, thiserror::Error)]
pub enum MasterError {
    /// The model has no `[[axes]]`.
    #[error("model \"{0}\" has no [[axes]]: a graph needs to know where it is held, pushed and read")]
    NoAxes(String),
    /// An axis is not pushed by a force.
    #[error("model \"{model}\", axis \"{axis}\": the feedback of a master must be a force input")]
    WrongFeedback {
        /// The model.
        model: String,
        /// The axis.
        axis: String,
    },
    /// An input that no axis feeds.
    #[error("model \"{model}\": nothing drives the input \"{input}\" in a graph; name it as an axis' feedback")]
    UndrivenInput {
        /// The model.
        model: String,
        /// The input.
        input: String,
    },
    /// The truth does not fit, or the device cannot be simulated.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

/// One axis at a sample. In a run-away all are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// m at the tip, the position sensor's output, with noise and encoder steps.
    pub measured: f64,
    /// m, of the body that the hand holds. Like the next two, a simulation knows it and a session may not.
    pub position: f64,
    /// m/s, of the body that the hand holds.
    pub velocity: f64,
    /// N, force of the hand on that body.
    pub force: f64,
}

struct Bound {
    feedback: usize,
    hand: Option<usize>,
    measured: usize,
    scale: f64,
    user: usize,
    /// Elements of the grip that end on the user's body, and -1 where that is their first end.
    grip: Vec<(usize, f64)>,
}

/// The true device with the true hand on it. Of what is inside, only what a graph carries can be read.
pub struct SealedMaster {
    plant: SealedPlant,
    axes: Vec<Bound>,
    inputs: Vec<f64>,
    ran_away: bool,
    regrips: Vec<(u64, f64, SealedPlant)>,
    regripped: usize,
    step: u64,
    scale: f64,
    /// m, of every axis' hand: how far the point that its spring pulls to was taken along.
    shift: Vec<f64>,
    of_grip: Vec<usize>,
}

impl SealedMaster {
    /// The device that `truth` makes of the nominal model, held by [`Network::held`] or not at all, at rest.
    ///
    /// # Errors
    ///
    /// [`MasterError`].
    pub fn new(held: &Network, truth: &Truth, options: &MasterOptions) -> Result<SealedMaster, MasterError> {
        let model = || held.nominal.name.clone();
        if held.axes.is_empty() {
            return Err(MasterError::NoAxes(model()));
        }
        if let Some(axis) = held.axes.iter().find(|axis| held.inputs[axis.feedback].kind != InputKind::Force) {
            return Err(MasterError::WrongFeedback { model: model(), axis: axis.name.clone() });
        }
        let fed = |input: usize| held.axes.iter().any(|axis| axis.feedback == input || axis.hand == Some(input));
        if let Some(input) = (0..held.inputs.len()).find(|input| !fed(*input)) {
            return Err(MasterError::UndrivenInput { model: model(), input: held.inputs[input].name.clone() });
        }
        let axes = held.axes.iter().map(|axis| Bound {
            feedback: axis.feedback,
            hand: axis.hand,
            measured: axis.measured,
            scale: axis.scale,
            user: axis.user,
            grip: grip_on(held, axis.user),
        });
        let axes = axes.collect();
        let mut truth = truth.clone();
        truth.noise_seed ^= u64::from(options.run) << 32;
        let make = if options.coarse { SealedPlant::coarse } else { SealedPlant::new };
        let gripped = |scale: f64| {
            let mut truth = truth.clone();
            truth.hand.stiffness *= options.firmness * scale;
            truth.hand.damping *= options.firmness * scale;
            make(held, &truth, options.period_s)
        };
        let regrip = |regrip: &Regrip| {
            let at = (regrip.at_s / options.period_s).round().max(0.0) as u64;
            Ok((at, regrip.scale, gripped(regrip.scale)?))
        };
        let regrips = options.regrips.iter().map(regrip).collect::<Result<Vec<_>, PlantError>>()?;
        let plant = gripped(1.0)?;
        let named = held.elements.iter().filter(|element| element.of_grip);
        let of_grip = named.filter_map(|element| plant.element(&element.name)).collect();
        let (inputs, shift) = (vec![0.0; held.inputs.len()], vec![0.0; held.axes.len()]);
        Ok(SealedMaster { plant, axes, inputs, ran_away: false, regrips, regripped: 0, step: 0, scale: 1.0, shift, of_grip })
    }

    /// How many axes it has.
    pub fn axes(&self) -> usize {
        self.axes.len()
    }

    /// Where every axis' hand (m) is at the first sample; the device rests. Nothing moves. Axes that `hand` leaves out stay at 0.
    ///
    /// # Errors
    ///
    /// [`StepError::NotFinite`].
    pub fn start(&mut self, hand: &[f64]) -> Result<(), StepError> {
        self.feed(&[], hand);
        self.plant.start(&self.inputs)
    }

    /// Carries the device to the next sample: every axis' `force` (N) acts until then, its `hand` (m) goes there in a
    /// straight line. Values that are left out are 0.
    ///
    /// # Errors
    ///
    /// [`StepError::NotFinite`]; nothing has moved then. A run-away is no error: from then on all readings are NaN.
    pub fn step(&mut self, force: &[f64], hand: &[f64]) -> Result<(), StepError> {
        if self.ran_away {
            return Ok(());
        }
        self.feed(force, hand);
        match self.plant.step(&self.inputs) {
            Err(StepError::RanAway) => {
                self.ran_away = true;
                Ok(())
            }
            other => {
                self.step += 1;
                self.regrip();
                other
            }
        }
    }

    /// What of the grip changes at this sample.
    fn regrip(&mut self) {
        while let Some((_, scale, other)) = self.regrips.get_mut(self.regripped).filter(|(at, ..)| *at <= self.step) {
            for (axis, shift) in self.axes.iter().zip(&mut self.shift) {
                let Some(input) = axis.hand else { continue };
                let stretch = self.inputs[input] - self.plant.position(axis.user);
                let taken_along = (self.scale / *scale - 1.0) * stretch;
                *shift += taken_along;
                self.plant.move_hand(input, self.inputs[input] + taken_along);
            }
            self.plant.exchange_laws(other, &self.of_grip);
            self.scale = *scale;
            self.regripped += 1;
        }
    }

    fn feed(&mut self, force: &[f64], hand: &[f64]) {
        let at = |values: &[f64], axis: usize| values.get(axis).copied().unwrap_or(0.0);
        for (index, axis) in self.axes.iter().enumerate() {
            self.inputs[axis.feedback] = at(force, index);
            if let Some(input) = axis.hand {
                self.inputs[input] = at(hand, index) + self.shift[index];
            }
        }
    }

    /// An axis at this sample; `None` where there is none.
    pub fn reading(&self, axis: usize) -> Option<Reading> {
        let axis = self.axes.get(axis)?;
        let told = |value: f64| if self.ran_away { f64::NAN } else { value };
        Some(Reading {
            measured: told(axis.scale * self.plant.outputs()[axis.measured]),
            position: told(self.plant.position(axis.user)),
            velocity: told(self.plant.speed(axis.user)),
            force: told(axis.grip.iter().map(|(element, sign)| sign * self.plant.force(*element)).sum()),
        })
    }
}

fn grip_on(held: &Network, user: usize) -> Vec<(usize, f64)> {
    let of_grip = held.elements.iter().enumerate().filter(|(_, element)| element.of_grip);
    of_grip
        .filter_map(|(index, element)| match element.between {
            [Some(first), _] if first == user => Some((index, -1.0)),
            [_, Some(second)] if second == user => Some((index, 1.0)),
            _ => None,
        })
        .collect()
}
