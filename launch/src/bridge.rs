//! A local graph over shared memory, seen and joined over ROS 2.
//!
//! What a node of this host speaks is put on ROS 2, and nothing is taken from there: the bridge may be listened to. When asked for both ways, what the graph's
//! nodes on other hosts speak is also taken from ROS 2 into shared memory. The nodes here then need not know where the others are. Only what is tagged by
//! the run's own hosts is taken.

use crate::alive::{find, lives};
use crate::asked::{Asked, network};
use crate::carry_error::CarryError;
use crate::join::read_graph;
use crate::{Place, Wire};
use backdrive_msgs::Message;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_nodes::build::{credit_listeners, credit_topic, listeners_on, topics};
use backdrive_nodes::graph::Graph;
use backdrive_nodes::stage::Clock;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::ros2::Courier;
use backdrive_nodes::transport::{Publisher, Subscriber, Transport, TransportError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often it looks whether the run still lives.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// A topic that crosses the bridge.
struct Crossing {
    topic: Topic,
    /// Those of the graph: room for them is made where it is published again.
    listeners: usize,
    /// How many listeners the bridge stands for where it listens: the publisher counts them before it begins.
    stands_for: usize,
}

/// What crossed in one direction.
#[derive(Debug, Clone, Copy, Default)]
pub struct Crossed {
    /// Messages that were sent again.
    pub messages: u64,
    /// Messages that were lost before the bridge.
    pub lost: u64,
}

/// What crossed a bridge.
#[derive(Debug, Clone)]
pub struct Bridged {
    /// Name of the run.
    pub run: String,
    /// To ROS 2.
    pub out: Crossed,
    /// From ROS 2.
    pub back: Crossed,
}

/// Which run is bridged, and how.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The beginning of the run's name; `None` for the only one that is alive.
    pub run: Option<String>,
    /// Whether what nodes on other hosts send is taken too.
    pub both_ways: bool,
    /// Where on the network, of a run on one host.
    pub network: Asked,
}

/// Carries the topics of a run until it ends or `stop` is true. `note` hears what a person should know meanwhile, a sentence each.
///
/// # Errors
/// No run or several are alive, the run speaks ROS 2 already, or the network or a stranger on it does not let it.
pub fn bridge(options: &Options, stop: &AtomicBool, note: &(dyn Fn(&str) + Sync)) -> Result<Bridged, CarryError> {
    let paths = find(options.run.as_deref())?;
    let place = Place::read(&paths).map_err(CarryError::machine)?;
    if place.wire == Wire::Ros2 {
        return Err(CarryError::input(format!("run {} uses ROS 2 already and needs no bridge", paths.id())));
    }
    let mut graph = read_graph(&paths).map_err(CarryError::input)?;
    if place.host.is_none() {
        graph = graph.on_one_host();
    }
    // A run on one of several hosts has settled where it meets the others.
    let network = if place.host.is_some() { place.network.clone() } else { network(&options.network).map_err(CarryError::input)? };
    let place = Place { network, ..place };
    let courier = if place.host.is_some() { None } else { Courier::start(&place.network).map_err(CarryError::machine)? };
    let (out, mut back) = crossings(&graph, place.host.as_deref());
    if !options.both_ways {
        if !back.is_empty() {
            note(&format!(
                "nothing is received from ROS 2: {} topics of other hosts do not reach the nodes here; add --both-ways if they should",
                back.len()
            ));
        }
        back.clear();
    }
    note(&format!("run {}: {} topics to ROS domain {}, {} from there", paths.id(), out.len(), place.network.domain, back.len()));
    let over = AtomicBool::new(false);
    let ended = || stop.load(Ordering::SeqCst) || !lives(&paths);
    let (out, back) = std::thread::scope(|scope| -> Result<_, TransportError> {
        let carry_out = scope.spawn(|| {
            let (mut from, mut to) = (Iceoryx2::open(&paths.location(), "bridge_out")?, place.join_ros2(&paths, &graph, "bridge_out")?);
            carry(&mut from, &mut to, &out, &over, note)
        });
        let carry_back = scope.spawn(|| {
            if back.is_empty() {
                // It does not even listen.
                while !over.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(20));
                }
                return Ok(Crossed::default());
            }
            let (mut from, mut to) = (place.join_ros2(&paths, &graph, "bridge_in")?, Iceoryx2::open(&paths.location(), "bridge_in")?);
            carry(&mut from, &mut to, &back, &over, note)
        });
        while !carry_out.is_finished() && !carry_back.is_finished() && !ended() {
            std::thread::sleep(LOOK_EVERY);
        }
        over.store(true, Ordering::SeqCst);
        let lost = |_| TransportError::Start("the bridge has broken down".to_string());
        Ok((carry_out.join().map_err(lost)??, carry_back.join().map_err(lost)??))
    })
    .map_err(CarryError::machine)?;
    drop(courier);
    Ok(Bridged { run: paths.id().to_string(), out, back })
}

/// What goes out and what comes in. Over ROS 2 the bridge stands for all listeners of this host; in shared memory it is one.
fn crossings(graph: &Graph, host: Option<&str>) -> (Vec<Crossing>, Vec<Crossing>) {
    let is_here = |publisher: &str| match (host, graph.node(publisher)) {
        (None, _) => true,
        (Some(host), Some(node)) => graph.runs_on(node, host),
        // A supervisor speaks ROS 2 itself.
        (Some(_), None) => false,
    };
    let (mut out, mut back) = (Vec::new(), Vec::new());
    for topic in topics(graph) {
        let here = is_here(&topic.publisher);
        let stands_for = match host {
            Some(host) if !here => listeners_on(graph, &topic.topic, host),
            Some(_) | None => 1,
        };
        let crossing = Crossing { topic: topic.topic, listeners: topic.listeners, stands_for };
        if here { out.push(crossing) } else { back.push(crossing) }
    }
    // Sources wait for the recorders of all hosts.
    if graph.timing.clock == Clock::Lockstep && host.is_some() {
        for recorder in graph.recorders() {
            let (topic, here) = (credit_topic(recorder), recorder == host);
            let stands_for = if here { 1 } else { host.map_or(1, |host| listeners_on(graph, &topic, host)) };
            let crossing = Crossing { topic, listeners: credit_listeners(graph), stands_for };
            if here { out.push(crossing) } else { back.push(crossing) }
        }
    }
    (out, back)
}

/// Carries until it is over, and then what is still there.
fn carry(
    from: &mut dyn Transport,
    to: &mut dyn Transport,
    crossings: &[Crossing],
    over: &AtomicBool,
    note: &(dyn Fn(&str) + Sync),
) -> Result<Crossed, TransportError> {
    struct Lane {
        subscriber: Box<dyn Subscriber>,
        /// Only counted.
        others: Vec<Box<dyn Subscriber>>,
        publisher: Box<dyn Publisher>,
        expected: Option<u64>,
        complained: Option<Instant>,
    }
    let mut lanes = Vec::new();
    for crossing in crossings {
        // What arrives before this is told by the publisher that is made first.
        let publisher = to.publisher(&crossing.topic, crossing.listeners)?;
        let subscriber = from.subscriber(&crossing.topic, usize::MAX, true)?;
        let others = (1..crossing.stands_for).map(|_| from.subscriber(&crossing.topic, 1, false)).collect::<Result<_, _>>()?;
        lanes.push(Lane { subscriber, others, publisher, expected: None, complained: None });
    }
    let mut crossed = Crossed::default();
    loop {
        let ends = over.load(Ordering::SeqCst);
        let mut moved = false;
        for (lane, crossing) in lanes.iter_mut().zip(crossings) {
            for other in &mut lane.others {
                while let Ok(Some(_)) = other.receive() {}
            }
            loop {
                match lane.subscriber.receive().and_then(|m| m.map_or(Ok(None), |m| lane.publisher.send(&m).map(|()| Some(m)))) {
                    Ok(Some(message)) => {
                        moved = true;
                        count(&mut crossed, &mut lane.expected, &message);
                    }
                    Ok(None) => break,
                    // The nodes here then lack their inputs: forces decay and the slave holds.
                    Err(e @ TransportError::Stranger { moves: true, .. }) => return Err(e),
                    Err(e) => {
                        if lane.complained.is_none_or(|at| at.elapsed() >= Duration::from_secs(1)) {
                            lane.complained = Some(Instant::now());
                            note(&format!("warning: {e}"));
                        }
                        if crossing.topic.kind == Kind::Sample {
                            break;
                        }
                    }
                }
            }
        }
        if moved {
            continue;
        }
        if ends {
            return Ok(crossed);
        }
        from.wait(Duration::from_millis(20))?;
    }
}

fn count(crossed: &mut Crossed, expected: &mut Option<u64>, message: &Message) {
    crossed.messages += 1;
    // A publisher that was started again counts from 0: that is no loss.
    crossed.lost += expected.map_or(0, |e| message.sequence().saturating_sub(e));
    *expected = Some(message.sequence() + 1);
}
