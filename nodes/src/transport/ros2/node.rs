//! A node's way into a graph over ROS 2.

use super::super::bell::{Bell, Looks};
use super::super::{Publisher, Subscriber, Transport, TransportError};
use super::clock::ClockWatch;
use super::delivery::Delivery;
use super::identity::Identity;
use super::inbox::Inboxes;
use super::network::Network;
use super::participant::Participant;
use super::receiving::Receiving;
use super::sending::Sending;
use super::shared::Shared;
use crate::transport::ros2::inbox;
use backdrive_msgs::topic::Topic;
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// A node's way into a graph over ROS 2.
pub struct Ros2 {
    pub(super) shared: Rc<Shared>,
    pub(super) seen: u32,
}

impl Ros2 {
    /// Joins the network as a ROS node called `/NAME`, which belongs to no run until [`Ros2::with_identity`]: it takes what anybody sends, and
    /// the nodes of a run take nothing of it.
    ///
    /// # Errors
    /// The network cannot be what was asked for, or its sockets cannot be had.
    pub fn open(network: &Network, name: &str, delivery: Delivery) -> Result<Ros2, TransportError> {
        network.check().map_err(|e| TransportError::Start(e.to_string()))?;
        let participant = Arc::new(Participant::open(network, name)?);
        let inboxes = Arc::new(Inboxes::default());
        if delivery == Delivery::Reliable {
            inbox::take_over(&inboxes).map_err(|e| TransportError::Start(format!("cannot start a thread: {e}")))?;
        }
        Ok(Ros2 {
            shared: Rc::new(Shared {
                name: name.to_string(),
                network: network.clone(),
                delivery,
                identity: None,
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

    /// Makes it a node of a run: its messages are tagged, and it takes those of its run alone. Before any port is made.
    pub fn with_identity(mut self, identity: Identity) -> Ros2 {
        if let Some(shared) = Rc::get_mut(&mut self.shared) {
            shared.identity = Some(identity);
        }
        self
    }

    /// Names the axes of sample topics, for `JointState.name`. Before any port is made.
    pub fn with_axes(mut self, axes: impl IntoIterator<Item = (String, Vec<String>)>) -> Ros2 {
        if let Some(shared) = Rc::get_mut(&mut self.shared) {
            shared.axes = axes.into_iter().collect();
        }
        self
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
        inbox::drain(&self.shared.inboxes);
        self.shared.bell.wait(&mut self.seen, 1, timeout, &mut Looks::None);
        Ok(())
    }
}
