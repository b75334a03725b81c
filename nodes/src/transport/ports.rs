//! What a transport does: it makes publishers and subscribers, and waits.

use super::error::TransportError;
use backdrive_msgs::Message;
use backdrive_msgs::topic::{Kind, Topic};
use std::time::Duration;

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
    /// Between processes and threads of one machine that is when its publisher put it into the receiver's queue. Nothing is on its way in between,
    /// and it does not depend on when the receiver looks. From another host it is when the middleware took it in.
    fn arrived_ns(&self) -> i64;

    /// Whether the topic has its publisher now.
    fn has_publisher(&self) -> bool;

    /// Whether [`Transport::wait`] is to return for it; so from the start where it wakes at all. What arrives meanwhile is kept as always, only
    /// without waking a receiver.
    fn set_awaited(&mut self, _awaited: bool) {}

    /// Messages that were refused because their sender is not of this run.
    fn refused(&self) -> u64 {
        0
    }

    /// Before the start: who else sends on the topic, if somebody does.
    fn stranger(&mut self) -> Option<TransportError> {
        None
    }

    /// Messages that came after a later one and were dropped. Each is a hole in the sequence numbers as well.
    fn late(&self) -> u64 {
        0
    }
}

/// How many messages of a kind a transport keeps for a subscriber that is behind, and how many of
/// the past for one that joins late.
///
/// 4096 covers a recorder that polls every 10 ms and is itself held up for 50 ms while a lockstep graph does 40 000 steps a second. In lockstep the
/// recorder's credit bounds it at any rate.
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
