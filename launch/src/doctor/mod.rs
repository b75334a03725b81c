//! What of this machine would hurt a run: shared memory, real-time rights, timers, processors, network and clock.

mod finding;
mod machine;
mod net;

pub use finding::{Finding, Grade};

use backdrive_nodes::transport::ros2::Network;
use std::time::Duration;

/// What is looked at.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The network over which runs meet.
    pub network: Network,
    /// How long to listen for other hosts.
    pub listen: Duration,
}

/// Looks at all of it.
pub fn look(options: &Options) -> Vec<Finding> {
    let mut findings = machine::look();
    findings.extend(net::look(&options.network, options.listen.as_secs_f64()));
    findings
}
