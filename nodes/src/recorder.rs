//! The recorder: hears every topic, takes everything over in time, and delays no other node.
//!
//! It polls rather than wakes, so a publisher never pays for it. When a message arrived does not depend on when the recorder looked: the transport
//! knows it ([`Subscriber::arrived_ns`]), and messages go to the sink in that order. In lockstep it reports on its credit topic up to which step it
//! has everything; sources wait for that, so the graph cannot outrun it and nothing is ever lost. In real time the buffers cover the time between two
//! polls many times over, and a hole is counted.

use crate::clock::{Start, now_ns};
use crate::process::{GRACE, Line};
use crate::protocol::{NodeStatus, STRANGER};
use crate::runner::{RunError, Told};
use crate::sentences::sentence;
use crate::stage::{Clock, Timing};
use crate::transport::{Publisher, Subscriber, Transport, TransportError};
use backdrive_bags::Completeness;
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Event, LAYOUT, Message, Sample, source_id};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// How often it looks: at 10 kHz a topic then has 50 messages for it, and room for 4096.
const POLL: Duration = Duration::from_millis(5);

/// Messages of one topic that it takes before it looks at the next.
const AT_ONCE: usize = 512;

/// After a stop, or when all publishers are silent, how long it still listens.
const LINGER: Duration = Duration::from_millis(50);

/// How long it still listens after a stop while others speak on: it was asked to end alone, and has a bag to close.
const SPOKEN_ON: Duration = Duration::from_secs(1);

/// How long the recorder leaves it to the nodes to report a stranger.
const STRANGER_WAIT: Duration = Duration::from_millis(300);

/// Steps after which it gives credit again, however much there is to take.
const CREDIT_EVERY: u64 = 256;

/// Where a recorder puts what it hears.
pub trait Sink {
    /// Takes a message of topic number `topic`; `receive_ns` is its time of arrival, ns since the Unix
    /// epoch by the clock that its stamp is of, or in lockstep its own stamp. May wait in lockstep, never in real time.
    fn push(&mut self, topic: usize, message: Message, receive_ns: i64) -> Result<(), RunError>;

    /// Every topic has been asked for all it had.
    fn checkpoint(&mut self) {}

    /// Messages and bytes written so far, and messages lost.
    fn health(&self) -> (u64, u64, u64);

    /// Ends it: what is complete and what is not.
    fn finish(self: Box<Self>) -> Result<Completeness, RunError>;
}

impl Sink for backdrive_bags::Recorder {
    fn push(&mut self, topic: usize, message: Message, receive_ns: i64) -> Result<(), RunError> {
        backdrive_bags::Recorder::push(self, topic, message, receive_ns).map_err(|e| RunError::Bag(e.to_string()))
    }

    fn checkpoint(&mut self) {
        backdrive_bags::Recorder::checkpoint(self);
    }

    fn health(&self) -> (u64, u64, u64) {
        let health = backdrive_bags::Recorder::health(self);
        (health.written, health.bytes, health.lost)
    }

    fn finish(self: Box<Self>) -> Result<Completeness, RunError> {
        backdrive_bags::Recorder::finish(*self).map_err(|e| RunError::Bag(e.to_string()))
    }
}

/// What a recorder does.
#[derive(Debug, Clone, PartialEq)]
pub struct RecorderPlan {
    /// Name of the node, unique in the graph.
    pub name: String,
    /// What it records, in the order of the sink's topic numbers.
    pub topics: Vec<Topic>,
    /// Lockstep: where it reports its progress, and how many sources listen to that.
    pub credit: Option<(Topic, usize)>,
    /// Real time: whether arrival times use the wall clock of this host, as they must where it is one of several whose clocks are compared. Otherwise
    /// they count from the start of the run, as stamps do, and no setting of the clock puts one before its stamp.
    pub by_wall_clock: bool,
}

struct Heard {
    topic: Topic,
    subscriber: Box<dyn Subscriber>,
    /// One more than the newest step of a sample topic.
    upto: u64,
}

/// A message on its way to the sink.
struct Arrived {
    /// CLOCK_MONOTONIC, ns.
    at_ns: i64,
    topic: usize,
    message: Message,
}

/// A recorder whose subscribers exist.
pub struct RunningRecorder {
    heard: Vec<Heard>,
    credit: Option<(Box<dyn Publisher>, usize)>,
    credited: u64,
    credits: u64,
    source: u32,
    clock: Clock,
    by_wall_clock: bool,
    sink: Box<dyn Sink>,
    /// Real time: what has arrived and is not yet handed on.
    arrived: Vec<Arrived>,
    /// Real time: a topic that could not be read; the others go on.
    broken: Option<TransportError>,
    /// Last, so that it outlives the ports that came from it.
    _transport: Box<dyn Transport>,
}

impl RunningRecorder {
    /// Subscribes to every topic.
    ///
    /// # Errors
    /// The transport refuses.
    pub fn new(
        plan: &RecorderPlan,
        timing: &Timing,
        mut transport: Box<dyn Transport>,
        sink: Box<dyn Sink>,
    ) -> Result<RunningRecorder, TransportError> {
        let mut heard = Vec::new();
        for topic in &plan.topics {
            let subscriber = transport.subscriber(topic, usize::MAX, false)?;
            heard.push(Heard { topic: topic.clone(), subscriber, upto: 0 });
        }
        let credit = match &plan.credit {
            Some((topic, listeners)) => Some((transport.publisher(topic, *listeners)?, *listeners)),
            None => None,
        };
        let (source, clock, by_wall_clock) = (source_id(&plan.name), timing.clock, plan.by_wall_clock);
        Ok(RunningRecorder {
            heard,
            credit,
            credited: 0,
            credits: 0,
            source,
            clock,
            by_wall_clock,
            sink,
            arrived: Vec::new(),
            broken: None,
            _transport: transport,
        })
    }

    /// Refuses to begin where somebody else sends on one of the topics.
    ///
    /// # Errors
    /// Somebody does.
    pub fn check_alone(&mut self) -> Result<(), RunError> {
        self.heard.iter_mut().find_map(|h| h.subscriber.stranger()).map_or(Ok(()), |e| Err(RunError::Taken(e)))
    }

    /// What it still lacks before a run can start, one line each.
    pub fn missing(&self) -> Vec<String> {
        let silent = self.heard.iter().filter(|h| !h.subscriber.has_publisher());
        let mut lines: Vec<String> = silent.map(|h| format!("{}: no publisher", h.topic.name)).collect();
        if let Some((publisher, expected)) = &self.credit {
            let has = publisher.listeners();
            if has < *expected {
                lines.push(format!("recorder credit: {has} of {expected} listeners"));
            }
        }
        lines
    }

    /// Takes over what has arrived by now, of each topic so much at most; returns how many messages that were.
    ///
    /// # Errors
    /// A subscriber or the sink fails.
    fn take(&mut self, start: Start) -> Result<usize, RunError> {
        let (mut taken, mut more) = (0, false);
        // What comes while the topics are asked is held back: one that has been asked may get something that came before it. So
        // is what came after the last that was taken of a topic that has more.
        let mut settled_ns = now_ns();
        for (index, heard) in self.heard.iter_mut().enumerate() {
            let mut here = 0;
            while here < AT_ONCE {
                let message = match heard.subscriber.receive() {
                    Ok(Some(message)) => message,
                    Ok(None) => break,
                    // A stranger's message is none of the run's, and takes nothing from them.
                    Err(e) if self.clock == Clock::Realtime || matches!(e, TransportError::Stranger { .. }) => {
                        self.broken = Some(e);
                        break;
                    }
                    Err(e) => return Err(e.into()),
                };
                if heard.topic.kind == Kind::Sample {
                    heard.upto = heard.upto.max(message.step() + 1);
                }
                here += 1;
                // A lockstep bag holds nothing that the machine decides.
                match self.clock {
                    Clock::Lockstep => self.sink.push(index, message, message.stamp_ns())?,
                    Clock::Realtime => self.arrived.push(Arrived { at_ns: heard.subscriber.arrived_ns(), topic: index, message }),
                }
            }
            if here == AT_ONCE {
                more = true;
                settled_ns = settled_ns.min(heard.subscriber.arrived_ns());
            }
            taken += here;
        }
        self.hand_on(start, settled_ns)?;
        if more {
            self.give_credit(CREDIT_EVERY)?;
        } else {
            self.give_credit(1)?;
            self.sink.checkpoint();
        }
        Ok(taken)
    }

    /// Gives the sink what arrived before `until_ns`, in the order of arrival.
    fn hand_on(&mut self, start: Start, until_ns: i64) -> Result<(), RunError> {
        let epoch = if self.by_wall_clock { Start::after(0) } else { start };
        self.arrived.sort_by_key(|arrived| arrived.at_ns); // stable: what came at once keeps the order of the topics
        let count = self.arrived.partition_point(|arrived| arrived.at_ns < until_ns);
        for Arrived { at_ns, topic, message } in self.arrived.drain(..count) {
            self.sink.push(topic, message, epoch.unix_at(at_ns))?;
        }
        Ok(())
    }

    /// Steps of which every sample has been taken over.
    pub fn steps(&self) -> u64 {
        self.heard.iter().filter(|h| h.topic.kind == Kind::Sample).map(|h| h.upto).min().unwrap_or(0)
    }

    fn give_credit(&mut self, least: u64) -> Result<(), TransportError> {
        let steps = self.steps();
        let Some((publisher, _)) = self.credit.as_mut().filter(|_| steps >= self.credited + least) else {
            return Ok(());
        };
        let sample = Sample { layout: LAYOUT, source: self.source, step: steps - 1, sequence: self.credits, ..Sample::new(0) };
        publisher.send(&Message::Sample(sample))?;
        self.credits += 1;
        self.credited = steps;
        Ok(())
    }

    fn is_deserted(&self) -> bool {
        self.heard.iter().all(|h| !h.subscriber.has_publisher())
    }

    fn report(&self) -> NodeStatus {
        let (written, bytes, lost) = self.sink.health();
        let refused = self.heard.iter().map(|h| h.subscriber.refused()).sum();
        NodeStatus { steps: self.steps(), lost, refused, recorded: Some((written, bytes)), ..NodeStatus::default() }
    }

    /// Takes over until every topic has reached the last of `steps`, or `stopped` is set; then what is still on its way. `start` is that of the
    /// nodes: times of arrival count from it as their stamps do. `tell` receives losses and, about ten times a second, progress.
    ///
    /// # Errors
    /// A subscriber or the sink fails.
    pub fn run(
        &mut self,
        start: Start,
        steps: Option<u64>,
        stopped: impl Fn() -> bool,
        tell: &mut dyn FnMut(Told),
    ) -> Result<(), RunError> {
        let (mut reported, mut lost_before) = (Instant::now(), 0);
        let (mut ends_at, mut stranger_since): (Option<Instant>, Option<Instant>) = (None, None);
        loop {
            let taken = self.take(start)?;
            let lost = self.sink.health().2;
            if lost > lost_before {
                tell(Told::Event(self.loss(lost - lost_before)));
                lost_before = lost;
            }
            // The node that a stranger would have moved publishes an event, which the bag holds; the recorder's own reaches the supervisor alone.
            let is_stranger = matches!(self.broken, Some(TransportError::Stranger { .. }));
            let waits = is_stranger && stranger_since.get_or_insert_with(Instant::now).elapsed() < STRANGER_WAIT;
            if let Some(error) = self.broken.take_if(|_| !waits) {
                let text = Text::new(&error.to_string());
                tell(Told::Event(match error {
                    TransportError::Stranger { refused, moves, .. } => {
                        Event { severity: 1 + u32::from(moves), ..self.event(STRANGER, refused as f64, text) }
                    }
                    _ => self.event("connection_broken", backdrive_msgs::NOT_MEASURED, text),
                }));
            }
            if reported.elapsed() >= Duration::from_millis(100) {
                reported = Instant::now();
                tell(Told::Status { source: self.source, status: self.report() });
            }
            let complete = steps.is_some_and(|steps| self.steps() >= steps);
            if complete || stopped() || ends_at.is_some() {
                // Events and status may still be on their way; they are few, and their publishers end now.
                let end = *ends_at.get_or_insert_with(|| Instant::now() + LINGER);
                let deserted = self.is_deserted();
                let spoken_on = !deserted && Instant::now() >= end + SPOKEN_ON;
                if (deserted || Instant::now() >= end) && taken == 0 || spoken_on {
                    return self.hand_on(start, i64::MAX);
                }
            }
            if taken < AT_ONCE {
                std::thread::sleep(POLL);
            }
        }
    }

    fn loss(&self, lost: u64) -> Event {
        self.event("recorder_lost", lost as f64, sentence("recorder_lost", lost as f64))
    }

    /// Something for whoever watches; a recorder speaks on no topic.
    fn event(&self, kind: &str, value: f64, text: Text<128>) -> Event {
        let (kind, step, stamp_ns) = (Text::new(kind), self.steps(), now_ns());
        Event { layout: LAYOUT, source: self.source, step, sequence: 0, stamp_ns, severity: 2, reserved: 0, value, kind, text }
    }

    /// Closes the bag.
    ///
    /// # Errors
    /// The sink cannot be ended, or messages were lost: then the error gives their number.
    pub fn finish(self) -> Result<NodeStatus, RunError> {
        let report = self.report();
        let completeness = self.sink.finish()?;
        match completeness.lost() {
            0 => Ok(NodeStatus { recorded: Some((completeness.written(), report.recorded.map_or(0, |r| r.1))), ..report }),
            lost => Err(RunError::Incomplete { lost }),
        }
    }
}

/// Records as this process until every topic has reached its last step, or the supervisor stops it (see [`crate::process::run_process`]). The exit
/// code is 4 when messages were lost.
pub fn run_recorder(plan: &RecorderPlan, timing: &Timing, transport: Box<dyn Transport>, sink: Box<dyn Sink>) -> ExitCode {
    Line::open(GRACE, Vec::new()).supervised(|line| {
        let mut recorder = RunningRecorder::new(plan, timing, transport, sink)?;
        let Some(start) = line.meet(|| recorder.check_alone().map(|()| recorder.missing()))? else {
            return recorder.finish();
        };
        recorder.run(start, timing.steps, || line.control.is_stopped(), &mut |told| line.tell(told))?;
        recorder.finish()
    })
}
