use std::path::PathBuf;

/// Why a run cannot start. An error after the start is reported by [`crate::RunReport::cause`].
#[derive(Debug, thiserror::Error)]
pub enum LaunchError {
    /// The directory of the run cannot be made, read or removed.
    #[error("{path}: cannot {action}: {reason}; {advice}", path = path.display())]
    RunDir {
        /// The file or directory.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's message.
        reason: String,
        /// What to do.
        advice: &'static str,
    },
    /// Shared memory cannot be used.
    #[error("{path}: shared memory {reason}; {advice}", path = path.display())]
    SharedMemory {
        /// Usually `/dev/shm`.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
        /// What to do.
        advice: String,
    },
    /// The graph has nothing to run.
    #[error("the graph has no nodes; add a [[node]]")]
    NoNodes,
    /// A process cannot be started.
    #[error("node `{node}`: cannot start `{program}`: {reason}; check that the program exists and may be executed")]
    Spawn {
        /// Name of the node.
        node: String,
        /// The program.
        program: String,
        /// The system's message.
        reason: String,
    },
    /// Signal handlers or timers cannot be set up.
    #[error("cannot watch for {what}: {reason}")]
    Runtime {
        /// Such as `SIGINT`.
        what: &'static str,
        /// The system's message.
        reason: String,
    },
    /// Some nodes did not find each other in time.
    #[error("not ready after {after_s:.1} s:\n  {}", missing.join("\n  "))]
    NotReady {
        /// The time-out, s.
        after_s: f64,
        /// One line per node that was not ready: its name and what it misses.
        missing: Vec<String>,
    },
    /// A node ended before the run began.
    #[error("node `{node}` {how} before the run began{}", tail(stderr))]
    DiedAtStart {
        /// Name of the node.
        node: String,
        /// Such as `ended with exit code 1`.
        how: String,
        /// Its last lines on standard error.
        stderr: Vec<String>,
    },
    /// A node reported before the run began that it cannot do its work.
    #[error("node `{node}`: {error}")]
    NodeFailed {
        /// Name of the node.
        node: String,
        /// Its words.
        error: String,
        /// Exit code that it asks for.
        code: u8,
    },
    /// The other hosts of a run cannot be looked for.
    #[error("cannot look for the other hosts: {reason}")]
    Network {
        /// The network's message.
        reason: String,
    },
    /// Another run on this machine speaks for a node in the same ROS domain.
    #[error(
        "ROS domain {domain}: another run on this machine uses it too, as node `{node}`; end that first, or choose another ROS domain \
            with --domain"
    )]
    DomainTaken {
        /// The domain.
        domain: u16,
        /// Name of the node.
        node: String,
    },
    /// The hosts of a run have nothing to know each other by.
    #[error(
        "hosts know each other by a shared secret: make one with `backdrive secret run.secret`, copy it to each host, and add --secret run.secret"
    )]
    NoSecret,
    /// Stopped before the run began.
    #[error("stopped by {by} before the run began")]
    Stopped {
        /// Such as `SIGINT`.
        by: String,
    },
}

/// Last lines of a node, indented below the sentence about it.
pub(crate) fn tail(lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    format!("; its last words:\n  {}", lines.join("\n  "))
}
