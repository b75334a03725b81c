//! One DDS participant as one ROS node: endpoints with their qualities of service, and what `ros2 node` shows of it.

use super::{Delivery, Network};
use crate::transport::{TransportError, capacity};
use backdrive_msgs::ros::live;
use backdrive_msgs::topic::{Kind, Topic};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::{Gid, MessageTypeName, NodeName, builtin_topics::ros_discovery};
use rustdds::bytes::Bytes;
use rustdds::no_key::{DataWriter, DataWriterCdr, SimpleDataReader};
use rustdds::policy::{Durability, History};
use rustdds::{DomainParticipant, DomainParticipantBuilder, Duration, QosPolicies, QosPolicyBuilder, RTPSEntity, TopicKind};
use std::fmt::Display;
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};

use super::raw::{Checked, Raw};

/// How long a reliable writer waits for room in lockstep; what it waits for is a reader that is behind, or dead.
const LOCKSTEP_ROOM: Duration = Duration::from_secs(2);

pub(super) type Writer = DataWriter<Bytes, Raw>;
pub(super) type Reader = SimpleDataReader<Checked, Raw>;

/// A DDS participant that is one ROS node.
pub(super) struct Participant {
    // Before the participant: they end first.
    publisher: rustdds::Publisher,
    subscriber: rustdds::Subscriber,
    presence: Option<Mutex<Presence>>,
    dds: DomainParticipant,
}

/// What other ROS tools learn of this node.
struct Presence {
    writer: DataWriterCdr<ParticipantEntitiesInfo>,
    node: NodeEntitiesInfo,
}

impl Participant {
    /// Takes part in the network's domain as ROS node `/NAME`.
    pub fn open(network: &Network, name: &str) -> Result<Participant, TransportError> {
        let failed = |e: &dyn Display| TransportError::Start(format!("cannot join ROS domain {} as `{name}`: {e}", network.domain));
        let mut builder = DomainParticipantBuilder::new(network.domain);
        if !network.interfaces.is_empty() {
            builder = builder.with_only_networks(network.interfaces.iter().map(|a| IpAddr::V4(*a)).collect::<Vec<_>>());
        }
        let dds = builder.build().map_err(|e| failed(&e))?;
        let qos = QosPolicyBuilder::new().build();
        let publisher = dds.create_publisher(&qos).map_err(|e| failed(&e))?;
        let subscriber = dds.create_subscriber(&qos).map_err(|e| failed(&e))?;
        // A name that ROS does not allow only costs its line in `ros2 node list`.
        let presence = match NodeName::new("/", name) {
            Err(_) => None,
            Ok(node) => {
                let topic = dds
                    .create_topic(
                        ros_discovery::TOPIC_NAME.to_string(),
                        ros_discovery::TYPE_NAME.to_string(),
                        &ros_discovery::QOS_PUB,
                        TopicKind::NoKey,
                    )
                    .map_err(|e| failed(&e))?;
                let writer = publisher.create_datawriter_no_key_cdr(&topic, None).map_err(|e| failed(&e))?;
                Some(Mutex::new(Presence { writer, node: NodeEntitiesInfo::new(node) }))
            }
        };
        let participant = Participant { publisher, subscriber, presence, dds };
        participant.tell(|_| {});
        Ok(participant)
    }

    /// Changes what other ROS tools learn of this node.
    fn tell(&self, change: impl FnOnce(&mut NodeEntitiesInfo)) {
        let Some(presence) = &self.presence else { return };
        let mut presence = presence.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut presence.node);
        let info = ParticipantEntitiesInfo::new(Gid::from(self.dds.guid()), vec![presence.node.clone()]);
        // It is for people who look on: the graph does not need it.
        let _ = presence.writer.write(info, None);
    }

    fn topic(&self, topic: &Topic, action: &'static str, qos: &QosPolicies) -> Result<rustdds::Topic, TransportError> {
        let (package, name) = live::type_of(topic.kind);
        self.raw_topic(&topic.name, package, name, qos).map_err(|e| open_error(&topic.name, action, &e))
    }

    /// A topic of any type by its ROS names.
    pub fn raw_topic(
        &self,
        topic: &str,
        package: &str,
        name: &str,
        qos: &QosPolicies,
    ) -> Result<rustdds::Topic, rustdds::dds::CreateError> {
        let type_name = MessageTypeName::new(package, name).dds_msg_type();
        self.dds.create_topic(format!("rt{topic}"), type_name, qos, TopicKind::NoKey)
    }

    /// The writer of a topic.
    pub fn writer(&self, topic: &Topic, delivery: Delivery) -> Result<Writer, TransportError> {
        let failed = |e: &dyn Display| open_error(&topic.name, "publish", e);
        let qos = qos(topic.kind, delivery);
        let dds_topic = self.topic(topic, "publish", &qos)?;
        let writer: Writer = self.publisher.create_datawriter_no_key(&dds_topic, Some(qos)).map_err(|e| failed(&e))?;
        self.tell(|node| node.add_writer(Gid::from(writer.guid())));
        Ok(writer)
    }

    /// A reader of a topic.
    pub fn reader(&self, topic: &Topic, delivery: Delivery) -> Result<Reader, TransportError> {
        let failed = |e: &dyn Display| open_error(&topic.name, "subscribe", e);
        let qos = qos(topic.kind, delivery);
        let dds_topic = self.topic(topic, "subscribe", &qos)?;
        let reader: Reader = self.subscriber.create_simple_datareader_no_key(&dds_topic, Some(qos)).map_err(|e| failed(&e))?;
        self.tell(|node| node.add_reader(Gid::from(reader.guid())));
        Ok(reader)
    }

    /// For endpoints of other types than the graph's.
    pub fn ends(&self) -> (&rustdds::Publisher, &rustdds::Subscriber) {
        (&self.publisher, &self.subscriber)
    }
}

/// Samples are volatile and, in real time, best effort; the rest is reliable and its last few are kept.
fn qos(kind: Kind, delivery: Delivery) -> QosPolicies {
    let (held, past) = capacity(kind);
    let builder = QosPolicyBuilder::new();
    match (kind, delivery) {
        (Kind::Sample, Delivery::BestEffort) => {
            builder.best_effort().durability(Durability::Volatile).history(History::KeepLast { depth: held as i32 }).build()
        }
        (Kind::Sample, Delivery::Reliable) => {
            builder.reliable(LOCKSTEP_ROOM).durability(Durability::Volatile).history(History::KeepLast { depth: held as i32 }).build()
        }
        // Never a wait for room: a reader that was killed would stall the loop with it.
        (_, _) => {
            let depth = if delivery == Delivery::Reliable { held } else { past };
            builder
                .reliable(Duration::ZERO)
                .durability(Durability::TransientLocal)
                .history(History::KeepLast { depth: depth as i32 })
                .build()
        }
    }
}

pub(super) fn open_error(topic: &str, action: &'static str, reason: &dyn Display) -> TransportError {
    TransportError::Open { topic: topic.to_string(), action, reason: reason.to_string() }
}
