//! A model held by a grip.

use crate::error::PredictError;
use backdrive_plant::model::{Fragment, Model};
use std::path::Path;

/// A model with a grip or an environment attached where one is given.
///
/// # Errors
/// A file cannot be read, or the model has no axis at which a grip could attach.
pub fn held_model(path: &Path, grip: Option<&Path>) -> Result<Model, PredictError> {
    let mut model = Model::load(path)?;
    let Some(grip) = grip else { return Ok(model) };
    let fragment = Fragment::load(grip)?;
    if model.axes.is_empty() {
        return Err(PredictError::input(format!("{}: has no [[axes]], so a grip has nowhere to attach", path.display())));
    }
    let several = model.axes.len() > 1;
    for (number, axis) in model.axes.clone().iter().enumerate().filter(|(_, axis)| !axis.holds_user) {
        let prefix = if several { format!("{}{number}", fragment.network.name) } else { fragment.network.name.clone() };
        model.attach(&fragment, axis.user, &prefix);
    }
    Ok(model)
}
