//! What a run sends, taken over beside its recorder: a listener that polls sixty times a second and wakes nobody.

use crate::channels::Channels;
use crate::decimate::Decimator;
use crate::error::LiveError;
use crate::frames;
use crate::hub::{Hub, Past, text};
use crate::picture::Picture;
use crate::scene::Scene;
use axum::extract::ws::Message as Frame;
use backdrive_launch::join::read_graph;
use backdrive_launch::{Place, RunPaths};
use backdrive_msgs::Message;
use backdrive_nodes::graph::Graph;
use backdrive_nodes::transport::{Subscriber, Transport};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two looks.
const POLL: Duration = Duration::from_micros(16_667);

/// Time between two states.
const STATE_EVERY: Duration = Duration::from_millis(100);

/// Time between two looks whether the run still lives.
const LOOK_EVERY: Duration = Duration::from_millis(500);

/// Intervals of the past in one frame.
const AT_ONCE: usize = 1200;

/// Everything of a run that a new viewer needs.
pub(crate) struct Running {
    hello: Value,
    pub picture: Picture,
    channels: Channels,
    curves: Decimator,
    /// How it ended, when it has.
    ended: Option<Value>,
    /// What is said about shaking, the newest of each kind.
    pub findings: Vec<Value>,
}

impl Running {
    pub fn of(graph: &Graph, hello: Value, scene: &Scene) -> Running {
        let channels = Channels::of(graph);
        let picture = Picture::of(scene, graph.timing.rate_hz, channels.topics().len());
        Running { hello, picture, channels, curves: Decimator::default(), ended: None, findings: Vec::new() }
    }
}

impl Past for Running {
    fn frames(&self) -> Vec<Frame> {
        let mut frames = vec![text(&self.hello), text(&json!({ "type": "channels", "channels": self.channels.known() }))];
        let (front, back) = self.curves.kept.as_slices();
        for part in [front, back] {
            frames.extend(part.chunks(AT_ONCE).map(|some| Frame::Binary(frames::newest(some).into())));
        }
        frames.push(text(&json!({ "type": "events", "events": self.picture.events })));
        frames.extend(self.findings.iter().chain(&self.ended).map(text));
        frames
    }
}

/// Shows every viewer, also later ones, how the run has ended.
pub(crate) fn end(hub: &Hub<Running>, how: &str) {
    let mut past = hub.past();
    if past.ended.is_none() {
        let ended = json!({ "type": "end", "text": how });
        hub.send(text(&ended));
        past.ended = Some(ended);
    }
}

/// The listeners of a run.
pub(crate) struct Tap {
    heard: Vec<Box<dyn Subscriber>>,
    /// Last, so that it outlives the ports that came from it.
    _transport: Box<dyn Transport>,
}

impl Tap {
    /// Listens to every topic of a run. It is to be made in the thread that uses it.
    pub fn open(paths: &RunPaths, topics: &Channels) -> Result<Tap, LiveError> {
        let place = Place::read(paths).map_err(LiveError::machine)?;
        let graph = read_graph(paths).map_err(LiveError::input)?;
        let name = format!("live_{}", std::process::id());
        let mut transport = place.join(paths, &graph, &name).map_err(LiveError::machine)?;
        let listen = |topic: &backdrive_nodes::build::GraphTopic| transport.subscriber(&topic.topic, usize::MAX, false);
        let heard = topics.topics().iter().map(listen).collect::<Result<_, _>>().map_err(LiveError::machine)?;
        Ok(Tap { heard, _transport: transport })
    }

    /// Takes over what has come, of each topic all; `see` is shown every message with the place of its topic.
    fn take(&mut self, mut see: impl FnMut(usize, &Message)) {
        for (index, subscriber) in self.heard.iter_mut().enumerate() {
            // A message that cannot be read is not shown; the recorder and the nodes report it.
            while let Ok(Some(message)) = subscriber.receive() {
                see(index, &message);
            }
        }
    }
}

/// Who else wants every message: the watch for shaking.
pub(crate) type Watcher = Box<dyn FnMut(usize, &Message) + Send>;

/// Carries from the run to the hub until `over`, or the run has ended.
pub(crate) fn carry(tap: &mut Tap, hub: &Hub<Running>, paths: &RunPaths, over: &AtomicBool, mut watchers: Vec<Watcher>) {
    let (mut published, mut looked) = (Instant::now(), Instant::now());
    let mut known = 0;
    loop {
        let due = Instant::now() + POLL;
        let ends = over.load(Ordering::SeqCst);
        {
            let mut past = hub.past();
            let Running { picture, channels, curves, .. } = &mut *past;
            let rate_hz = picture.rate_hz;
            let mut events = Vec::new();
            tap.take(|index, message| {
                watchers.iter_mut().for_each(|watch| watch(index, message));
                if let Some(topic) = channels.topics().get(index) {
                    events.extend(picture.take(index, topic, message));
                }
                if let Message::Sample(sample) = message {
                    let time_s = sample.step as f64 / rate_hz;
                    channels.each(index, sample, |curve, value| curves.put(curve, time_s, value));
                }
            });
            if channels.known().len() > known {
                known = channels.known().len();
                hub.send(text(&json!({ "type": "channels", "channels": channels.known() })));
            }
            let closed = curves.close(ends);
            if !closed.is_empty() {
                hub.send(Frame::Binary(frames::newest(&closed).into()));
            }
            if !events.is_empty() {
                hub.send(text(&json!({ "type": "events", "events": events })));
            }
            if published.elapsed() >= STATE_EVERY || ends {
                published = Instant::now();
                hub.send(text(&picture.state()));
            }
        }
        if ends {
            return;
        }
        if looked.elapsed() >= LOOK_EVERY {
            looked = Instant::now();
            if !backdrive_launch::alive::lives(paths) {
                over.store(true, Ordering::SeqCst);
                continue;
            }
        }
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}
