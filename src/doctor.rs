//! `backdrive doctor`: what of this machine would hurt a run.

use crate::failure::{Failure, code};
use crate::{cli, output};
use backdrive_launch::asked::network;
use backdrive_launch::doctor::{Grade, Options, look};
use std::time::Duration;

/// Prints what was found. Exit code 0 unless something is bad, then 5.
pub fn doctor(asked: &cli::Doctor) -> Result<u8, Failure> {
    let listen = Duration::try_from_secs_f64(asked.listen_s).unwrap_or_default();
    let findings = look(&Options { network: network(&asked.network.asked())?, listen });
    if asked.json {
        output::json(&findings)?;
    } else {
        findings.iter().try_for_each(output::line)?;
    }
    Ok(if findings.iter().any(|f| f.grade == Grade::Bad) { code::MACHINE } else { 0 })
}
