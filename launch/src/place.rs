//! Where a run's nodes meet, where that is not shared memory alone: written into the run directory for its processes.

use crate::paths::RunPaths;
use backdrive_nodes::build::{credit_topic, topics};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::stage::Clock;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::ros2::{Delivery, Identity, Key, Network, Ros2};
use backdrive_nodes::transport::{Transport, TransportError};
use serde::{Deserialize, Serialize};

/// How the messages of a run travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wire {
    /// Shared memory of this host.
    #[default]
    Iceoryx2,
    /// ROS 2 over DDS.
    Ros2,
}

/// Where a run's nodes meet.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Place {
    /// How messages travel.
    pub wire: Wire,
    /// Domain, interfaces and peers.
    pub network: Network,
    /// Which of the graph's hosts this is.
    pub host: Option<String>,
    /// What the hosts of the run share, so that each knows the others; never written into the run directory.
    #[serde(skip)]
    pub secret: Option<Key>,
    /// Whether a bag that exists may be replaced.
    #[serde(default)]
    pub overwrite: bool,
}

impl Place {
    /// The place in the run directory; shared memory where it has none.
    ///
    /// # Errors
    /// Its content cannot be read.
    pub fn read(paths: &RunPaths) -> Result<Place, String> {
        let path = paths.place();
        match std::fs::read_to_string(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(Place::default()),
            Err(e) => Err(format!("{}: cannot be read: {e}", path.display())),
            Ok(text) => serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display())),
        }
    }

    /// Joins the run as `name`.
    ///
    /// # Errors
    /// The transport refuses.
    pub fn join(&self, paths: &RunPaths, graph: &Graph, name: &str) -> Result<Box<dyn Transport>, TransportError> {
        Ok(match self.wire {
            Wire::Iceoryx2 => Box::new(Iceoryx2::open(&paths.location(), name)?.polling(graph.polls)),
            Wire::Ros2 => Box::new(self.join_ros2(paths, graph, name)?),
        })
    }

    /// Joins the network as ROS node `/NAME` of the run, with the axes of the graph's samples.
    ///
    /// # Errors
    /// The network refuses, or the run directory does not say who the run is.
    pub fn join_ros2(&self, paths: &RunPaths, graph: &Graph, name: &str) -> Result<Ros2, TransportError> {
        // Every host's recorder is a ROS node of its own.
        let name = match &self.host {
            Some(host) if graph.recorders().len() > 1 && graph.node(name).is_some_and(|n| n.host.is_none()) => format!("{name}_{host}"),
            _ => name.to_string(),
        };
        let identity = Identity::read(&paths.identity())?;
        let delivery = match graph.timing.clock {
            Clock::Lockstep => Delivery::Reliable,
            Clock::Realtime => Delivery::BestEffort,
        };
        let credits = graph.recorders().into_iter().map(|host| (credit_topic(host).name, Vec::new()));
        let axes = topics(graph).into_iter().map(|t| (t.topic.name, t.axes)).chain(credits);
        Ok(Ros2::open(&self.network, &name, delivery)?.with_axes(axes).with_identity(identity))
    }
}
