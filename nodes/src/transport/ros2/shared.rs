//! What a node's ports have in common.

use super::super::TransportError;
use super::super::bell::Bell;
use super::clock::ClockWatch;
use super::delivery::Delivery;
use super::identity::Identity;
use super::inbox::Inboxes;
use super::network::Network;
use super::participant::Participant;
use backdrive_msgs::topic::Topic;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the ports of a node that ends wait together until what they sent is acknowledged.
const LINGER: Duration = Duration::from_secs(5);

/// And then until it is taken over: what is still in the middleware when its writer goes is gone with it. Best effort has
/// no acknowledgement; for it this is the time in which a sample leaves this host.
pub(super) const FLUSH: Duration = Duration::from_millis(100);

/// What a node's ports have in common.
pub(super) struct Shared {
    pub(super) name: String,
    pub(super) network: Network,
    pub(super) delivery: Delivery,
    /// Whose messages it takes; anybody's where it belongs to no run.
    pub(super) identity: Option<Identity>,
    pub(super) axes: HashMap<String, Vec<String>>,
    pub(super) participant: RefCell<Arc<Participant>>,
    /// Counts the participants that this node has had; a port of an earlier one recreates itself.
    pub(super) life: Cell<u32>,
    pub(super) watch: RefCell<ClockWatch>,
    pub(super) bell: Arc<Bell>,
    pub(super) kinds: RefCell<HashMap<String, Topic>>,
    /// What this node's subscribers have, so that all take over whenever the node waits for one.
    pub(super) inboxes: Arc<Inboxes>,
    /// When the ports that end stop waiting for acknowledgements.
    pub(super) linger_until: Cell<Option<Instant>>,
    /// Whether a port that ends has waited until all is taken over.
    pub(super) flushed: Cell<bool>,
}

impl Shared {
    pub(super) fn participant(&self) -> Arc<Participant> {
        Arc::clone(&self.participant.borrow())
    }

    /// A topic carries one kind, on this node at least.
    pub(super) fn claim(&self, topic: &Topic, action: &'static str) -> Result<(), TransportError> {
        let mut kinds = self.kinds.borrow_mut();
        match kinds.get(&topic.name) {
            Some(other) if other.kind != topic.kind => {
                let reason = format!("it carries {:?}, not {:?}", other.kind, topic.kind);
                Err(TransportError::Open { topic: topic.name.clone(), action, reason })
            }
            _ => {
                kinds.insert(topic.name.clone(), topic.clone());
                Ok(())
            }
        }
    }

    /// The middleware orders best-effort samples by the wall clock, so it hears nothing while that has been set back; and
    /// its threads end when the process is stopped. A participant of after that hears again; it is made in the background.
    pub(super) fn watch_clock(&self) {
        let mut watch = self.watch.borrow_mut();
        if let Some(fresh) = watch.look(&self.network, &self.name) {
            let old = self.participant.replace(Arc::new(fresh));
            self.life.set(self.life.get() + 1);
            watch.retire(old);
        }
    }

    /// Remaining time to wait for acknowledgements.
    pub(super) fn linger(&self) -> Duration {
        let until = self.linger_until.get().unwrap_or_else(|| Instant::now() + LINGER);
        self.linger_until.set(Some(until));
        until.saturating_duration_since(Instant::now())
    }
}
