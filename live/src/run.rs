//! The window on a run.

use crate::access::Role;
use crate::error::LiveError;
use crate::heal::{Healer, Level, Shakes, WhyOptions};
use crate::hub::Hub;
use crate::onset::OnsetWatch;
use crate::scene::Scene;
use crate::serve::{Desk, Reply, Server, yield_to_others};
use crate::steer::{Bounds, Done, Steer};
use crate::tap::{Running, Tap, Watcher, carry, end};
use axum::extract::ws::Message as Frame;
use backdrive_launch::join::read_graph;
use backdrive_launch::{Place, RunPaths};
use backdrive_msgs::{Gains, Message};
use backdrive_nodes::build::topics;
use backdrive_nodes::graph::{Graph, Settings};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::broadcast;

/// How a run is shown.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Where the page is served, port 0 for one that is free; `None` without a page.
    pub address: Option<SocketAddr>,
    /// Greatest force scale that may be set from the page; `None` for that of [`Bounds::of`].
    pub most_lambda: Option<f64>,
    /// Whether it is watched for shaking.
    pub why: Option<WhyOptions>,
}

/// Where sentences for the terminal go.
pub type Say = Arc<dyn Fn(&str) + Send + Sync>;

/// A window on a run, while it exists.
pub struct Live {
    hub: Arc<Hub<Running>>,
    over: Arc<AtomicBool>,
    tap: Option<JoinHandle<()>>,
    healer: Option<JoinHandle<()>>,
    server: Option<Server>,
}

struct RunDesk {
    hub: Arc<Hub<Running>>,
    steer: Arc<Steer>,
    healer: Option<Arc<Healer>>,
}

impl Live {
    /// Opens a window on a run.
    ///
    /// # Errors
    /// It is no run, it cannot be heard, or the address cannot be had.
    pub fn open(paths: &RunPaths, options: &Options, say: Say) -> Result<Live, LiveError> {
        let place = Place::read(paths).map_err(LiveError::machine)?;
        let mut graph = read_graph(paths).map_err(LiveError::input)?;
        if place.host.is_none() {
            graph = graph.on_one_host();
        }
        let (scene, bounds) = (Scene::of(&graph), Bounds::of(&graph, options.most_lambda));
        let hello = json!({
            "type": "hello",
            "mode": "run",
            "run": paths.id(),
            "title": graph.title,
            "rate_hz": graph.timing.rate_hz,
            "clock": graph.timing.clock.word(),
            "duration_s": graph.duration_s(),
            "scene": scene,
            "bounds": bounds,
            "records": graph.bag.is_some(),
        });
        let hub = Hub::new(Running::of(&graph, hello, &scene));
        let over = Arc::new(AtomicBool::new(false));
        let steer = Arc::new(Steer::new(paths.clone(), bounds, scene.has_guard));
        let level = Level::default();
        let (shakes, watcher) = match &options.why {
            None => (None, None),
            Some(_) => {
                let (tell, shakes) = channel();
                (Some(shakes), watcher(&graph, &scene, &level, tell, &say))
            }
        };
        let healer = options.why.as_ref().map(|why| {
            let (hub, steer, over) = (Arc::clone(&hub), Arc::clone(&steer), Arc::clone(&over));
            let bag = graph.bag_of(place.host.as_deref());
            let unit = scene.devices.iter().find(|d| d.role == "master").map_or("mm", |d| if d.unit == "rad" { "mrad" } else { "mm" });
            Arc::new(Healer { hub, steer, options: why.clone(), bag, unit, level, over, offer: Arc::default(), say })
        });
        let answering = match (healer.clone(), shakes) {
            (Some(healer), Some(shakes)) => {
                let answer = move || {
                    yield_to_others();
                    healer.run(&shakes);
                };
                Some(std::thread::Builder::new().name("live-why".to_string()).spawn(answer).map_err(LiveError::machine)?)
            }
            _ => None,
        };
        let tap = start_tap(paths, &graph, &hub, &over, watcher)?;
        let desk = RunDesk { hub: Arc::clone(&hub), steer, healer };
        let server = options.address.map(|address| Server::start(Arc::new(desk), address)).transpose()?;
        Ok(Live { hub, over, tap: Some(tap), healer: answering, server })
    }

    /// Addresses of the page: with the right to change something, and with the right to look only; `None` without a page.
    pub fn urls(&self) -> Option<[String; 2]> {
        self.server.as_ref().map(Server::urls)
    }

    /// Waits until the run has ended, or `stop` is true.
    pub fn wait(&self, stop: &AtomicBool) {
        while !self.over.load(Ordering::SeqCst) && !stop.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Shows how the run has ended, and closes.
    pub fn end(mut self, how: &str) {
        self.close(how);
    }

    fn close(&mut self, how: &str) {
        self.over.store(true, Ordering::SeqCst);
        // The tap first: with it the watch ends that the other waits for.
        for thread in [self.tap.take(), self.healer.take()].into_iter().flatten() {
            let _ = thread.join();
        }
        end(&self.hub, how);
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.close("the run has ended");
    }
}

/// An oscillation below this RMS is left alone, N or N m: about what a finger does not feel, and no less than the dither.
const LEAST_FORCE: f64 = 0.02;

/// The gains in force this long before an onset was found are those at which it began.
const BEFORE: Duration = Duration::from_millis(400);

/// Watches a run for shaking; `None`, with a word to the terminal, where nothing of it shows that.
fn watcher(graph: &Graph, scene: &Scene, level: &Level, tell: Sender<Shakes>, say: &Say) -> Option<Watcher> {
    let topics = topics(graph);
    let place = |name: &str| topics.iter().position(|t| t.topic.name == name);
    let Some(master) = scene.devices.iter().find(|d| d.role == "master").and_then(|d| place(&d.topic)) else {
        say("note: it is not watched for shaking: the graph has no master");
        return None;
    };
    let dither = graph.nodes.iter().filter_map(|n| if let Settings::Scaling { dither, .. } = &n.settings { Some(dither) } else { None });
    let least = dither.flatten().flatten().fold(LEAST_FORCE, |peak, d| peak.max(d.abs()));
    let mut watch = OnsetWatch::new(least, graph.timing.rate_hz);
    let before = (BEFORE.as_secs_f64() * graph.timing.rate_hz) as u64;
    let (level, mut gains) = (Arc::clone(level), VecDeque::from([(0, graph.gains.mu, graph.gains.lambda)]));
    Some(Box::new(move |index, message| match message {
        Message::Gains(Gains { step, mu, lambda, .. }) => gains.push_back((*step, *mu, *lambda)),
        Message::Sample(sample) if index == master => {
            while gains.get(1).is_some_and(|(step, ..)| step + before <= sample.step) {
                gains.pop_front();
            }
            let onset = watch.take(sample);
            if sample.step % 32 == 0 {
                *level.lock().unwrap_or_else(PoisonError::into_inner) = watch.level();
            }
            if let (Some(onset), Some((_, mu, lambda))) = (onset, gains.front()) {
                // Who answers may have ended.
                let _ = tell.send(Shakes { onset, mu: *mu, lambda: *lambda });
            }
        }
        _ => {}
    }))
}

/// Listens in a thread of its own; returns when it does.
fn start_tap(
    paths: &RunPaths,
    graph: &Graph,
    hub: &Arc<Hub<Running>>,
    over: &Arc<AtomicBool>,
    watcher: Option<Watcher>,
) -> Result<JoinHandle<()>, LiveError> {
    let (paths, hub, over) = (paths.clone(), Arc::clone(hub), Arc::clone(over));
    let channels = crate::channels::Channels::of(graph);
    let (opened, opens) = std::sync::mpsc::channel();
    let listening = move || {
        yield_to_others();
        match Tap::open(&paths, &channels) {
            Ok(mut tap) => {
                let _ = opened.send(Ok(()));
                carry(&mut tap, &hub, &paths, &over, watcher.into_iter().collect());
            }
            Err(e) => {
                let _ = opened.send(Err(e));
            }
        }
    };
    let thread = std::thread::Builder::new().name("live-tap".to_string()).spawn(listening).map_err(LiveError::machine)?;
    opens.recv().map_err(|_| LiveError::machine("the listener of the page has ended"))??;
    Ok(thread)
}

impl Desk for RunDesk {
    fn join(&self) -> (Vec<Frame>, broadcast::Receiver<Frame>) {
        self.hub.join()
    }

    fn answer(&self, asked: &Value, role: Role, by: &str) -> Reply {
        let done = match role {
            Role::Control => self.obey(asked, by),
            Role::Watch => {
                self.steer.refused(by, "its address gives the right to look only");
                Err("this page may look only: open the address that the run printed first".to_string())
            }
        };
        Reply::Words(match done {
            Ok(text) => json!({ "done": true, "text": text }),
            Err(text) => json!({ "done": false, "text": text }),
        })
    }

    fn refused(&self, by: &str, why: &str) {
        self.steer.refused(by, why);
    }
}

impl RunDesk {
    fn obey(&self, asked: &Value, by: &str) -> Done {
        let past = self.hub.past();
        let snapshot = past.picture.known();
        drop(past);
        match asked.get("do").and_then(Value::as_str) {
            Some("gain") => self.steer.gain(asked.get("lambda").and_then(Value::as_f64).unwrap_or(f64::NAN), &snapshot, by),
            Some("canceller") => match asked.get("on").and_then(Value::as_bool) {
                Some(on) => self.steer.canceller(on, by),
                None => Err("`on` must be true or false".to_string()),
            },
            Some("stop") => self.steer.stop(&snapshot, by),
            Some("remark") => self.steer.remark(asked.get("text").and_then(Value::as_str).unwrap_or_default()),
            Some("heal") => self.healer.as_ref().ok_or("the run is not watched for shaking; --why does that")?.apply_offer(),
            other => Err(format!("`do` is {other:?}; expected gain, canceller, stop, heal or remark")),
        }
    }
}
