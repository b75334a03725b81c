//! The step and the rule that an exported model is run with.

use super::attributes::Integration;
use super::layout::Layout;
use super::network::Network;
use crate::ExportError;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant};

/// Longest step that is chosen, s.
const LONGEST: f64 = 1e-3;
/// Shortest step that is chosen, s.
const SHORTEST: f64 = 1e-6;
/// Longest step with dry friction, for which MuJoCo's rules are of first order, s.
const LONGEST_WITH_FRICTION: f64 = 1e-4;
/// Damping that the rule of Runge and Kutta is trusted with: share of the speed that is lost in a step.
const MOST_LOST: f64 = 0.5;

/// The step and the rule for a model.
///
/// # Errors
/// Where the model cannot be simulated.
pub(super) fn integration(model: &Model, layout: &Layout, network: &Network, step: Option<f64>) -> Result<Integration, ExportError> {
    let plant = Plant::new(model, LONGEST, &Options::default()).map_err(ExportError::new)?;
    let has_friction = network.joints.iter().any(|j| j.friction > 0.0) || network.tendons.iter().any(|t| t.passive.friction > 0.0);
    let jumps = network.tendons.iter().any(|t| t.passive.yields > 0.0 || t.passive.slack[0] < t.passive.slack[1]);
    let own = LONGEST / plant.substeps().max(1) as f64;
    let longest = if has_friction || jumps { own.min(LONGEST_WITH_FRICTION) } else { own };
    let delays = model.inputs.iter().map(|i| i.delay).chain(model.outputs.iter().map(|o| o.delay)).filter(|d| *d > 0.0);
    // MuJoCo reads what is delayed at least one step late.
    let step = step.unwrap_or_else(|| round(delays.fold(longest, f64::min).max(SHORTEST)));
    let is_smooth = !has_friction && !jumps && lost(model, layout, network) * step < MOST_LOST;
    Ok(Integration { step, integrator: if is_smooth { "RK4" } else { "implicitfast" } })
}

/// The next shorter of 1, 2 and 5 times a power of ten.
fn round(step: f64) -> f64 {
    let power = 10f64.powi((step * (1.0 + 1e-9)).log10().floor() as i32);
    let lead = [5.0, 2.0, 1.0].into_iter().find(|lead| lead * power <= step * (1.0 + 1e-9)).unwrap_or(1.0);
    // Divided rather than multiplied, so that 1e-4 is that number.
    if power < 1.0 { lead / (1.0 / power).round() } else { lead * power }
}

/// Largest rate at which damping takes speed, 1/s.
fn lost(model: &Model, layout: &Layout, network: &Network) -> f64 {
    let links = model.arm.as_ref().map(|arm| arm.inertia_at_pose(model.bodies.len()));
    let rate = |body: usize| {
        let of_links = links.as_ref().map_or(0.0, |m| m[(body, body)]);
        let on_joint = network.joints.get(body).copied().unwrap_or_default();
        let across = network.tendons.iter().filter(|t| t.ends.iter().any(|(b, _)| *b == body)).map(|t| t.passive.damping[0]);
        let inertia = layout.inertia.get(body).copied().unwrap_or(0.0) + on_joint.armature + of_links;
        let damping = on_joint.damping[0] + across.sum::<f64>();
        if damping == 0.0 { 0.0 } else { damping / inertia }
    };
    (0..model.bodies.len()).map(rate).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        assert_eq!([1e-3, 9.9e-4, 2.5e-4, 1e-4 / 3.0, 1e-4, 6e-6].map(round), [1e-3, 5e-4, 2e-4, 2e-5, 1e-4, 5e-6]);
    }
}
