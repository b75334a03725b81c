//! How messages get from one node to another. An adapter per transport, one conformance suite for all.

mod bell;
mod board;
pub mod iceoryx2;
pub mod inproc;
pub mod ros2;

use backdrive_msgs::Message;
use backdrive_msgs::topic::{Kind, Topic};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Duration;

/// What can go wrong in a transport.
#[derive(Debug, thiserror::Error)]
pub enum TransportError {
    /// A publisher or subscriber cannot be made.
    #[error("{topic}: cannot {action}: {reason}")]
    Open {
        /// The topic.
        topic: String,
        /// `publish` or `subscribe`.
        action: &'static str,
        /// What the middleware says, and what to do.
        reason: String,
    },
    /// A message cannot be sent or received.
    #[error("{topic}: {reason}")]
    Broken {
        /// The topic.
        topic: String,
        /// What the middleware says.
        reason: String,
    },
    /// The transport itself cannot start.
    #[error("{0}")]
    Start(String),
}

/// Where the nodes of one run meet on this machine. Two runs with different locations never meet,
/// whatever their topics are called.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Location {
    /// Begins the name of everything that the run keeps in `/dev/shm`: letters, digits, `_` and `-`, at most 64.
    pub prefix: String,
    /// Directory of the run's other files. Absolute, and the run's own.
    pub root: PathBuf,
}

impl Location {
    /// Whether the prefix can be one.
    pub(crate) fn check(&self) -> Result<(), TransportError> {
        let valid = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if self.prefix.is_empty() || self.prefix.len() > 64 || !self.prefix.chars().all(valid) {
            return Err(TransportError::Start(format!(
                "`{}` cannot name a run: expected 1 to 64 letters, digits, `_` or `-`",
                self.prefix
            )));
        }
        Ok(())
    }

    /// Removes everything that the run has left. Only for a run of which no process lives any more.
    ///
    /// # Errors
    /// The prefix is not one, or a file of the run cannot be removed.
    pub fn remove(&self) -> Result<(), TransportError> {
        self.check()?;
        let failed = |path: &std::path::Path, e: std::io::Error| TransportError::Start(format!("cannot remove {}: {e}", path.display()));
        let absent = |e: &std::io::Error| e.kind() == std::io::ErrorKind::NotFound;
        if let Err(e) = std::fs::remove_dir_all(&self.root)
            && !absent(&e)
        {
            return Err(failed(&self.root, e));
        }
        let shm = PathBuf::from(board::SHM);
        let entries = std::fs::read_dir(&shm).map_err(|e| failed(&shm, e))?;
        for entry in entries.flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                match std::fs::remove_file(entry.path()) {
                    Err(e) if !absent(&e) => return Err(failed(&entry.path(), e)),
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

/// Where a node meets the others of its graph.
pub trait Transport {
    /// Makes the one publisher of a topic. `listeners` is the number of subscribers that the graph has for it.
    fn publisher(&mut self, topic: &Topic, listeners: usize) -> Result<Box<dyn Publisher>, TransportError>;

    /// Makes a subscriber that holds at least `depth` messages. With `wakes`, [`Transport::wait`] returns
    /// when one arrives; a subscriber that polls must not slow its publisher down.
    ///
    /// Samples that were sent before are not seen; of gains, events and status the last few are.
    fn subscriber(&mut self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError>;

    /// Waits until a message may have arrived at a waking subscriber since the last wait returned, or
    /// the time is over. It may return early.
    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError>;

    /// Clears up after nodes of the run that died without doing so. Cheap when there are none.
    fn sweep(&mut self) {}
}

/// Sends on one topic.
pub trait Publisher {
    /// Sends; never blocks. A subscriber that is too slow loses its oldest messages, which it sees by their sequence numbers.
    fn send(&mut self, message: &Message) -> Result<(), TransportError>;

    /// Number of subscribers now connected.
    fn listeners(&self) -> usize;
}

/// Receives on one topic.
pub trait Subscriber {
    /// The oldest message not yet received, if there is one. A message of another layout is an error.
    fn receive(&mut self) -> Result<Option<Message>, TransportError>;

    /// When the message that [`Subscriber::receive`] gave last came here, CLOCK_MONOTONIC, ns; 0 before the first.
    ///
    /// Between processes and threads of one machine that is when its publisher put it into the receiver's queue: nothing is on its
    /// way in between, and it does not depend on when the receiver looks. From another host it is when the middleware took it in.
    fn arrived_ns(&self) -> i64;

    /// Whether the topic has its publisher now.
    fn has_publisher(&self) -> bool;

    /// Whether [`Transport::wait`] is to return for it; so from the start where it wakes at all. What
    /// arrives meanwhile is kept as always, only nobody is woken for it.
    fn set_awaited(&mut self, _awaited: bool) {}

    /// Messages that came after a later one and were dropped. Each is a hole in the sequence numbers as well.
    fn late(&self) -> u64 {
        0
    }
}

/// How many messages of a kind a transport keeps for a subscriber that is behind, and how many of
/// the past for one that joins late.
///
/// 4096 covers a recorder that polls every 10 ms and is itself held up for 50 ms while a lockstep
/// graph does 40 000 steps a second; in lockstep the recorder's credit bounds it at any rate.
pub(crate) const fn capacity(kind: Kind) -> (usize, usize) {
    match kind {
        Kind::Sample => (4096, 0),
        Kind::Gains => (4096, 4),
        Kind::Event => (4096, 32),
        Kind::Status | Kind::Margin => (512, 2),
    }
}

/// Most subscribers that one topic has room for.
pub const MAX_LISTENERS: usize = 16;

/// Refuses a message that another version of the software laid out.
fn check_layout(topic: &str, message: &Message) -> Result<(), TransportError> {
    backdrive_msgs::check_layout(message.layout()).map_err(|e| TransportError::Broken { topic: topic.to_string(), reason: e.to_string() })
}

/// A message of the wrong kind was to be sent.
fn wrong_kind(topic: &Topic, message: &Message) -> TransportError {
    TransportError::Broken { topic: topic.name.clone(), reason: format!("carries {:?}, not {:?}", topic.kind, message.kind()) }
}

/// 64-bit FNV-1a, for names in shared memory; never 0.
pub(crate) fn name_hash(name: &str) -> u64 {
    let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    hash.max(1)
}
