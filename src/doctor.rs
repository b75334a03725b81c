//! `backdrive doctor`: what of this machine would hurt a run.

use crate::failure::{Failure, code};
use crate::{cli, output};
use backdrive_devices::file::DeviceFile;
use backdrive_devices::start::{checked, open};
use backdrive_devices::survey::{Survey, survey};
use backdrive_launch::asked::network;
use backdrive_launch::doctor::{Grade, Options, look};
use std::path::Path;
use std::time::Duration;

/// A device's name, and its bus, after the checks of its start.
fn measured(path: &Path) -> Result<(String, Survey), Failure> {
    let file = DeviceFile::load(path)?;
    let mut bus = open(&file).map_err(Failure::machine)?;
    checked(bus.as_mut(), &file).map_err(Failure::machine)?;
    Ok((file.name, survey(bus.as_mut(), Duration::from_secs(1)).map_err(Failure::machine)?))
}

/// Prints what was found. Exit code 0 unless something is bad, then 5.
pub fn doctor(asked: &cli::Doctor) -> Result<u8, Failure> {
    let listen = Duration::try_from_secs_f64(asked.listen_s).unwrap_or_default();
    let device = asked.device.as_deref().map(measured).transpose()?;
    let findings = look(&Options { network: network(&asked.network.asked())?, listen });
    if asked.json {
        let device =
            device.iter().map(|(name, found)| serde_json::json!({ "part": "device", "grade": "fine", "device": name, "bus": found }));
        let findings = findings.iter().map(|finding| serde_json::json!(finding));
        output::json(&findings.chain(device).collect::<Vec<_>>())?;
    } else {
        findings.iter().try_for_each(output::line)?;
        device.iter().try_for_each(|(name, found)| output::line(format!("fine  {:<14} {found}", format!("device {name}"))))?;
    }
    Ok(if findings.iter().any(|f| f.grade == Grade::Bad) { code::MACHINE } else { 0 })
}
