//! MuJoCo 4.0. What is meant by each attribute: MuJoCo XML reference, <https://mujoco.readthedocs.io/en/4.0.0/XMLreference.html>.

mod attributes;
mod bodies;
mod document;
mod integration;
mod layout;
mod network;
mod passive;
mod patch;
mod servos;
mod signals;

use crate::{ExportError, Exported, of_robot};
use backdrive_plant::model::Model;
use document::{names_in, of_arm, of_network};
use layout::Layout;
use network::network;
use signals::signals;

/// A model for MuJoCo. `step` is its time step, s; `None` for one that suits the model.
///
/// # Errors
/// Where nothing moves, or the model cannot be simulated.
pub fn export(model: &Model, step: Option<f64>) -> Result<Exported, ExportError> {
    if !model.servos.is_empty() {
        return servos::export(model, step);
    }
    if model.bodies.is_empty() {
        return Err(ExportError::new("it is the model of nothing: it has no bodies"));
    }
    let mut notes = Vec::new();
    let held = of_robot(model)?;
    let layout = Layout::of(model);
    let (network, mut left_out) = network(model, &layout.pose, names_in(model, "tendon"));
    let integration = integration::integration(model, &layout, &network, step)?;
    let mut signals = signals(model, &network, &layout.names, integration, names_in(model, "actuator"));
    left_out.append(&mut signals.left_out);
    left_out.extend(held);
    let text = match &model.arm {
        None => of_network(model, &layout, &network, &signals, integration),
        Some(arm) => of_arm(model, arm, &layout, &network, &signals, integration, (&mut notes, &mut left_out))?,
    };
    notes.extend(of_commands(model));
    Ok(Exported { text, left_out, notes })
}

fn of_commands(model: &Model) -> Option<String> {
    let limited: Vec<&str> = model.axes.iter().filter(|a| a.force.is_some()).map(|a| a.name.as_str()).collect();
    (!limited.is_empty()).then(|| {
        format!("the commands of axis {} are limited to what its motor gives; `backdrive simulate` does not limit them", limited.join(", "))
    })
}
