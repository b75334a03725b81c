//! What answers on a port.

use crate::bus::{BusError, Identity};
use crate::file::{DeviceFile, Joint, Protocol, Takes};
use crate::start::open;
use std::path::{Path, PathBuf};

/// A bus with somebody on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// What it speaks.
    pub protocol: Protocol,
    /// Its baud rate.
    pub baud: u32,
    /// Who answers, by id.
    pub answers: Vec<Identity>,
}

/// Baud rates at which servos come, the most usual first.
pub const USUAL_BAUDS: [u32; 6] = [1_000_000, 57_600, 115_200, 500_000, 2_000_000, 3_000_000];

/// A device with a joint of each id, which is only read.
pub fn only_read(port: &Path, protocol: Protocol, baud: u32, ids: impl Iterator<Item = u32>) -> DeviceFile {
    let joint = |id: u32| Joint {
        name: format!("id{id}"),
        id,
        model: None,
        takes: Takes::Nothing,
        zero: 0.0,
        per_count: 1.0,
        range: [f64::NEG_INFINITY, f64::INFINITY],
        speed: None,
        effort: None,
        stiffness: None,
        damping: None,
        torque_constant: None,
        current_signed: false,
        current_limit: None,
        temperature_limit: None,
        spans: [12.5, 30.0, 10.0],
    };
    let name = "found".to_string();
    // A servo on a pty or a slow adapter needs a few ms.
    DeviceFile {
        name,
        protocol,
        port: port.to_path_buf(),
        baud,
        timeout_s: 0.004,
        retries: 1,
        ramp_s: 0.0,
        joints: ids.map(joint).collect(),
    }
}

/// Asks every id who it is.
///
/// # Errors
/// The port cannot be opened, or is gone.
pub fn who_is_there(port: &Path, protocol: Protocol, baud: u32, ids: impl Iterator<Item = u32>) -> Result<Vec<Identity>, BusError> {
    let file = only_read(port, protocol, baud, ids);
    let mut bus = open(&file)?;
    let mut found = Vec::new();
    for index in 0..file.joints.len() {
        match bus.identify(index) {
            Ok(identity) => found.push(identity),
            Err(BusError::Silent { .. }) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(found)
}

/// Tries protocols and baud rates until somebody answers.
///
/// # Errors
/// The port cannot be opened at any of them.
pub fn find(port: &Path, protocols: &[Protocol], bauds: &[u32], ids: std::ops::RangeInclusive<u32>) -> Result<Vec<Found>, BusError> {
    let (mut found, mut refused, mut opened) = (Vec::new(), None, false);
    for protocol in protocols {
        for baud in bauds {
            match who_is_there(port, *protocol, *baud, ids.clone()) {
                Ok(answers) => {
                    opened = true;
                    if !answers.is_empty() {
                        found.push(Found { protocol: *protocol, baud: *baud, answers });
                        break;
                    }
                }
                Err(error) => refused = Some(error),
            }
        }
    }
    match refused {
        Some(error) if !opened => Err(error),
        _ => Ok(found),
    }
}

/// Serial ports of this machine, by their lasting names where they have some.
pub fn ports() -> Vec<PathBuf> {
    let in_folder = |folder: &str, wanted: &dyn Fn(&str) -> bool| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.filter(|e| wanted(&e.file_name().to_string_lossy())).map(|e| e.path()).collect::<Vec<PathBuf>>()
    };
    let mut ports = in_folder("/dev/serial/by-id", &|_| true);
    if ports.is_empty() {
        ports = in_folder("/dev", &|name| ["ttyUSB", "ttyACM", "ttyAMA"].iter().any(|known| name.starts_with(known)));
    }
    ports.sort();
    ports
}
