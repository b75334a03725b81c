//! ROS 2 over DDS: the same graph between hosts, with standard messages that any ROS tool and any vendor's DDS sees.
//!
//! In lockstep everything is reliable, for nothing may be lost. In real time samples are best effort: a lost one is
//! never waited for, and a late one is dropped by its sequence number, since its successor is there; gains, events,
//! status and margin are reliable and their last few are kept for whoever joins late. The types on the wire are those
//! of [`backdrive_msgs::ros::live`].
//!
//! The middleware finds the others by multicast, and on one host without it. Where multicast is not to be had, a
//! [`Courier`] tells the named peers by unicast.

mod clock;
mod courier;
mod network;
pub mod overheard;
mod participant;
mod raw;
mod receiving;
mod sending;
mod talk;

pub use courier::Courier;
pub use network::{Interface, MAX_DOMAIN, Network, NetworkError, interfaces};
pub use talk::Talk;

use super::bell::{Bell, Spin};
use super::{Publisher, Subscriber, Transport, TransportError};
use backdrive_msgs::topic::Topic;
use clock::ClockWatch;
use participant::Participant;
use receiving::{Inboxes, Receiving};
use sending::Sending;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the ports of a node that ends wait together until what they sent is acknowledged.
const LINGER: Duration = Duration::from_secs(5);

/// And then until it is taken over: what is still in the middleware when its writer goes is gone with it. Best effort has
/// no acknowledgement; for it this is the time in which a sample leaves this host.
const FLUSH: Duration = Duration::from_millis(100);

/// Whether samples may be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// Nothing is lost, and a lost packet holds up what follows: lockstep.
    Reliable,
    /// Samples may be lost and are never waited for: real time.
    BestEffort,
}

/// A node's way into a graph over ROS 2.
pub struct Ros2 {
    shared: Rc<Shared>,
    seen: u32,
}

/// What a node's ports have in common.
struct Shared {
    name: String,
    network: Network,
    delivery: Delivery,
    axes: HashMap<String, Vec<String>>,
    participant: RefCell<Arc<Participant>>,
    /// Counts the participants that this node has had; a port of an earlier one makes itself anew.
    life: Cell<u32>,
    watch: RefCell<ClockWatch>,
    bell: Arc<Bell>,
    kinds: RefCell<HashMap<String, Topic>>,
    /// What this node's subscribers have, so that all take over whenever the node waits for one.
    inboxes: Arc<Inboxes>,
    /// When the ports that end stop waiting for acknowledgements.
    linger_until: Cell<Option<Instant>>,
    /// Whether a port that ends has waited until all is taken over.
    flushed: Cell<bool>,
}

impl Ros2 {
    /// Joins the network as a ROS node called `/NAME`.
    ///
    /// # Errors
    /// The network cannot be what was asked for, or its sockets cannot be had.
    pub fn open(network: &Network, name: &str, delivery: Delivery) -> Result<Ros2, TransportError> {
        network.check().map_err(|e| TransportError::Start(e.to_string()))?;
        let participant = Arc::new(Participant::open(network, name)?);
        let inboxes = Arc::new(Inboxes::default());
        if delivery == Delivery::Reliable {
            receiving::take_over(&inboxes).map_err(|e| TransportError::Start(format!("cannot start a thread: {e}")))?;
        }
        Ok(Ros2 {
            shared: Rc::new(Shared {
                name: name.to_string(),
                network: network.clone(),
                delivery,
                axes: HashMap::new(),
                participant: RefCell::new(participant),
                life: Cell::new(0),
                watch: RefCell::new(ClockWatch::new()),
                bell: Arc::new(Bell::new()),
                kinds: RefCell::default(),
                inboxes,
                linger_until: Cell::new(None),
                flushed: Cell::new(false),
            }),
            seen: 0,
        })
    }

    /// Names the axes of sample topics, for `JointState.name`. Before any port is made.
    pub fn with_axes(mut self, axes: impl IntoIterator<Item = (String, Vec<String>)>) -> Ros2 {
        if let Some(shared) = Rc::get_mut(&mut self.shared) {
            shared.axes = axes.into_iter().collect();
        }
        self
    }
}

impl Shared {
    fn participant(&self) -> Arc<Participant> {
        Arc::clone(&self.participant.borrow())
    }

    /// A topic carries one kind, on this node at least.
    fn claim(&self, topic: &Topic, action: &'static str) -> Result<(), TransportError> {
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
    fn watch_clock(&self) {
        let mut watch = self.watch.borrow_mut();
        if let Some(fresh) = watch.look(&self.network, &self.name) {
            let old = self.participant.replace(Arc::new(fresh));
            self.life.set(self.life.get() + 1);
            watch.retire(old);
        }
    }

    /// What is left of the time to wait for acknowledgements.
    fn linger(&self) -> Duration {
        let until = self.linger_until.get().unwrap_or_else(|| Instant::now() + LINGER);
        self.linger_until.set(Some(until));
        until.saturating_duration_since(Instant::now())
    }
}

impl Transport for Ros2 {
    fn publisher(&mut self, topic: &Topic, _listeners: usize) -> Result<Box<dyn Publisher>, TransportError> {
        self.shared.claim(topic, "publish")?;
        Ok(Box::new(Sending::new(&self.shared, topic)?))
    }

    fn subscriber(&mut self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError> {
        self.shared.claim(topic, "subscribe")?;
        Ok(Box::new(Receiving::new(&self.shared, topic, depth, wakes)?))
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError> {
        self.shared.watch_clock();
        // An input that is ahead is not asked for; what it has must not stay in the middleware until it is.
        receiving::drain(&self.shared.inboxes);
        self.shared.bell.wait(&mut self.seen, 1, timeout, Spin { pauses: 0, yields: 0 });
        Ok(())
    }
}
