//! The master's model held by one hand after another, all pushed by the same force.

use crate::device::{Device, DeviceError, DeviceOptions, DeviceRole};
use backdrive_plant::model::{Fragment, Model};

/// Neighbours of the bank differ by this factor at most: between them a motion is taken as linear in the hand's softness.
const STEP: f64 = 1.27;
/// The bank reaches beyond the range by this factor, so that an interval about a hand at its end lies inside.
const BEYOND: f64 = 1.25;

/// Between which firmnesses a hand is looked for, as factors on stiffness and damping of the grip of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandSettings {
    /// The softest hand.
    pub softest: f64,
    /// The firmest; above `softest`.
    pub firmest: f64,
    /// The lowest gain product mu lambda at which the loop oscillates without a canceller, for any of these hands; `None` where it is not known.
    pub edge_without: Option<f64>,
}

impl Default for HandSettings {
    /// From half to twice the grip of the file.
    fn default() -> HandSettings {
        HandSettings { softest: 0.5, firmest: 2.0, edge_without: None }
    }
}

/// Models of the master that differ in how firmly they are held.
pub struct HandBank {
    devices: Vec<Device>,
    softness: Vec<f64>,
}

impl HandBank {
    /// A bank over the range of `settings`. The hand is the grip `fragment`; of a model that holds its user, what lies between a body on a
    /// motion input and its neighbours.
    ///
    /// # Errors
    /// [`DeviceError::NoHand`] where nothing holds the model; else as [`Device::new`].
    pub fn new(
        model: &Model,
        fragment: Option<&Fragment>,
        settings: &HandSettings,
        period_s: f64,
        options: &DeviceOptions,
    ) -> Result<HandBank, DeviceError> {
        let (low, high) = (settings.softest / BEYOND, settings.firmest * BEYOND);
        let steps = ((high / low).ln() / STEP.ln()).ceil().max(1.0);
        let firmness = (0..=steps as usize).map(|i| high * (low / high).powf(i as f64 / steps));
        let (mut devices, mut softness) = (Vec::new(), Vec::new());
        for factor in firmness {
            let (mut model, mut fragment) = (model.clone(), fragment.cloned());
            let own = model.scale_own_hand(factor);
            let held = fragment.as_mut().filter(|f| !f.network.elements.is_empty() && model.axes.iter().any(|a| !a.holds_user));
            if own == 0 && held.is_none() {
                return Err(DeviceError::NoHand(model.name));
            }
            if let Some(fragment) = held {
                fragment.scale(factor);
            }
            devices.push(Device::new(&model, fragment.as_ref(), DeviceRole::Master, period_s, options)?);
            softness.push(1.0 / factor);
        }
        Ok(HandBank { devices, softness })
    }

    /// Softness of the hands, 1 over the factor on the grip of the file, ascending; two at least.
    pub fn softness(&self) -> &[f64] {
        &self.softness
    }

    /// Number of axes.
    pub fn axes(&self) -> usize {
        self.devices.first().map_or(0, Device::axes)
    }

    /// What the position sensor of an axis adds by its file, m or rad: standard deviation of its noise and of its steps.
    pub fn sensor_noise(&self, axis: usize) -> f64 {
        let Some(device) = self.devices.first().filter(|d| axis < d.axes()) else { return 0.0 };
        let axis = device.axis(axis);
        let output = device.model().outputs.get(axis.measured);
        output.map_or(0.0, |o| axis.scale.abs() * (o.noise * o.noise + o.resolution * o.resolution / 12.0).sqrt())
    }

    /// Starts all at rest, the force being what it is.
    pub fn start(&mut self, force: &[f64]) {
        self.devices.iter_mut().for_each(|device| device.start(force, &[]));
    }

    /// Carries all to the next sample under a force that was held, N or N m, the hand at rest.
    pub fn step(&mut self, force: &[f64]) {
        self.devices.iter_mut().for_each(|device| device.step(force, &[]));
    }

    /// Position of an axis in the model that the hand number `hand` holds, m or rad.
    pub fn position(&self, hand: usize, axis: usize) -> f64 {
        self.devices.get(hand).map_or(f64::NAN, |device| device.measured(axis))
    }

    /// Whether all states are finite.
    pub fn is_finite(&self) -> bool {
        self.devices.iter().all(Device::is_finite)
    }
}
