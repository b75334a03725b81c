//! Bounds: how large a change has to be to matter.

use crate::error::FleetError;
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::Table;
use std::collections::BTreeMap;
use std::path::Path;

/// How a bound is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Of {
    /// As a share of the old value.
    Share,
    /// In the quantity's SI unit.
    Unit,
    /// As a share of the old dry friction.
    Dry,
}

/// Every bound: key, how it is meant, default.
pub(super) const ALL: [(&str, Of, f64); 19] = [
    ("dry", Of::Share, 0.15),
    ("viscous", Of::Share, 0.25),
    ("inertia", Of::Share, 0.5),
    ("constant", Of::Dry, 0.5),
    ("gain", Of::Unit, 0.05),
    ("lag", Of::Unit, 0.003),
    ("delay", Of::Unit, 0.005),
    ("lost_motion", Of::Share, 0.15),
    ("stribeck", Of::Dry, 0.3),
    ("load_friction", Of::Dry, 0.3),
    ("drag", Of::Dry, 0.3),
    ("asymmetric", Of::Dry, 0.3),
    ("residual", Of::Share, 0.5),
    ("position_noise", Of::Share, 1.0),
    ("effort_noise", Of::Share, 0.75),
    ("position_step", Of::Share, 0.5),
    ("rate", Of::Share, 0.02),
    ("critical_gain", Of::Share, 0.1),
    ("gain_margin", Of::Share, 0.2),
];

/// Bounds for all joints, and for single joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bounds {
    all: BTreeMap<String, f64>,
    joints: BTreeMap<String, BTreeMap<String, f64>>,
}

impl Bounds {
    /// Reads a file: keys for all joints, and `[joints.NAME]` with keys for one of them. What it does not state has its default.
    ///
    /// # Errors
    /// The file cannot be read, or has a key that is no bound.
    pub fn open(path: &Path) -> Result<Bounds, FleetError> {
        let mut top = Table::open(path).map_err(FleetError::input)?;
        let mut bounds = Bounds { all: read(&mut top)?, joints: BTreeMap::new() };
        if let Some(mut joints) = top.table("joints").map_err(FleetError::input)? {
            for name in joints.keys() {
                if let Some(mut below) = joints.table(&name).map_err(FleetError::input)? {
                    bounds.joints.insert(name, read(&mut below)?);
                    below.finish().map_err(FleetError::input)?;
                }
            }
        }
        top.finish().map_err(FleetError::input)?;
        Ok(bounds)
    }

    /// The bound of a quantity at a joint, and how it is meant.
    pub(super) fn of(&self, joint: &str, quantity: &str) -> Option<(Of, f64)> {
        let (_, of, usual) = ALL.iter().find(|(name, ..)| *name == quantity)?;
        let own = self.joints.get(joint).and_then(|own| own.get(quantity)).or_else(|| self.all.get(quantity));
        Some((*of, own.copied().unwrap_or(*usual)))
    }
}

fn read(table: &mut Table) -> Result<BTreeMap<String, f64>, FleetError> {
    let mut out = BTreeMap::new();
    for (name, ..) in ALL {
        if let Some(bound) = table.number(name, Range::Positive).map_err(FleetError::input)? {
            out.insert(name.to_string(), bound);
        }
    }
    Ok(out)
}
