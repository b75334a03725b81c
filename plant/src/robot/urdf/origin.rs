//! Values of a URDF that may be left out.

use crate::elements::Range;
use crate::robot::spatial::Placement;
use crate::robot::xml::Element;
use crate::tomlfile::FileError;
use nalgebra::{Rotation3, Vector3};

/// `<origin xyz rpy>`; nothing is no shift and no turn.
pub(super) fn origin(element: Option<Element>) -> Result<Placement, FileError> {
    let Some(element) = element else { return Ok(Placement::default()) };
    let translation = element.vector("xyz")?.unwrap_or_else(Vector3::zeros);
    let turns = element.vector("rpy")?.unwrap_or_else(Vector3::zeros);
    Ok(Placement { rotation: *Rotation3::from_euler_angles(turns.x, turns.y, turns.z).matrix(), translation })
}

/// A number that may be left out.
pub(super) fn number_or(element: Option<Element>, name: &str, range: Range, default: f64) -> Result<f64, FileError> {
    Ok(element.map(|element| element.number(name, range)).transpose()?.flatten().unwrap_or(default))
}
