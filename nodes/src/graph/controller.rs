//! Keys of a controller: which law, and its gains.

use backdrive_control::controller::{AxisModel, Feedforward, Law, Settings, backstepping, pd, sliding_mode};
use backdrive_plant::elements::Range;
use backdrive_plant::model::Model;
use backdrive_plant::tomlfile::{FileError, Table};
use std::f64::consts::TAU;

/// What `law` may be.
#[derive(Clone, Copy)]
enum Which {
    Pd,
    SlidingMode,
    Backstepping,
}

const LAWS: &[(&str, Which)] = &[("pd", Which::Pd), ("sliding_mode", Which::SlidingMode), ("backstepping", Which::Backstepping)];

/// Reads `law` and its gains. With `bandwidth_hz` in their place, the gains of a law are those that give an axis without friction two poles
/// there: so laws are compared at the same bandwidth.
pub(super) fn read(table: &mut Table, model: Option<&Model>) -> Result<Settings, FileError> {
    let which = table.need_one_of("law", LAWS)?;
    if model.is_none() && !matches!(which, Which::Pd) {
        return Err(table.error_at("law", "needs model = \"...\": what the controller knows of the slave's inertia and friction"));
    }
    let known = model.map(|m| AxisModel::new(m, 0)).transpose().map_err(|e| table.error_at("model", e.to_string()))?;
    let bandwidth = table.number("bandwidth_hz", Range::Positive)?.map(|hz| TAU * hz);
    let law = match which {
        Which::Pd => {
            let inertia = known.as_ref().map(|k| k.inertia);
            let gains = match (bandwidth, inertia) {
                (Some(_), None) => {
                    return Err(table.error_at("bandwidth_hz", "needs a model, for the inertia; or give stiffness and damping"));
                }
                (Some(w), Some(inertia)) => pd::Gains { stiffness: inertia * w * w, damping: 2.0 * inertia * w },
                (None, _) => pd::Gains {
                    stiffness: table.need_number("stiffness", Range::NonNegative)?,
                    damping: table.need_number("damping", Range::NonNegative)?,
                },
            };
            let feedforward = feedforward(table)?;
            if feedforward == Feedforward::Friction && known.is_none() {
                return Err(table.error_at("friction", "feedforward needs a model, for the friction"));
            }
            Law::Pd(gains, feedforward)
        }
        Which::SlidingMode => {
            let (surface, reaching) = match bandwidth {
                Some(w) => (w, w),
                None => (table.need_number("surface", Range::NonNegative)?, table.need_number("reaching", Range::NonNegative)?),
            };
            let (switching, boundary) = switching(table)?;
            Law::SlidingMode(sliding_mode::Gains { surface, reaching, switching, boundary }, feedforward(table)?)
        }
        Which::Backstepping => {
            let (surface, stabilising, reaching) = match bandwidth {
                Some(w) => (0.5 * w, 0.5 * w, w),
                None => (
                    table.need_number("surface", Range::NonNegative)?,
                    table.need_number("stabilising", Range::NonNegative)?,
                    table.need_number("reaching", Range::NonNegative)?,
                ),
            };
            let (switching, boundary) = switching(table)?;
            let adaptation = match table.numbers("adaptation", Range::NonNegative)? {
                None => [0.0; 3],
                Some(list) => <[f64; 3]>::try_from(list).map_err(|list| {
                    table.error_at("adaptation", format!("expected three numbers, for σ0, σ1 and σ12, found {}", list.len()))
                })?,
            };
            let start = table.number_or("start", Range::NonNegative, 1.0)?;
            Law::Backstepping(backstepping::Gains { surface, stabilising, reaching, switching, boundary, adaptation, start })
        }
    };
    let settings = Settings {
        law,
        reference_hz: table.number_or("reference_hz", Range::Positive, 50.0)?,
        velocity_hz: table.number_or("velocity_hz", Range::Positive, 100.0)?,
    };
    // What the law needs of the model is found out here, where the line is known.
    if let Err(error) = backdrive_control::controller::Working::new(&settings.law, known.as_ref()) {
        return Err(table.error_at("law", error.to_string()));
    }
    Ok(settings)
}

fn feedforward(table: &mut Table) -> Result<Feedforward, FileError> {
    Ok(table.one_of("friction", &[("none", Feedforward::None), ("feedforward", Feedforward::Friction)])?.unwrap_or_default())
}

/// `switching` and `boundary`.
fn switching(table: &mut Table) -> Result<(f64, f64), FileError> {
    Ok((table.number_or("switching", Range::NonNegative, 0.0)?, table.number_or("boundary", Range::NonNegative, 0.0)?))
}
