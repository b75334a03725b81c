//! The truth about a hidden plant.

use crate::effects::{Effect, EffectError};
use crate::network::{Named, Network};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The version of the file's form.
pub const SCHEMA: u32 = 1;

/// Everything that sets the hidden plant apart from its nominal model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// [`SCHEMA`].
    pub schema: u32,
    /// The nominal model that it is about: with another one its factors would make another device.
    pub nominal: Named,
    /// The nominal grip, where the device is held.
    pub grip: Option<Named>,
    /// The seed that it was drawn from.
    pub seed: u64,
    /// What is hidden.
    pub effects: Vec<Effect>,
    /// Parameters of the nominal model that are wrong, by path (`elements.cable.stiffness`): the true value over the nominal one.
    pub numbers: BTreeMap<String, f64>,
    /// The hand that holds it, against the nominal grip.
    pub hand: Hand,
    /// How each output is measured; outputs that are not listed are those of the model, without noise.
    pub sensors: Vec<Sensor>,
    /// Seed of the sensors' noise.
    pub noise_seed: u64,
}

/// The true grip over the nominal one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hand {
    /// Of every spring in the grip.
    pub stiffness: f64,
    /// Of every damper in the grip.
    pub damping: f64,
}

/// How an output is measured: noise first, then rounding to the encoder's steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Name of the output.
    pub output: String,
    /// In the output's unit, encoder step; 0 when there is none.
    pub resolution: f64,
    /// In the output's unit, standard deviation of white Gaussian noise.
    pub noise: f64,
}

/// A truth that cannot be read, written or put into its device.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// Not a truth file, or one that cannot be written.
    #[error("not a truth file: {0}")]
    Json(#[from] serde_json::Error),
    /// The form is of another version.
    #[error("the truth file has schema {found}; this program reads {SCHEMA}: use the program that wrote it")]
    Schema {
        /// The schema number in the file.
        found: u32,
    },
    /// It was drawn for another model or grip.
    #[error("the truth is about the {what} {truth}, and this is {given}; give the file that it was drawn for, unchanged")]
    OtherFile {
        /// `model` or `grip`.
        what: &'static str,
        /// Name and beginning of the hash in the truth.
        truth: String,
        /// The same of what was given.
        given: String,
    },
    /// It names a number, an output or a factor that the device does not have or cannot take.
    #[error("the truth has {path} = {value}, which the nominal model does not have or does not accept")]
    Number {
        /// The path.
        path: String,
        /// The value.
        value: f64,
    },
    /// An effect does not fit.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

impl Truth {
    /// A truth that hides nothing: the device is its nominal model, ideally measured except for the model's own encoder steps.
    pub fn nothing(network: &Network) -> Truth {
        Truth {
            schema: SCHEMA,
            nominal: network.nominal.clone(),
            grip: network.grip.clone(),
            seed: 0,
            effects: Vec::new(),
            numbers: BTreeMap::new(),
            hand: Hand { stiffness: 1.0, damping: 1.0 },
            sensors: Vec::new(),
            noise_seed: 0,
        }
    }

    /// Reads a truth file.
    ///
    /// # Errors
    ///
    /// [`TruthError::Json`] and [`TruthError::Schema`].
    pub fn from_json(bytes: &[u8]) -> Result<Truth, TruthError> {
        let truth: Truth = serde_json::from_slice(bytes)?;
        if truth.schema != SCHEMA {
            return Err(TruthError::Schema { found: truth.schema });
        }
        Ok(truth)
    }

    /// The true device: the nominal one with true parameters, the true hand, true sensors' steps and the hidden effects.
    ///
    /// # Errors
    ///
    /// [`TruthError`] where the truth is not about this model.
    pub fn device(&self, nominal: &Network) -> Result<Network, TruthError> {
        same_file("model", Some(&self.nominal), Some(&nominal.nominal))?;
        same_file("grip", self.grip.as_ref(), nominal.grip.as_ref())?;
        let mut device = nominal.clone();
        for (path, factor) in &self.numbers {
            let wrong = || TruthError::Number { path: path.clone(), value: *factor };
            *device.number_mut(path).filter(|_| positive(*factor)).ok_or_else(wrong)? *= factor;
        }
        for (path, factor) in [("hand.stiffness", self.hand.stiffness), ("hand.damping", self.hand.damping)] {
            if !positive(factor) {
                return Err(TruthError::Number { path: path.to_string(), value: factor });
            }
        }
        for element in device.elements.iter_mut().filter(|element| element.of_grip) {
            for (key, factor) in [("stiffness", self.hand.stiffness), ("damping", self.hand.damping)] {
                if let Some(number) = element.law.number_mut(key) {
                    *number *= factor;
                }
            }
        }
        for sensor in &self.sensors {
            let path = format!("sensors.{}", sensor.output);
            for value in [sensor.resolution, sensor.noise] {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(TruthError::Number { path, value });
                }
            }
            let output = device.output(&sensor.output).ok_or(TruthError::Number { path, value: sensor.resolution })?;
            device.outputs[output].resolution = sensor.resolution;
        }
        for (number, effect) in self.effects.iter().enumerate() {
            effect.apply(&mut device, number + 1)?;
        }
        Ok(device)
    }
}

fn same_file(what: &'static str, truth: Option<&Named>, given: Option<&Named>) -> Result<(), TruthError> {
    let told = |file: Option<&Named>| match file {
        Some(file) => format!("\"{}\" (SHA-256 {}...)", file.name, file.sha256.get(..8).unwrap_or(&file.sha256)),
        None => "none".to_string(),
    };
    if truth == given { Ok(()) } else { Err(TruthError::OtherFile { what, truth: told(truth), given: told(given) }) }
}

fn positive(value: f64) -> bool {
    value.is_finite() && value > 0.0
}
