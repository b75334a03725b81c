//! How messages get from one node to another. An adapter per transport, one conformance suite for all.

use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;
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

/// Where a node meets the others of its graph.
pub trait Transport {
    /// Makes the one publisher of a topic. `listeners` is the number of subscribers the graph has for
    /// it, `woken` those of them that wait for it rather than poll.
    fn publisher(&mut self, topic: &Topic, listeners: usize) -> Result<Box<dyn Publisher>, TransportError>;

    /// Makes a subscriber that holds at least `depth` messages. With `wakes`, [`Transport::wait`] returns
    /// when one arrives; a subscriber that polls must not slow its publisher down.
    fn subscriber(&mut self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError>;

    /// Waits until a message may have arrived at a waking subscriber, or the time is over. It may return early.
    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError>;
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
    /// The oldest message not yet received, if there is one.
    fn receive(&mut self) -> Result<Option<Message>, TransportError>;

    /// Whether the topic has its publisher now.
    fn has_publisher(&self) -> bool;
}
