//! An identified bench as the files that a graph takes.

use crate::Identified;
use backdrive_control::engine::Ripple;
use backdrive_nodes::graph::bench::{EngineFile, dynamometer_to_toml};
use backdrive_plant::model::Model;
use backdrive_plant::tomlfile::FileError;

/// The shaft that is written: its structure.
const SHAFT: &str = include_str!("../../plant/models/engine-test-bench.toml");

/// Name and text of each file.
///
/// # Errors
/// The structure of the shaft does not take the identified parameters.
pub fn files(found: &Identified) -> Result<[(&'static str, String); 3], FileError> {
    // Combustion's ripple is above what the observer passes on.
    let engine = EngineFile { engine: found.bench.engine.clone(), ripple: Ripple { per_revolution: 0.0, share: 0.0 } };
    let mut shaft = Model::from_toml(SHAFT, "the shaft")?;
    let numbers = &found.bench.shaft;
    (shaft.name, shaft.title) = ("engine-test-bench-identified".to_string(), "Combustion engine test bench, identified".to_string());
    shaft.source = "identified by backdrive test-bench".to_string();
    for (path, number) in [
        ("bodies.engine", numbers.engine),
        ("bodies.dyno", numbers.dynamometer),
        ("elements.shaft.stiffness", numbers.stiffness),
        ("elements.shaft_damping.damping", numbers.damping),
    ] {
        shaft.set_values_at(path, &[number]).map_err(|e| FileError::whole("the shaft", e.to_string()))?;
    }
    Ok([
        ("engine.toml", engine.to_toml("Engine, identified")),
        ("dynamometer.toml", dynamometer_to_toml(&found.bench.dynamometer, "Dynamometer, identified")),
        ("shaft.toml", shaft.to_toml()),
    ])
}
