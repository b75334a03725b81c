//! Shared memory between processes of one machine: iceoryx2 carries the messages, bells of our own
//! (see `bell.rs`) wake the receivers.

use super::bell::{Looks, Offer, Tones};
use super::board::Board;
use super::{Location, MAX_LISTENERS, Publisher, Subscriber, Transport, TransportError, capacity, check_layout, wrong_kind};
use crate::clock::now_ns;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Event, Gains, Margin, Message, Sample, Status};
use iceoryx2::port::publisher::Publisher as IoxPublisher;
use iceoryx2::port::subscriber::Subscriber as IoxSubscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory as PubSub;
use std::fmt::{Debug, Display};
use std::rc::Rc;
use std::time::Duration;

/// One, plus dead predecessors of a node that was started again before they were swept.
const MAX_PUBLISHERS: usize = 4;

/// Processes that may have a topic open: its publisher, its listeners, and tools that look on.
const MAX_NODES: usize = 64;

/// A node's way into a run over shared memory.
pub struct Iceoryx2 {
    node: Node<ipc::Service>,
    board: Rc<Board>,
    bell: usize,
    tones: Rc<Tones>,
    seen: u32,
    looks: Looks,
}

impl Iceoryx2 {
    /// Joins the run at `location` as `name`, which no other living node of the run may have. What
    /// dead nodes of the run have left is cleared up.
    ///
    /// # Errors
    /// The location or the name cannot be one, or shared memory cannot be had.
    pub fn open(location: &Location, name: &str) -> Result<Iceoryx2, TransportError> {
        location.check()?;
        let start = |e: &dyn Debug| TransportError::Start(format!("cannot join the run {} as `{name}`: {e:?}", location.prefix));
        set_log_level(LogLevel::Error);
        // Not the global configuration: a file somewhere on the host must not change what a run is.
        let mut config = Config::default();
        config.global.prefix = FileName::new(location.prefix.as_bytes()).map_err(|e| start(&e))?;
        config.global.set_root_path(&Path::new(location.root.as_os_str().as_encoded_bytes()).map_err(|e| start(&e))?);
        // Five nodes that start at once on a busy machine wait for each other's services.
        config.global.creation_timeout = Duration::from_secs(5);
        let node = NodeBuilder::new()
            .name(&NodeName::new(name).map_err(|e| start(&e))?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .config(&config)
            .create::<ipc::Service>()
            .map_err(|e| start(&e))?;
        let board = Board::open(location)?;
        let bell = board.bell_of(name).ok_or_else(|| start(&"the run has no room for another node (64)"))?;
        Ok(Iceoryx2 { node, board: Rc::new(board), bell, tones: Rc::default(), seen: 0, looks: Looks::Offer(Offer::default()) })
    }

    /// Whether the node waits for its inputs by looking all the time. That keeps a processor busy, and is worth it where each node has one.
    pub fn polling(mut self, polls: bool) -> Iceoryx2 {
        self.looks = if polls { Looks::Poll } else { Looks::Offer(Offer::default()) };
        self
    }

    /// The service of a topic; made by whoever comes first, so all must ask for the same.
    fn service<T: Payload>(&self, topic: &Topic, action: &'static str) -> Result<PubSub<ipc::Service, T, SentNs>, TransportError> {
        let (depth, history) = capacity(topic.kind);
        let name = ServiceName::new(&topic.name).map_err(|e| open_error(topic, action, e))?;
        self.node
            .service_builder(&name)
            .publish_subscribe::<T>()
            .user_header::<SentNs>()
            .enable_safe_overflow(true)
            .subscriber_max_buffer_size(depth)
            .history_size(history)
            .max_publishers(MAX_PUBLISHERS)
            .max_subscribers(MAX_LISTENERS)
            .max_nodes(MAX_NODES)
            .open_or_create()
            .map_err(|e| open_error(topic, action, e))
    }

    fn publish<T: Payload>(&self, topic: &Topic) -> Result<Box<dyn Publisher>, TransportError> {
        let service = self.service::<T>(topic, "publish")?;
        let port = service.publisher_builder().create().map_err(|e| open_error(topic, "publish", e))?;
        let entry = self.board.topic(&topic.name).ok_or_else(|| open_error(topic, "publish", "the run has no room for another topic"))?;
        Ok(Box::new(Sending { topic: topic.clone(), port, service, board: Rc::clone(&self.board), entry }))
    }

    fn subscribe<T: Payload>(&self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError> {
        let (most, history) = capacity(topic.kind);
        let service = self.service::<T>(topic, "subscribe")?;
        let mut builder = service.subscriber_builder().buffer_size(depth.clamp(1, most));
        if history > 0 {
            builder = builder.history_request(history.min(depth.max(1)));
        }
        let port = builder.create().map_err(|e| open_error(topic, "subscribe", e))?;
        let mut tone = None;
        if wakes {
            let entry =
                self.board.topic(&topic.name).ok_or_else(|| open_error(topic, "subscribe", "the run has no room for another topic"))?;
            let of_topic = self.tones.of(entry);
            self.tones.change(of_topic, true);
            self.board.listen(entry, self.bell, of_topic);
            tone = Some(of_topic);
        }
        let (topic, tones) = (topic.clone(), Rc::clone(&self.tones));
        Ok(Box::new(Receiving { topic, port, service, tones, tone, awaited: wakes, arrived_ns: 0 }))
    }
}

impl Transport for Iceoryx2 {
    fn publisher(&mut self, topic: &Topic, listeners: usize) -> Result<Box<dyn Publisher>, TransportError> {
        if listeners > MAX_LISTENERS {
            return Err(open_error(topic, "publish", format!("{listeners} listeners, at most {MAX_LISTENERS} have room")));
        }
        match topic.kind {
            Kind::Sample => self.publish::<Sample>(topic),
            Kind::Gains => self.publish::<Gains>(topic),
            Kind::Event => self.publish::<Event>(topic),
            Kind::Status => self.publish::<Status>(topic),
            Kind::Margin => self.publish::<Margin>(topic),
        }
    }

    fn subscriber(&mut self, topic: &Topic, depth: usize, wakes: bool) -> Result<Box<dyn Subscriber>, TransportError> {
        match topic.kind {
            Kind::Sample => self.subscribe::<Sample>(topic, depth, wakes),
            Kind::Gains => self.subscribe::<Gains>(topic, depth, wakes),
            Kind::Event => self.subscribe::<Event>(topic, depth, wakes),
            Kind::Status => self.subscribe::<Status>(topic, depth, wakes),
            Kind::Margin => self.subscribe::<Margin>(topic, depth, wakes),
        }
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError> {
        self.board.bell(self.bell).wait(&mut self.seen, self.tones.awaited(), timeout, &mut self.looks);
        Ok(())
    }

    fn sweep(&mut self) {
        self.node.try_cleanup_dead_nodes();
    }
}

/// Beside every message: when it was sent, CLOCK_MONOTONIC, ns. The receiver has it in its queue from then on, however late it looks.
type SentNs = i64;

/// Types that iceoryx2 carries without conversion.
trait Payload: ZeroCopySend + Debug + Copy + 'static {
    fn of(message: &Message) -> Option<&Self>;
    fn message(self) -> Message;
}

macro_rules! payload {
    ($($kind:ident),*) => {$(
        impl Payload for $kind {
            fn of(message: &Message) -> Option<&$kind> {
                match message {
                    Message::$kind(m) => Some(m),
                    _ => None,
                }
            }
            fn message(self) -> Message {
                Message::$kind(self)
            }
        }
    )*};
}
payload!(Sample, Gains, Event, Status, Margin);

struct Sending<T: Payload> {
    topic: Topic,
    port: IoxPublisher<ipc::Service, T, SentNs>,
    service: PubSub<ipc::Service, T, SentNs>,
    board: Rc<Board>,
    entry: usize,
}

impl<T: Payload> Publisher for Sending<T> {
    fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        let payload = T::of(message).ok_or_else(|| wrong_kind(&self.topic, message))?;
        let mut sample = self.port.loan_uninit().map_err(|e| broken(&self.topic, e))?;
        *sample.user_header_mut() = now_ns();
        sample.write_payload(*payload).send().map_err(|e| broken(&self.topic, e))?;
        self.board.ring(self.entry);
        Ok(())
    }

    fn listeners(&self) -> usize {
        // A connection is made here rather than at the first send, which then takes no longer than any other.
        let _ = self.port.update_connections();
        self.service.dynamic_config().number_of_subscribers()
    }
}

struct Receiving<T: Payload> {
    topic: Topic,
    port: IoxSubscriber<ipc::Service, T, SentNs>,
    service: PubSub<ipc::Service, T, SentNs>,
    tones: Rc<Tones>,
    /// If it wakes.
    tone: Option<u8>,
    awaited: bool,
    arrived_ns: i64,
}

impl<T: Payload> Subscriber for Receiving<T> {
    fn receive(&mut self) -> Result<Option<Message>, TransportError> {
        let Some(sample) = self.port.receive().map_err(|e| broken(&self.topic, e))? else {
            return Ok(None);
        };
        self.arrived_ns = *sample.user_header();
        let message = sample.payload().message();
        check_layout(&self.topic.name, &message)?;
        Ok(Some(message))
    }

    fn arrived_ns(&self) -> i64 {
        self.arrived_ns
    }

    fn has_publisher(&self) -> bool {
        let has = self.service.dynamic_config().number_of_publishers() > 0;
        // Connected now, so that what is sent is kept even if the publisher is gone before the first receive.
        let _ = self.port.update_connections();
        has
    }

    fn set_awaited(&mut self, awaited: bool) {
        if let Some(tone) = self.tone.filter(|_| self.awaited != awaited) {
            self.awaited = awaited;
            self.tones.change(tone, awaited);
        }
    }
}

fn open_error(topic: &Topic, action: &'static str, reason: impl Display) -> TransportError {
    TransportError::Open { topic: topic.name.clone(), action, reason: reason.to_string() }
}

fn broken(topic: &Topic, reason: impl Display) -> TransportError {
    TransportError::Broken { topic: topic.name.clone(), reason: reason.to_string() }
}
