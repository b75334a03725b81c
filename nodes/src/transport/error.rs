//! What can go wrong in a transport.

use backdrive_msgs::Message;
use backdrive_msgs::topic::Topic;

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
        /// The middleware's message, and what to do.
        reason: String,
    },
    /// A message cannot be sent or received.
    #[error("{topic}: {reason}")]
    Broken {
        /// The topic.
        topic: String,
        /// The middleware's message.
        reason: String,
    },
    /// Somebody who is not of this run sends on the topic; nothing of it was taken.
    #[error("{topic}: {who}, messages refused: {refused}")]
    Stranger {
        /// The topic.
        topic: String,
        /// Who, as far as it can be known.
        who: String,
        /// Messages of strangers on this topic that were refused until now.
        refused: u64,
        /// Whether what the topic carries moves something.
        moves: bool,
    },
    /// The transport itself cannot start.
    #[error("{0}")]
    Start(String),
}

/// Refuses a message that another version of the software laid out.
pub(super) fn check_layout(topic: &str, message: &Message) -> Result<(), TransportError> {
    backdrive_msgs::check_layout(message.layout()).map_err(|e| TransportError::Broken { topic: topic.to_string(), reason: e.to_string() })
}

/// A message of the wrong kind was to be sent.
pub(super) fn wrong_kind(topic: &Topic, message: &Message) -> TransportError {
    TransportError::Broken { topic: topic.name.clone(), reason: format!("carries {:?}, not {:?}", topic.kind, message.kind()) }
}
