//! Why a node cannot go on.

use crate::transport::TransportError;

/// Why a node cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A transport does not do what it must.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Somebody who is not of the run sends on one of its topics before it begins.
    #[error("{0}; end that first, or choose another ROS domain with --domain")]
    Taken(TransportError),
    /// Lockstep: an input has not come.
    #[error("step {step}: nothing on {} within {timeout_s} s; has its node stopped?", topics.join(", "))]
    PeerTimeout {
        /// The step that could not be done.
        step: u64,
        /// What it waits for.
        topics: Vec<String>,
        /// How long it waited, s.
        timeout_s: f64,
    },
    /// Lockstep: samples were lost on the way, so the run differs from its graph.
    #[error("step {step}: {lost} samples lost on {topic}")]
    Lost {
        /// The step at which it was seen.
        step: u64,
        /// Where.
        topic: String,
        /// How many.
        lost: u64,
    },
    /// The plan cannot be run.
    #[error("node `{node}`: {reason}")]
    Plan {
        /// The node.
        node: String,
        /// What is wrong.
        reason: String,
    },
    /// A device cannot be opened, or fails a check.
    #[error("node `{node}`: {reason}")]
    Device {
        /// The node.
        node: String,
        /// What is wrong.
        reason: String,
    },
    /// A recording lacks messages.
    #[error("{lost} messages lost; the bag lists their topics")]
    Incomplete {
        /// How many.
        lost: u64,
    },
    /// A bag cannot be written.
    #[error("{0}")]
    Bag(String),
}

impl RunError {
    /// The exit code that belongs to it: 3 bad input, 4 lost data, 5 the run broke down.
    pub fn code(&self) -> u8 {
        match self {
            RunError::Plan { .. } => 3,
            RunError::Lost { .. } | RunError::Incomplete { .. } => 4,
            RunError::Device { .. } | RunError::Transport(_) | RunError::Taken(_) | RunError::PeerTimeout { .. } | RunError::Bag(_) => 5,
        }
    }
}
