//! A run on several hosts: the supervisors find each other, start together, and report the state of the others.
//!
//! They know each other by a secret that they share, and inform their nodes whose messages to take. They talk on one topic, each reports its state twice a
//! second, and each measures the others' clocks. The first host of the graph announces when step 0 is due, in each host's own clock. A host that is restarted,
//! or late, learns from a running one when step 0 was, and joins at the step that is due.

mod absent;
mod clocks;
mod sealed;
mod words;

pub use words::Begun;

use crate::error::LaunchError;
use crate::plan::Plan;
use crate::session::Session;
use backdrive_bags::CLOCK_OFFSET;
use backdrive_msgs::text::Text;
use backdrive_msgs::{Event, LAYOUT, Message, source_id};
use backdrive_nodes::build::host_topic;
use backdrive_nodes::realtime;
use backdrive_nodes::transport::ros2::overheard::Overheard;
use backdrive_nodes::transport::ros2::{Delivery, Identity, Network, Ros2, Talk};
use backdrive_nodes::transport::{Publisher, Transport, TransportError};
use clocks::{Clocks, monotonic_ns, unix_ns};
use sealed::{Opened, Sealed, Speaker};
use std::collections::BTreeMap;
use std::hash::{BuildHasher, Hasher};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use words::Say;

/// Where the supervisors talk.
const TOPIC: &str = "/backdrive/hosts";

/// Below every node.
const PRIORITY: i32 = 30;

/// How often a host reports its state.
const HELLO_EVERY: Duration = Duration::from_millis(200);

/// A host that is not heard for this long is lost.
const LOST_AFTER: Duration = Duration::from_millis(1000);

/// How often a clock is measured: at first, and when it is known.
const PING_EVERY: [Duration; 2] = [Duration::from_millis(20), Duration::from_millis(250)];

/// How often a measured clock is reported.
const TELL_CLOCK_EVERY: Duration = Duration::from_secs(1);

/// Time between the word to start and step 0: every host and its nodes have heard it by then.
const LEAD_NS: i64 = 700_000_000;

/// Round trips before a clock counts as measured.
const ENOUGH: usize = 10;

/// A supervisor's report on itself.
#[derive(Debug, Clone, Default)]
pub(crate) struct Here {
    /// All its nodes are connected.
    pub ready: bool,
    /// What they lack.
    pub missing: Vec<String>,
    /// When step 0 is due here, once that is settled.
    pub begun: Option<Begun>,
    /// It ends.
    pub leaving: bool,
    stop: bool,
}

/// What the others mean for this one.
#[derive(Debug, Clone)]
pub(crate) enum There {
    /// Step 0 is due.
    Start(Begun),
    /// Who is missing, and why; empty when all are there.
    Missing(Vec<String>),
    /// Something that a person should know.
    Event(u32, &'static str, String),
    /// A host has ended in order.
    Left(String),
}

/// The other hosts of a run.
pub(crate) struct Hosts {
    here: Arc<Mutex<Here>>,
    there: Receiver<There>,
    thread: Option<JoinHandle<()>>,
}

impl Hosts {
    /// Begins to look for the others; `None` for a run on one host.
    pub fn begin(plan: &Plan, session: &Session) -> Result<Option<Hosts>, LaunchError> {
        let Some(name) = plan.place.host.clone().filter(|_| plan.hosts.len() > 1) else { return Ok(None) };
        let here = Arc::new(Mutex::new(Here::default()));
        let (send, there) = channel();
        let (opened, result) = channel();
        let (shared, plan, session) = (Arc::clone(&here), plan.clone(), session.clone());
        // Its ports belong to the thread that makes them.
        let thread = std::thread::spawn(move || {
            if plan.realtime() {
                // A host whose nodes run in time must not seem lost because its supervisor waits for a processor.
                let _ =
                    realtime::enter(&realtime::Options { priority: Some(PRIORITY), lock_memory: false, ..realtime::Options::default() });
            }
            match Round::open(&plan, session, name, send) {
                Ok(round) => {
                    let _ = opened.send(Ok(()));
                    round.go(&shared);
                }
                Err(e) => drop(opened.send(Err(e))),
            }
        });
        match result.recv() {
            Ok(Ok(())) => Ok(Some(Hosts { here, there, thread: Some(thread) })),
            Ok(Err(e)) => Err(LaunchError::Network { reason: e.to_string() }),
            Err(_) => Err(LaunchError::Network { reason: "its thread has ended".to_string() }),
        }
    }

    /// Reports the state of this host.
    pub fn tell(&self, change: impl FnOnce(&mut Here)) {
        change(&mut self.here.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// What there is to hear.
    pub fn hear(&self) -> Vec<There> {
        self.there.try_iter().collect()
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        self.tell(|here| (here.leaving, here.stop) = (true, true));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Another host.
struct Other {
    heard: Option<Instant>,
    /// Whose messages are its.
    speaker: Option<Speaker>,
    life: u64,
    ready: bool,
    missing: Vec<String>,
    begun: Option<Begun>,
    left: bool,
    lost: bool,
    clocks: Clocks,
    pinged: Option<Instant>,
    told: Option<Instant>,
}

struct Round {
    name: String,
    run: u64,
    life: u64,
    realtime: bool,
    network: Network,
    others: BTreeMap<String, Other>,
    leader: String,
    begun: Option<Begun>,
    talk: Talk,
    session: Session,
    sealed: Sealed,
    /// Somebody without the secret speaks where hosts do.
    foreign: bool,
    /// Another host was heard for the first time and waits to hear that.
    answers: bool,
    events: Option<Box<dyn Publisher>>,
    sequence: u64,
    rate_hz: f64,
    send: Sender<There>,
    overheard: Option<Overheard>,
    stranger: Option<String>,
    _ros2: Ros2,
}

impl Round {
    fn open(plan: &Plan, session: Session, name: String, send: Sender<There>) -> Result<Round, TransportError> {
        let network = plan.place.network.clone();
        let node = format!("host_{name}");
        let mut ros2 = Ros2::open(&network, &node, Delivery::BestEffort)?.with_identity(Identity::new(&session.known)?);
        let talk = ros2.talk(TOPIC)?;
        let events = match plan.realtime() {
            true => Some(ros2.publisher(&host_topic(&name), 1)?),
            false => None,
        };
        let other = || Other {
            heard: None,
            speaker: None,
            life: 0,
            ready: false,
            missing: Vec::new(),
            begun: None,
            left: false,
            lost: false,
            clocks: Clocks::default(),
            pinged: None,
            told: None,
        };
        Ok(Round {
            run: plan.fingerprint(),
            life: std::hash::RandomState::new().build_hasher().finish(),
            realtime: plan.realtime(),
            others: plan.hosts.iter().filter(|h| **h != name).map(|h| (h.clone(), other())).collect(),
            leader: plan.hosts[0].clone(),
            begun: None,
            talk,
            sealed: Sealed::new(&session),
            session,
            foreign: false,
            answers: false,
            events,
            sequence: 0,
            rate_hz: plan.timing.rate_hz,
            send,
            overheard: Some(Overheard::begin()),
            stranger: None,
            network,
            name,
            _ros2: ros2,
        })
    }

    fn go(mut self, shared: &Mutex<Here>) {
        let (mut said, mut looked) = (None::<Instant>, Instant::now());
        loop {
            self.talk.wait(Duration::from_millis(10));
            while let Some(text) = self.talk.hear() {
                match self.sealed.open(&text) {
                    Opened::Said(speaker, say) => self.hear(&speaker, say),
                    Opened::Unproven { first } => self.answers |= first,
                    Opened::Foreign => self.hear_foreign(),
                    Opened::Nothing => {}
                }
            }
            let here = shared.lock().unwrap_or_else(PoisonError::into_inner).clone();
            self.begun = here.begun.or(self.begun);
            if here.stop || std::mem::take(&mut self.answers) || said.is_none_or(|at| at.elapsed() >= HELLO_EVERY) {
                said = Some(Instant::now());
                self.hello(&here);
            }
            if here.stop {
                // Once more, for one may be lost with the end of its sender.
                std::thread::sleep(Duration::from_millis(50));
                self.hello(&here);
                return;
            }
            self.measure();
            self.settle(&here);
            self.find_lost();
            if looked.elapsed() >= Duration::from_millis(500) {
                looked = Instant::now();
                self.look(&here);
            }
        }
    }

    fn say(&mut self, say: &Say) {
        if let Some(text) = self.sealed.seal(say) {
            self.talk.say(&text);
        }
    }

    fn hello(&mut self, here: &Here) {
        // Nodes that begin together take each other's first messages.
        let met = self.begun.is_some() || self.others.values().all(|o| o.speaker.is_some());
        let heard = self.sealed.heard();
        self.say(&Say::Hello {
            run: self.run,
            host: self.name.clone(),
            life: self.life,
            ready: here.ready && met,
            missing: here.missing.clone(),
            begun: self.begun,
            leaving: here.leaving,
            heard,
        });
    }

    /// Reported so that a person knows; nothing of it is accepted.
    fn hear_foreign(&mut self) {
        if !std::mem::replace(&mut self.foreign, true) {
            self.event(1, "host_secret", "a program without this run's secret sends as a host; it is ignored");
        }
    }

    /// Takes this speaker for the host, and informs the nodes whose messages are the host's.
    fn take_for(&mut self, host: &str, speaker: &Speaker) {
        if let Some(other) = self.others.get_mut(host) {
            other.speaker = Some(speaker.clone());
        }
        let of = |(host, other): (&String, &Other)| {
            let speaker = other.speaker.as_ref()?;
            Some((host.clone(), Session::member(&self.session.secret, &speaker.run, &speaker.nonce)))
        };
        self.session.known.others = self.others.iter().filter_map(of).collect();
        if let Err(e) = self.session.known.write(&self.session.path) {
            self.event(2, "host_unknown", &format!("the nodes cannot be informed about host `{host}`, and refuse it: {e}"));
        }
    }

    fn hear(&mut self, speaker: &Speaker, say: Say) {
        let is_known = self.others.values().any(|o| o.speaker.as_ref() == Some(speaker));
        match say {
            Say::Hello { run, host, life, ready, missing, begun, leaving, .. } => {
                if host == self.name {
                    if life != self.life && self.stranger.is_none() {
                        self.stranger = Some(host.clone());
                        self.event(2, "host_twice", &format!("another program runs as host `{host}` on this network; end one of them"));
                    }
                    return;
                }
                let Some(other) = self.others.get_mut(&host) else { return };
                if run != self.run {
                    if self.stranger.replace(host.clone()).is_none() {
                        self.event(2, "host_differs", &format!("host `{host}` runs another graph, or this one with other options"));
                    }
                    return;
                }
                let is_same = other.speaker.as_ref() == Some(speaker);
                let lives = other.heard.is_some_and(|at| at.elapsed() < LOST_AFTER) && !other.left;
                if other.speaker.is_some() && !is_same && lives {
                    // The one that was here first is the host, until it is not heard any more.
                    if self.stranger.replace(host.clone()).is_none() {
                        self.event(2, "host_twice", &format!("two programs run as host `{host}`; the second is ignored: end one of them"));
                    }
                    return;
                }
                let (known, returns) = (other.heard.is_some(), other.heard.is_some() && other.life != life);
                let was_lost = std::mem::take(&mut other.lost);
                if returns {
                    // Another machine may have taken its place, with another clock.
                    other.clocks = Clocks::default();
                }
                (other.heard, other.life, other.ready, other.missing) = (Some(Instant::now()), life, ready, missing);
                other.begun = begun;
                if returns {
                    other.left = false;
                }
                let left = leaving && !std::mem::replace(&mut other.left, leaving);
                if !is_same {
                    self.take_for(&host, speaker);
                }
                if known && (returns || was_lost) {
                    self.event(0, "host_back", &format!("host `{host}` responds again"));
                }
                if left {
                    self.event(0, "host_left", &format!("host `{host}` has ended its run"));
                    let _ = self.send.send(There::Left(host));
                }
            }
            // Only what the hosts say that are taken for them.
            _ if !is_known => {}
            Say::Ping { from, to, at_ns } if to == self.name => {
                self.say(&Say::Pong { from: to, to: from, at_ns, monotonic_ns: monotonic_ns(), unix_ns: unix_ns() });
            }
            Say::Pong { from, to, at_ns, monotonic_ns: there_ns, unix_ns: there_unix_ns } if to == self.name => {
                if let Some(other) = self.others.get_mut(&from) {
                    other.clocks.take(at_ns, there_ns, there_unix_ns);
                }
            }
            Say::Start { to, life, begun } if to == self.name && life == self.life => self.start(begun),
            // For other hosts, or for an earlier life of this one.
            Say::Ping { .. } | Say::Pong { .. } | Say::Start { .. } => {}
        }
    }

    fn start(&mut self, begun: Begun) {
        if self.begun.is_none() {
            self.begun = Some(begun);
            let _ = self.send.send(There::Start(begun));
        }
    }

    /// Asks the others for their clocks, and reports the result.
    fn measure(&mut self) {
        let mut told = Vec::new();
        for (host, other) in &mut self.others {
            let every = PING_EVERY[usize::from(other.clocks.len() >= ENOUGH)];
            if other.heard.is_some() && other.pinged.is_none_or(|at| at.elapsed() >= every) {
                other.pinged = Some(Instant::now());
                let ping = Say::Ping { from: self.name.clone(), to: host.clone(), at_ns: monotonic_ns() };
                if let Some(text) = self.sealed.seal(&ping) {
                    self.talk.say(&text);
                }
            }
            if self.begun.is_some()
                && other.told.is_none_or(|at| at.elapsed() >= TELL_CLOCK_EVERY)
                && let Some(offset) = other.clocks.unix(host, &self.name)
            {
                other.told = Some(Instant::now());
                told.push(offset);
            }
        }
        for offset in told {
            self.publish(0, CLOCK_OFFSET, offset.offset_s(), &offset.to_string());
        }
    }

    /// Settles when step 0 is due.
    fn settle(&mut self, here: &Here) {
        let me_ready = here.ready || self.begun.is_some();
        // Whoever runs already knows.
        if self.begun.is_none() && here.ready {
            let known = self.others.values().find_map(|o| Some((o.begun?, o.clocks.monotonic()?)));
            if let Some((there, offset_ns)) = known {
                self.start(Begun { t0_ns: there.t0_ns - offset_ns, unix_ns: there.unix_ns });
            }
        }
        let leads = self.name == self.leader;
        if leads && me_ready && self.begun.is_none() && self.others.values().all(|o| o.ready && o.clocks.len() >= ENOUGH) {
            self.start(Begun { t0_ns: monotonic_ns() + LEAD_NS, unix_ns: unix_ns() + LEAD_NS });
        }
        // Every running host informs every waiting one.
        if let Some(begun) = self.begun {
            let waiting = self.others.iter().filter(|(_, o)| o.heard.is_some() && o.ready && o.begun.is_none() && !o.left);
            let starts = waiting.filter_map(|(host, other)| {
                let offset_ns = other.clocks.monotonic()?;
                let there = Begun { t0_ns: begun.t0_ns + offset_ns, unix_ns: begun.unix_ns };
                Some(Say::Start { to: host.clone(), life: other.life, begun: there })
            });
            for start in starts.collect::<Vec<_>>() {
                self.say(&start);
            }
        }
    }

    /// Who was heard, and is not any more.
    fn find_lost(&mut self) {
        let mut lost = Vec::new();
        for (host, other) in &mut self.others {
            if !other.lost && !other.left && other.heard.is_some_and(|at| at.elapsed() >= LOST_AFTER) {
                other.lost = true;
                lost.push(host.clone());
            }
        }
        for host in lost {
            self.event(2, "host_lost", &format!("host `{host}` no longer responds; its nodes may still run"));
        }
    }

    /// Reports to a person, and to the bag.
    fn event(&mut self, severity: u32, kind: &'static str, text: &str) {
        self.publish(severity, kind, backdrive_msgs::NOT_MEASURED, text);
        let _ = self.send.send(There::Event(severity, kind, text.to_string()));
    }

    fn publish(&mut self, severity: u32, kind: &'static str, value: f64, text: &str) {
        let Some(events) = &mut self.events else { return };
        let since = self.begun.map_or(0, |b| monotonic_ns() - b.t0_ns).max(0);
        let step = (since as f64 * 1e-9 * self.rate_hz) as u64;
        let source = source_id(&format!("host_{}", self.name));
        let stamp_ns = self.begun.map_or_else(unix_ns, |b| b.unix_ns + since);
        let (kind, text) = (Text::new(kind), Text::new(text));
        let event = Event { layout: LAYOUT, source, step, sequence: self.sequence, stamp_ns, severity, reserved: 0, value, kind, text };
        self.sequence += 1;
        let _ = events.send(&Message::Event(event));
        debug_assert!(self.realtime);
    }
}
