//! `backdrive device check`: the start-up checks, and a second of the bus beside what its wire allows.

use crate::failure::Failure;
use crate::output;
use backdrive_devices::file::DeviceFile;
use backdrive_devices::start::{checked, open};
use backdrive_devices::survey::survey;
use std::path::Path;
use std::time::Duration;

/// Checks a device and measures its bus.
pub fn check(path: &Path, port: Option<&Path>, json: bool) -> Result<u8, Failure> {
    let mut file = DeviceFile::load(path)?;
    if let Some(port) = port {
        file.port = port.to_path_buf();
    }
    let mut bus = open(&file).map_err(Failure::machine)?;
    let present = checked(bus.as_mut(), &file).map_err(Failure::machine)?;
    let found = survey(bus.as_mut(), Duration::from_secs(1)).map_err(Failure::machine)?;
    if json {
        let joints = file.joints.iter().zip(&present).map(|(joint, read)| {
            serde_json::json!({ "name": joint.name, "id": joint.id, "position": read.position, "current": read.current, "temperature": read.temperature })
        });
        let joints: Vec<_> = joints.collect::<Vec<_>>();
        output::json(&serde_json::json!({ "device": file.name, "joints": joints, "bus": found }))?;
        return Ok(0);
    }
    for (joint, read) in file.joints.iter().zip(&present) {
        let number = |value: Option<f64>, unit: &str| value.map_or("-".to_string(), |value| format!("{value:.3} {unit}"));
        output::line(format!(
            "joint     {:<14} id {:<3} at {}, {}, {}",
            joint.name,
            joint.id,
            number(read.position, "rad"),
            number(read.current, "A"),
            number(read.temperature, "degrees")
        ))?;
    }
    output::line(found)?;
    Ok(0)
}
