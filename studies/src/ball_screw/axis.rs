//! The axis with each of its frictions, and what all figures share.

use crate::StudyError;
use crate::error::failed;
use crate::papers::device;
use crate::run::read;
use backdrive_control::controller::AxisModel;
use backdrive_plant::elements::{Law, kind_named};
use backdrive_plant::model::Model;

pub(super) const PAPER: &str = "Choi, Han & Kim 2006";
pub(super) const FILE: &str = "ball-screw-preisach.toml";
/// mm of the carriage per rad of the screw, of a lead of 5 mm (chosen).
pub(super) const MM: f64 = 5.0 / std::f64::consts::TAU;

/// Which friction an axis has.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Friction {
    Lugre,
    Literal,
    Gated,
}

impl Friction {
    pub(super) const ALL: [Friction; 3] = [Friction::Lugre, Friction::Literal, Friction::Gated];

    pub(super) fn name(self) -> &'static str {
        match self {
            Friction::Lugre => "LuGre",
            Friction::Literal => "eqs (4)-(6) as printed",
            Friction::Gated => "gated",
        }
    }
}

/// The axis of the project with one of the friction laws; all have the same numbers where they have the same ones.
pub(super) fn axis(friction: Friction) -> Result<Model, StudyError> {
    let mut model = Model::from_toml(&read(&device(FILE))?, FILE)?;
    let element = model.elements.iter_mut().find(|e| matches!(e.law, Law::PreisachLugre(_)));
    let element = element.ok_or_else(|| failed(format!("{FILE} has no preisach_lugre")))?;
    let mut values = element.law.values();
    let kind = match friction {
        Friction::Gated => return Ok(model),
        Friction::Literal => {
            if let Some(gate) = values.last_mut() {
                *gate = vec![0.0];
            }
            element.law.kind()
        }
        Friction::Lugre => {
            values.truncate(5);
            kind_named("lugre").ok_or_else(|| failed("there is no kind lugre"))?
        }
    };
    element.law = (kind.build)(&values).map_err(failed)?;
    Ok(model)
}

/// The friction alone, to be moved by hand.
pub(super) fn rubbing(friction: Friction) -> Result<AxisModel, StudyError> {
    AxisModel::new(&axis(friction)?, 0).map_err(failed)
}
