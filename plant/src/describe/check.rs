//! What is odd about a model.

use crate::elements::{Law, Role};
use crate::linear::{LinearModel, Operating};
use crate::model::Model;
use crate::stepper::{Options, Plant};
use serde::Serialize;

/// How much a remark matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Probably not meant.
    Warning,
    /// The model cannot be simulated.
    Error,
}

/// Something odd.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Remark {
    /// How much it matters.
    pub severity: Severity,
    /// Path of what it is about, such as `elements.linkage`.
    pub about: String,
    /// One sentence.
    pub message: String,
}

/// Everything odd about a model, worst first.
pub fn check(model: &Model, at: &Operating) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let mut add = |severity: Severity, about: String, message: String| remarks.push(Remark { severity, about, message });
    // Whether it can be stepped does not depend on the period; 1 kHz stands for any.
    if let Err(error) = Plant::new(model, 1e-3, &Options::default()) {
        add(Severity::Error, model.name.clone(), error.to_string());
    }
    for (index, body) in model.bodies.iter().enumerate() {
        let has_links = model.arm.as_ref().is_some_and(|arm| arm.moves(index));
        if !has_links && !model.elements.iter().any(|e| e.between.contains(&Some(index))) && !model.inputs.iter().any(|i| i.on == index) {
            add(Severity::Warning, format!("bodies.{}", body.name), "nothing is tied to this body and nothing drives it".into());
        }
    }
    for element in &model.elements {
        if let Some(message) = active(&element.law, at, &super::units::unit_for(model.motion, "m")) {
            add(Severity::Warning, format!("elements.{}", element.name), message);
        }
    }
    for remark in model.arm.iter().flat_map(|arm| &arm.remarks).filter(|remark| remark.matters) {
        add(Severity::Note, "robot file".into(), remark.to_string());
    }
    if model.inputs.is_empty() {
        add(Severity::Warning, "inputs".into(), "nothing drives this model".into());
    }
    if model.outputs.is_empty() {
        add(Severity::Warning, "outputs".into(), "nothing is measured".into());
    }
    for axis in &model.axes {
        let about = format!("axes.{}", axis.name);
        if axis.travel.is_none() {
            add(Severity::Note, about.clone(), "no travel is given, so a run cannot detect that the hand left it".into());
        }
        let is_force = model.inputs.get(axis.feedback).is_some_and(|i| i.kind == crate::model::InputKind::Force);
        if is_force && axis.force.is_none() {
            add(Severity::Note, about, "no largest force is given, so the motor's force is not clamped".into());
        }
    }
    if let Ok(linear) = LinearModel::new(model, at) {
        for pole in linear.poles().unwrap_or_default() {
            if pole.damping_ratio() < -1e-9 {
                let message =
                    format!("a motion about rest grows, at {:.4} Hz with damping ratio {:.4}", pole.frequency_hz(), pole.damping_ratio());
                add(Severity::Warning, model.name.clone(), message);
            }
        }
        let loose = linear.modes().unwrap_or_default().iter().filter(|m| m.omega_squared == 0.0).count();
        if loose > 0 {
            let message = format!("{loose} motion(s) without restraint: a free device needs a grip or a controller");
            add(Severity::Note, model.name.clone(), message);
        }
    }
    remarks.sort_by_key(|r| std::cmp::Reverse(r.severity));
    remarks
}

/// Why an element may create energy, if it may.
fn active(law: &Law, at: &Operating, unit: &str) -> Option<String> {
    match law.role() {
        Role::Linear(linear) if linear.damping < 0.0 => Some(format!("creates energy: its damping is {}", linear.damping)),
        Role::Linear(linear) if linear.stiffness < 0.0 => Some(format!("drives away from rest: its stiffness is {}", linear.stiffness)),
        Role::Linear(_) | Role::Friction => None,
        Role::Path => law.creates_energy(at.amplitude, unit),
    }
}
