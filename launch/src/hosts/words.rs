//! What supervisors say to each other: JSON in a `std_msgs/String`, so that `ros2 topic echo` shows it; `sealed.rs` puts a tag beside it.

use serde::{Deserialize, Serialize};

/// When step 0 is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Begun {
    /// CLOCK_MONOTONIC of the receiving host, ns.
    pub t0_ns: i64,
    /// Wall clock of the first host at that moment, ns since the Unix epoch: stamps of all hosts count from it.
    pub unix_ns: i64,
}

/// From one supervisor to the others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "say", rename_all = "snake_case")]
pub(super) enum Say {
    /// How it is, five times a second.
    Hello {
        /// Distinguishes graphs.
        run: u64,
        /// The sender.
        host: String,
        /// Distinguishes programs that call themselves the same host.
        life: u64,
        /// All its nodes are connected.
        ready: bool,
        /// What they lack.
        missing: Vec<String>,
        /// When step 0 is due on its own clock, if it knows.
        begun: Option<Begun>,
        /// It ends.
        leaving: bool,
        /// Nonces of the others that it has heard: a receiver that reads its own there knows that this was sent after it began.
        heard: Vec<String>,
    },
    /// What is your clock?
    Ping {
        /// Who asks.
        from: String,
        /// Whom.
        to: String,
        /// When, on the asker's CLOCK_MONOTONIC, ns.
        at_ns: i64,
    },
    /// The answer.
    Pong {
        /// Who was asked.
        from: String,
        /// Who asked.
        to: String,
        /// As asked.
        at_ns: i64,
        /// CLOCK_MONOTONIC of whom was asked, ns.
        monotonic_ns: i64,
        /// Its wall clock, ns since the Unix epoch.
        unix_ns: i64,
    },
    /// Step 0 is due, on the clock of the receiver.
    Start {
        /// Whom.
        to: String,
        /// Which of its lives.
        life: u64,
        /// When.
        begun: Begun,
    },
}
