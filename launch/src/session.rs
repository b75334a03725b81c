//! Who a run is on the network: its name, the key of its messages, and what it shares with its other hosts.

use crate::error::LaunchError;
use crate::paths::RunPaths;
use crate::plan::Plan;
use backdrive_nodes::transport::ros2::{Key, Known, Member};
use std::path::PathBuf;

/// Who a run is on the network.
#[derive(Debug, Clone)]
pub(crate) struct Session {
    /// Information for the processes of the run, and its place.
    pub known: Known,
    pub path: PathBuf,
    /// Differs from one start to the next, whatever the clock and the process ids say: what an earlier run has sent is worth nothing.
    pub nonce: String,
    /// Shared by the hosts; unused on one host.
    pub secret: Key,
}

impl Session {
    /// A new one for each start of a run.
    pub fn begin(plan: &Plan, paths: &RunPaths) -> Result<Session, LaunchError> {
        let fresh = || Key::fresh().map_err(|reason| LaunchError::Runtime { what: "random numbers", reason });
        let nonce = fresh()?.to_hex()[..32].to_string();
        let several = plan.hosts.len() > 1;
        let secret = match &plan.place.secret {
            Some(secret) => secret.clone(),
            None if several => return Err(LaunchError::NoSecret),
            None => fresh()?,
        };
        let own = Session::member(&secret, paths.id(), &nonce);
        Ok(Session { known: Known { own, several, others: Vec::new() }, path: paths.identity(), nonce, secret })
    }

    /// The messages of a run on any of the hosts that share this secret.
    pub fn member(secret: &Key, run: &str, nonce: &str) -> Member {
        Member { run: run.to_string(), key: secret.derive("backdrive messages 1", &[run, nonce]) }
    }

    /// The key of what supervisors say to each other.
    pub fn talk_key(&self) -> Key {
        self.secret.derive("backdrive hosts 1", &[])
    }
}
