//! `backdrive doctor`: what of this machine would hurt a run.

mod finding;
mod machine;
mod net;

use crate::failure::{Failure, code};
use crate::network::network;
use crate::{cli, output};
use finding::{Finding, Grade};

/// Looks at shared memory, real-time rights, timers, processors, network and clock. Exit code 0 unless something is bad, then 5.
pub fn doctor(options: &cli::Doctor) -> Result<u8, Failure> {
    let network = network(&options.network)?;
    let mut findings = machine::look();
    findings.extend(net::look(&network, options.listen_s));
    if options.json {
        output::json(&findings)?;
    } else {
        findings.iter().try_for_each(output::line)?;
    }
    Ok(if findings.iter().any(|f| f.grade == Grade::Bad) { code::MACHINE } else { 0 })
}
