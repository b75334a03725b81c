//! `backdrive device find`: what answers on a port.

use crate::failure::{Failure, code};
use crate::{cli, output};
use backdrive_devices::file::Protocol;
use backdrive_devices::find::{USUAL_BAUDS, find as find_on, ports};
use std::ops::RangeInclusive;

/// Lists what answers, or the ports.
pub fn find(options: &cli::DeviceFind) -> Result<u8, Failure> {
    let Some(port) = &options.port else {
        let ports = ports();
        if options.json {
            output::json(&ports)?;
        } else if ports.is_empty() {
            output::line("no serial port is here; plug the adapter in, or name a port: `backdrive device find /dev/ttyUSB0`")?;
        } else {
            ports.iter().try_for_each(|port| output::line(port.display()))?;
        }
        return Ok(if ports.is_empty() { code::NEGATIVE } else { 0 });
    };
    let (protocols, bauds) = (protocols(options.protocol.as_deref())?, options.baud.map_or(USUAL_BAUDS.to_vec(), |baud| vec![baud]));
    let found = find_on(port, &protocols, &bauds, ids(&options.ids)?).map_err(Failure::machine)?;
    if options.json {
        let each = found.iter().map(|f| {
            let answers: Vec<_> = f.answers.iter().map(|who| serde_json::json!({ "id": who.id, "model": who.model })).collect();
            serde_json::json!({ "protocol": f.protocol.name(), "baud": f.baud, "answers": answers })
        });
        output::json(&each.collect::<Vec<_>>())?;
    } else if found.is_empty() {
        output::line(format!(
            "nothing answers on {} with ids {}; check power and wiring, or try more ids (--ids 0..252)",
            port.display(),
            options.ids
        ))?;
    }
    for bus in found.iter().filter(|_| !options.json) {
        for who in &bus.answers {
            let model = who.model.map_or(String::new(), |model| format!(", model {model}"));
            output::line(format!("{} at {} baud: id {}{model}", bus.protocol.name(), bus.baud, who.id))?;
        }
    }
    Ok(if found.is_empty() { code::NEGATIVE } else { 0 })
}

/// The protocol of this name, or all.
pub fn protocols(name: Option<&str>) -> Result<Vec<Protocol>, Failure> {
    let known = || Protocol::ALL.iter().map(|(name, _)| *name);
    match name {
        None => Ok(Protocol::ALL.iter().map(|(_, protocol)| *protocol).collect()),
        Some(name) => match Protocol::ALL.iter().find(|(known, _)| *known == name) {
            Some((_, protocol)) => Ok(vec![*protocol]),
            None => {
                let message = backdrive_plant::tomlfile::unknown("protocol", name, known().collect::<Vec<_>>());
                Err(Failure { code: code::USAGE, message: format!("--protocol: {message}") })
            }
        },
    }
}

/// `FIRST..LAST`, both included.
pub fn ids(text: &str) -> Result<RangeInclusive<u32>, Failure> {
    let wrong = || Failure { code: code::USAGE, message: format!("--ids {text}: expected FIRST..LAST such as 1..6, at most 0..2047") };
    let (first, last) = text.split_once("..").ok_or_else(wrong)?;
    match (first.trim().parse::<u32>(), last.trim().parse::<u32>()) {
        (Ok(first), Ok(last)) if first <= last && last <= 2047 => Ok(first..=last),
        _ => Err(wrong()),
    }
}
