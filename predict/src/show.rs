//! A model described: its network, its modes and its frequency responses.

use crate::error::PredictError;
use crate::held::held_model;
use backdrive_plant::describe::{Description, describe};
use backdrive_plant::linear::Operating;
use backdrive_plant::parse::ModelFile;
use std::path::{Path, PathBuf};

/// Most bodies of a model that is looked at: its modes and its response are those of full matrices, whose cost grows with the cube of it.
const MOST_BODIES: usize = 300;

/// What is described.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The model file, or a fragment.
    pub model: PathBuf,
    /// Grip or environment to attach at the model's user's body.
    pub grip: Option<PathBuf>,
    /// Amplitude of motion for the linearisation of hysteresis, friction and backlash, m or rad; `None` for a very small one.
    pub amplitude: Option<f64>,
}

/// Describes a model.
///
/// # Errors
/// A file cannot be read, the model has no moving body or too many, or the amplitude is not above 0.
pub fn described(options: &Options) -> Result<Description, PredictError> {
    let at = match options.amplitude {
        Some(amplitude) if amplitude > 0.0 && amplitude.is_finite() => Operating::amplitude(amplitude),
        Some(amplitude) => return Err(PredictError::Usage(format!("--amplitude must be above 0, is {amplitude}"))),
        None => Operating::small(),
    };
    Ok(match read(&options.model)? {
        ModelFile::Fragment(fragment) => describe(&fragment.network, &at),
        ModelFile::Device(_) => describe(&held_model(&options.model, options.grip.as_deref())?, &at),
    })
}

/// Reads a model file in which there is something to look at, and not too much.
///
/// # Errors
/// The file cannot be read, or the model has no moving body or too many.
pub fn read(file: &Path) -> Result<ModelFile, PredictError> {
    let loaded = ModelFile::load(file)?;
    let network = match &loaded {
        ModelFile::Fragment(fragment) => &fragment.network,
        ModelFile::Device(model) => model,
    };
    let path = file.display();
    match network.bodies.len() {
        0 if matches!(loaded, ModelFile::Device(_)) => Err(PredictError::input(format!(
            "{path}: has no [bodies], so nothing moves; add what moves, such as `handle = 0.1`, kg (docs/own-recording.md, plant/models)"
        ))),
        bodies if bodies > MOST_BODIES => Err(PredictError::input(format!(
            "{path}: has {bodies} bodies, and at most {MOST_BODIES} can be shown; merge those that move together (a chain needs few \
             bodies per wave length of the highest frequency that matters)"
        ))),
        _ => Ok(loaded),
    }
}
