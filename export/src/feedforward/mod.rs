//! Feed-forward of a joint's friction for a controller: one function of position, velocity and load for each body that has something to ground.

mod code;
mod terms;
mod yaml;

pub use terms::{Joint, Term};

use crate::{ExportError, Exported, of_robot};
use backdrive_plant::model::Model;

/// What the snippet is written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Language {
    /// C99.
    #[default]
    C,
    /// Python 3.
    Python,
    /// Numbers and equations.
    Yaml,
}

impl Language {
    /// Each with its word.
    pub const ALL: [(&str, Language); 3] = [("c", Language::C), ("python", Language::Python), ("yaml", Language::Yaml)];
}

/// The snippet. `width` is that of the smooth sign tanh(dq/width), m/s or rad/s; `None` for 1 mm/s or 10 mrad/s, and at most a fifth of the speed within
/// which friction falls.
///
/// # Errors
/// Where nothing can be compensated.
pub fn export(model: &Model, language: Language, width: Option<f64>) -> Result<Exported, ExportError> {
    let (joints, mut left_out) = terms::joints(model, width);
    if joints.is_empty() {
        return Err(ExportError::new(
            "it has nothing to compensate: no friction, damper, spring, cogging or bias acts between a body and ground",
        ));
    }
    let text = match language {
        Language::C => code::c(model, &joints),
        Language::Python => code::python(model, &joints),
        Language::Yaml => yaml::yaml(model, &joints),
    };
    left_out.extend(of_robot(model)?);
    let mut notes = Vec::new();
    if model.arm.is_some() {
        notes.push(
            "the links' own gravity and inertia are not in it: they depend on the pose, and the controller's model of the arm has them"
                .to_owned(),
        );
    }
    if joints.iter().any(|j| j.terms.iter().any(|(_, _, term)| matches!(term, Term::Load { .. }))) {
        notes.push(
            "friction grows with the load: hand in the force that the joint passes on, measured or from the controller's model".to_owned(),
        );
    }
    Ok(Exported { text, left_out, notes })
}
