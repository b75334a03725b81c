//! What every transport promises, instantiated for each.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_msgs::text::Text;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Event, Gains, LAYOUT, Message, NOT_MEASURED, Sample, Status};
use backdrive_nodes::clock::now_ns;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::inproc::Hub;
use backdrive_nodes::transport::ros2::{Delivery, Identity, Key, Known, Member, Network, Ros2};
use backdrive_nodes::transport::{Location, Publisher, Subscriber, Transport, TransportError};
use naming::assert_names;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// A run in which nodes can meet.
trait World: Sync {
    fn join(&self, name: &str) -> Box<dyn Transport>;

    /// Whether what is sent is with the receiver when it has been sent.
    fn arrives_at_once(&self) -> bool {
        true
    }

    /// How long a message or the news of a connection may take.
    fn patience(&self) -> Duration {
        Duration::ZERO
    }

    /// What becomes of a sample on its way.
    fn carried(&self, sample: Sample) -> Sample {
        sample
    }
}

impl World for Hub {
    fn join(&self, _: &str) -> Box<dyn Transport> {
        Box::new(Hub::join(self))
    }
}

/// A run over shared memory that leaves nothing behind.
struct SharedMemory(Location);

impl SharedMemory {
    fn new() -> SharedMemory {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let name = format!("conform{}_{}_", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        SharedMemory(Location { root: std::env::temp_dir().join(&name), prefix: name })
    }
}

impl World for SharedMemory {
    fn join(&self, name: &str) -> Box<dyn Transport> {
        Box::new(Iceoryx2::open(&self.0, name).unwrap())
    }
}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        self.0.remove().unwrap();
    }
}

/// A run in a domain of its own, among those whose ports no other program is given.
struct Domain(Network, Identity);

/// Who a run of this name is, with a key that no other has.
fn identity(run: &str) -> Identity {
    let own = Member { run: run.to_string(), key: Key::fresh().unwrap() };
    Identity::new(&Known { own, several: false, others: Vec::new() }).unwrap()
}

impl Domain {
    fn new() -> Domain {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let domain = 10 + (std::process::id() + COUNT.fetch_add(1, Ordering::Relaxed)) % 90;
        Domain(Network { domain: domain as u16, ..Network::default() }, identity("a1"))
    }
}

impl World for Domain {
    fn join(&self, name: &str) -> Box<dyn Transport> {
        Box::new(Ros2::open(&self.0, name, Delivery::Reliable).unwrap().with_identity(self.1.clone()))
    }

    fn patience(&self) -> Duration {
        Duration::from_secs(20)
    }

    fn arrives_at_once(&self) -> bool {
        false
    }

    /// A NaN means "not measured", whatever its bits.
    fn carried(&self, mut sample: Sample) -> Sample {
        let values = sample.position.iter_mut().chain(&mut sample.velocity).chain(&mut sample.effort);
        values.filter(|v| v.is_nan()).for_each(|v| *v = NOT_MEASURED);
        sample
    }
}

/// Whether it comes true within the world's patience.
fn eventually(world: &dyn World, mut is_true: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    loop {
        if is_true() {
            return true;
        }
        if begun.elapsed() >= world.patience() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The next message, within the world's patience.
fn next(world: &dyn World, subscriber: &mut dyn Subscriber) -> Option<Message> {
    let mut received = None;
    eventually(world, || {
        received = subscriber.receive().unwrap();
        received.is_some()
    });
    received
}

/// Time in which whatever is still on its way arrives.
fn settle(world: &dyn World) {
    std::thread::sleep(world.patience() / 40);
}

macro_rules! conform {
    ($($test:ident),* $(,)?) => {
        mod inproc {
            $(#[test] fn $test() { super::$test(&super::Hub::default(), &super::Hub::default()) })*
        }
        mod iceoryx2 {
            $(#[test] fn $test() { super::$test(&super::SharedMemory::new(), &super::SharedMemory::new()) })*
        }
        mod ros2 {
            $(#[test] fn $test() { super::$test(&super::Domain::new(), &super::Domain::new()) })*
        }
    };
}

/// Names of the types that a folder's files make a transport of.
fn transports_in(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            transports_in(&entry, found);
        } else {
            let text = std::fs::read_to_string(&entry).unwrap();
            found.extend(text.split("\nimpl Transport for ").skip(1).filter_map(|rest| rest.split(' ').next()).map(str::to_string));
        }
    }
}

#[test]
fn every_transport_conforms() {
    let mut found = Vec::new();
    transports_in(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/transport"), &mut found);
    assert!(found.len() >= 3, "{found:?}");
    let here = include_str!("transport_conformance.rs");
    for name in found {
        assert!(here.contains(&format!("mod {} {{", name.to_lowercase())), "{name} is no instance of conform!");
    }
}

conform!(
    delivers_in_order_and_bit_for_bit,
    a_flipped_bit_is_noticed,
    overflow_drops_the_oldest,
    a_late_joiner_sees_the_last_events_but_no_samples,
    counts_listeners_and_knows_its_publisher,
    waits_and_wakes,
    a_poller_is_not_woken_and_loses_nothing,
    runs_do_not_meet,
    a_publisher_may_come_again,
    carries_every_kind_and_no_other,
    refuses_another_layout,
    two_listeners_get_everything,
    tells_when_each_message_came,
);

fn topic(name: &str, kind: Kind) -> Topic {
    Topic { name: name.to_string(), kind }
}

fn samples() -> Topic {
    topic("/arm/measured_js", Kind::Sample)
}

fn sample(sequence: u64) -> Message {
    Message::Sample(Sample { step: sequence, sequence, ..Sample::new(2) })
}

/// The next `count` messages, and whatever else is there.
fn sequences(world: &dyn World, subscriber: &mut Box<dyn Subscriber>, count: usize) -> Vec<u64> {
    let mut heard: Vec<u64> = (0..count).map_while(|_| next(world, &mut **subscriber)).map(|m| m.sequence()).collect();
    heard.extend(std::iter::from_fn(|| subscriber.receive().unwrap()).map(|m| m.sequence()));
    heard
}

/// NaNs with payloads, signed zeros, subnormals: everything a copy through floating point might change.
fn odd_sample(sequence: u64) -> Sample {
    let mut sample = Sample { step: u64::MAX - sequence, sequence, stamp_ns: i64::MIN, flags: 7, ..Sample::new(8) };
    let odd = [0x7ff0_0000_0000_0001, 0xfff8_dead_beef_0001, 1 << 63, 1, 0x7ff0_0000_0000_0000, 0xfff0_0000_0000_0000, u64::MAX, 0];
    for (i, bits) in odd.into_iter().enumerate() {
        sample.position[i] = f64::from_bits(bits);
        sample.velocity[i] = f64::from_bits(bits.rotate_left(7));
        sample.effort[i] = f64::from_bits(bits ^ sequence);
    }
    sample
}

/// The sequence number of the first sample that arrives changed.
fn first_difference(world: &dyn World, sender: &mut dyn Publisher, receiver: &mut dyn Subscriber) -> Option<u64> {
    (0..1000).find(|sequence| {
        sender.send(&Message::Sample(odd_sample(*sequence))).unwrap();
        let expected = world.carried(odd_sample(*sequence));
        !matches!(next(world, receiver), Some(Message::Sample(s)) if s.same_bits(&expected))
    })
}

fn delivers_in_order_and_bit_for_bit(world: &dyn World, _: &dyn World) {
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    let mut receiver = b.subscriber(&samples(), 16, true).unwrap();
    let mut sender = a.publisher(&samples(), 1).unwrap();
    assert!(eventually(world, || receiver.has_publisher() && sender.listeners() == 1));
    assert_eq!(first_difference(world, &mut *sender, &mut *receiver), None);
    assert!(receiver.receive().unwrap().is_none());
}

/// Flips one bit of one message on its way.
struct Flipping(Box<dyn Publisher>);

impl Publisher for Flipping {
    fn send(&mut self, message: &Message) -> Result<(), TransportError> {
        let mut message = *message;
        if let Message::Sample(s) = &mut message
            && s.sequence == 500
        {
            s.velocity[7] = f64::from_bits(s.velocity[7].to_bits() ^ 1);
        }
        self.0.send(&message)
    }

    fn listeners(&self) -> usize {
        self.0.listeners()
    }
}

fn a_flipped_bit_is_noticed(world: &dyn World, _: &dyn World) {
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    let mut receiver = b.subscriber(&samples(), 16, true).unwrap();
    let mut sender = Flipping(a.publisher(&samples(), 1).unwrap());
    assert!(eventually(world, || receiver.has_publisher() && sender.listeners() == 1));
    assert_eq!(first_difference(world, &mut sender, &mut *receiver), Some(500));
}

fn overflow_drops_the_oldest(world: &dyn World, _: &dyn World) {
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    let (mut short, mut long) = (b.subscriber(&samples(), 8, false).unwrap(), b.subscriber(&samples(), 100, false).unwrap());
    let mut sender = a.publisher(&samples(), 2).unwrap();
    assert!(eventually(world, || short.has_publisher() && long.has_publisher() && sender.listeners() == 2));
    (0..50).for_each(|i| sender.send(&sample(i)).unwrap());
    settle(world);
    assert_eq!(sequences(world, &mut short, 8), (42..50).collect::<Vec<_>>());
    assert_eq!(sequences(world, &mut long, 50), (0..50).collect::<Vec<_>>());
}

fn event(sequence: u64) -> Message {
    let (kind, text) = (Text::new("tested"), Text::new("a test happens"));
    let (layout, source, step, stamp_ns, severity, reserved, value) = (LAYOUT, 1, sequence, 0, 0, 0, 1.5);
    Message::Event(Event { layout, source, step, sequence, stamp_ns, severity, reserved, value, kind, text })
}

fn a_late_joiner_sees_the_last_events_but_no_samples(world: &dyn World, _: &dyn World) {
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    let events = topic("/arm/events", Kind::Event);
    let (mut sender, mut event_sender) = (a.publisher(&samples(), 1).unwrap(), a.publisher(&events, 1).unwrap());
    (0..5).for_each(|i| sender.send(&sample(i)).unwrap());
    (0..5).for_each(|i| event_sender.send(&event(i)).unwrap());
    let (mut receiver, mut event_receiver) = (b.subscriber(&samples(), 16, true).unwrap(), b.subscriber(&events, 16, true).unwrap());
    assert!(eventually(world, || receiver.has_publisher() && event_receiver.has_publisher()));
    assert!(eventually(world, || sender.listeners() == 1 && event_sender.listeners() == 1));
    sender.send(&sample(5)).unwrap();
    event_sender.send(&event(5)).unwrap();
    assert_eq!(sequences(world, &mut receiver, 1), [5]);
    assert_eq!(sequences(world, &mut event_receiver, 6), [0, 1, 2, 3, 4, 5]);
}

fn counts_listeners_and_knows_its_publisher(world: &dyn World, _: &dyn World) {
    let (mut a, mut b, mut c) = (world.join("a"), world.join("b"), world.join("c"));
    let sender = a.publisher(&samples(), 2).unwrap();
    assert_eq!(sender.listeners(), 0);
    let first = b.subscriber(&samples(), 16, true).unwrap();
    let second = c.subscriber(&samples(), 16, false).unwrap();
    assert!(eventually(world, || sender.listeners() == 2));
    drop(second);
    assert!(eventually(world, || sender.listeners() == 1));
    assert!(eventually(world, || first.has_publisher()));
    drop(sender);
    assert!(eventually(world, || !first.has_publisher()));
}

fn waits_and_wakes(world: &dyn World, _: &dyn World) {
    let mut b = world.join("b");
    let mut receiver = b.subscriber(&samples(), 16, true).unwrap();
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_millis(50) {
        b.wait(Duration::from_millis(50).saturating_sub(begun.elapsed())).unwrap();
    }
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut a = world.join("a");
            let mut sender = a.publisher(&samples(), 1).unwrap();
            assert!(eventually(world, || sender.listeners() == 1));
            settle(world);
            for i in 0..200 {
                std::thread::sleep(Duration::from_micros(i * 7 % 500));
                sender.send(&sample(i)).unwrap();
            }
            // Until all is taken: it ends with its publisher otherwise.
            std::thread::sleep(Duration::from_millis(100));
        });
        let begun = Instant::now();
        let mut next = 0;
        while next < 200 {
            match receiver.receive().unwrap() {
                Some(m) => {
                    // What was sent before it was connected may be missing.
                    assert!(m.sequence() >= next);
                    next = m.sequence() + 1;
                }
                None => b.wait(Duration::from_secs(10)).unwrap(),
            }
        }
        // A lost wake would have cost ten seconds.
        assert!(begun.elapsed() < Duration::from_secs(9) + world.patience());
    });
}

fn a_poller_is_not_woken_and_loses_nothing(world: &dyn World, _: &dyn World) {
    const MESSAGES: u64 = 100_000;
    let mut b = world.join("b");
    let mut receiver = b.subscriber(&samples(), usize::MAX, false).unwrap();
    let taken = std::sync::atomic::AtomicU64::new(0);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut a = world.join("a");
            let mut sender = a.publisher(&samples(), 1).unwrap();
            while sender.listeners() < 1 {}
            settle(world);
            for i in 0..MESSAGES {
                // As a source in lockstep: no further ahead than the buffer.
                while i >= taken.load(Ordering::SeqCst) + 2048 {
                    std::thread::sleep(Duration::from_micros(200));
                }
                sender.send(&sample(i)).unwrap();
            }
            while taken.load(Ordering::SeqCst) < MESSAGES {
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        let mut next = 0;
        while next < MESSAGES {
            while let Some(m) = receiver.receive().unwrap() {
                assert_eq!(m.sequence(), next);
                next += 1;
            }
            taken.store(next, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(1));
        }
    });
}

fn runs_do_not_meet(world: &dyn World, other: &dyn World) {
    let (mut a, mut b) = (world.join("a"), other.join("a"));
    let mut sender = a.publisher(&samples(), 1).unwrap();
    let mut stranger = b.subscriber(&samples(), 16, true).unwrap();
    sender.send(&sample(0)).unwrap();
    assert!(!stranger.has_publisher() && sender.listeners() == 0);
    assert!(stranger.receive().unwrap().is_none());
    // Nor are they woken by each other.
    let begun = Instant::now();
    b.wait(Duration::from_millis(1)).unwrap();
    b.wait(Duration::from_millis(20)).unwrap();
    assert!(begun.elapsed() >= Duration::from_millis(20));
}

fn a_publisher_may_come_again(world: &dyn World, _: &dyn World) {
    let mut b = world.join("b");
    let mut receiver = b.subscriber(&samples(), usize::MAX, true).unwrap();
    for _ in 0..3 {
        let mut a = world.join("a");
        let mut sender = a.publisher(&samples(), 1).unwrap();
        assert!(eventually(world, || receiver.has_publisher() && sender.listeners() == 1));
        (0..1000).for_each(|i| sender.send(&sample(i)).unwrap());
        drop(sender);
        drop(a);
        // What it sent outlives it.
        assert_eq!(sequences(world, &mut receiver, 1000), (0..1000).collect::<Vec<_>>());
        assert!(eventually(world, || !receiver.has_publisher()));
    }
}

fn carries_every_kind_and_no_other(world: &dyn World, _: &dyn World) {
    let gains = Message::Gains(Gains { layout: LAYOUT, source: 1, step: 2, sequence: 3, stamp_ns: 4, mu: 5.0, lambda: 6.0, ramp_s: 7.0 });
    let (missed_deadlines, lost, loop_p50_s, loop_p99_s) = (6, 7, 8.0, 9.0);
    let status =
        Status { layout: LAYOUT, source: 1, step: 2, sequence: 3, stamp_ns: 4, steps: 5, missed_deadlines, lost, loop_p50_s, loop_p99_s };
    let messages = [sample(3), gains, event(3), Message::Status(status)];
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    for (i, message) in messages.iter().enumerate() {
        let topic = topic(&format!("/topic_{i}"), message.kind());
        let mut receiver = b.subscriber(&topic, 16, true).unwrap();
        let mut sender = a.publisher(&topic, 1).unwrap();
        assert!(eventually(world, || receiver.has_publisher() && sender.listeners() == 1));
        sender.send(message).unwrap();
        let received = next(world, &mut *receiver).unwrap();
        // Through their text: a NaN differs from itself.
        assert_eq!(format!("{received:?}"), format!("{message:?}"));
        let refused = sender.send(&messages[(i + 1) % messages.len()]).unwrap_err().to_string();
        assert!(refused.contains("carries"), "{refused}");
        assert!(receiver.receive().unwrap().is_none());
        // The same name cannot mean something else.
        let other = Topic { kind: messages[(i + 1) % messages.len()].kind(), ..topic };
        assert!(b.subscriber(&other, 16, true).is_err());
    }
}

fn refuses_another_layout(world: &dyn World, _: &dyn World) {
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    let mut receiver = b.subscriber(&samples(), 16, true).unwrap();
    let mut sender = a.publisher(&samples(), 1).unwrap();
    assert!(eventually(world, || receiver.has_publisher() && sender.listeners() == 1));
    sender.send(&Message::Sample(Sample { layout: LAYOUT + 1, ..Sample::new(1) })).unwrap();
    sender.send(&sample(1)).unwrap();
    let mut refused = String::new();
    assert!(eventually(world, || receiver.receive().inspect_err(|e| refused = e.to_string()).is_err()));
    assert_names(&refused, &["/arm/measured_js", "layout 2"]);
    assert_eq!(sequences(world, &mut receiver, 1), [1]);
}

/// However late the receiver looks.
fn tells_when_each_message_came(world: &dyn World, _: &dyn World) {
    let (mut a, mut b) = (world.join("a"), world.join("b"));
    let mut receiver = b.subscriber(&samples(), 16, false).unwrap();
    let mut sender = a.publisher(&samples(), 1).unwrap();
    assert!(eventually(world, || receiver.has_publisher() && sender.listeners() == 1));
    let mut send = |sequence: u64| {
        let before = now_ns();
        sender.send(&sample(sequence)).unwrap();
        let after = now_ns();
        std::thread::sleep(Duration::from_millis(5));
        (before, after)
    };
    let sent: Vec<(i64, i64)> = (0..5).map(&mut send).collect();
    settle(world);
    let mut last = i64::MIN;
    for (before, after) in sent {
        assert!(next(world, &mut *receiver).is_some());
        let (arrived, latest) = (receiver.arrived_ns(), if world.arrives_at_once() { after } else { now_ns() });
        // The middleware's wall-clock time is true to the microsecond.
        assert!((before - 1_000..=latest).contains(&arrived), "sent from {before} to {after}, came at {arrived}");
        assert!(arrived >= last);
        last = arrived;
    }
}

fn two_listeners_get_everything(world: &dyn World, _: &dyn World) {
    let (mut a, mut b, mut c) = (world.join("a"), world.join("b"), world.join("c"));
    let (mut first, mut second) = (b.subscriber(&samples(), 64, true).unwrap(), c.subscriber(&samples(), 64, true).unwrap());
    let mut sender = a.publisher(&samples(), 2).unwrap();
    assert!(eventually(world, || first.has_publisher() && second.has_publisher() && sender.listeners() == 2));
    (0..64).for_each(|i| sender.send(&sample(i)).unwrap());
    assert_eq!(sequences(world, &mut first, 64), (0..64).collect::<Vec<_>>());
    // One that is not awaited is kept nevertheless.
    second.set_awaited(false);
    assert_eq!(sequences(world, &mut second, 64), (0..64).collect::<Vec<_>>());
}

mod killed {
    //! Only processes can be killed.

    use super::*;
    use std::io::{BufRead, BufReader};
    use std::process::{Child, Command, Stdio};

    /// Not a test of its own: the process that is killed.
    #[test]
    fn child() {
        let Ok(role) = std::env::var("BACKDRIVE_TEST_ROLE") else { return };
        let location: Location = serde_json::from_str(&std::env::var("BACKDRIVE_TEST_LOCATION").unwrap()).unwrap();
        let mut transport = Iceoryx2::open(&location, "victim").unwrap();
        let (mut receiver, mut sender);
        if role == "subscriber" {
            receiver = transport.subscriber(&samples(), 16, true).unwrap();
            while receiver.receive().unwrap().is_none() {
                transport.wait(Duration::from_millis(100)).unwrap();
            }
        } else {
            sender = transport.publisher(&samples(), 1).unwrap();
            while sender.listeners() == 0 {}
            (0..100).for_each(|i| sender.send(&sample(i)).unwrap());
        }
        println!("ready");
        std::thread::sleep(Duration::from_secs(60));
    }

    fn start(role: &str, location: &Location) -> Child {
        Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "killed::child", "--nocapture", "--test-threads=1"])
            .env("BACKDRIVE_TEST_ROLE", role)
            .env("BACKDRIVE_TEST_LOCATION", serde_json::to_string(location).unwrap())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap()
    }

    fn until_ready(child: &mut Child, mut meanwhile: impl FnMut()) {
        let (tell, ready) = std::sync::mpsc::channel();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        std::thread::spawn(move || {
            let _ = lines.map_while(Result::ok).find(|l| l.contains("ready"));
            let _ = tell.send(());
        });
        while ready.try_recv().is_err() {
            meanwhile();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_killed_subscriber_does_not_hold_its_publisher_up() {
        let world = SharedMemory::new();
        let mut transport = world.join("publisher");
        let mut sender = transport.publisher(&samples(), 1).unwrap();
        for round in 0..3 {
            let mut child = start("subscriber", &world.0);
            until_ready(&mut child, || sender.send(&sample(0)).unwrap());
            child.kill().unwrap();
            child.wait().unwrap();
            let begun = Instant::now();
            (0..20_000).for_each(|i| sender.send(&sample(i)).unwrap());
            assert!(begun.elapsed() < Duration::from_secs(5), "round {round}: {:?}", begun.elapsed());
        }
        transport.sweep();
        assert_eq!(sender.listeners(), 0);
    }

    #[test]
    fn what_a_killed_publisher_sent_is_received_and_its_successor_is_heard() {
        let world = SharedMemory::new();
        let mut transport = world.join("subscriber");
        let mut receiver = transport.subscriber(&samples(), 4096, true).unwrap();
        for _ in 0..6 {
            let mut child = start("publisher", &world.0);
            let mut heard = Vec::new();
            until_ready(&mut child, || heard.extend(sequences(&world, &mut receiver, 0)));
            // Nothing is guaranteed for a publisher that no receiver has met alive.
            assert!(receiver.has_publisher(), "the publisher has died of itself");
            child.kill().unwrap();
            child.wait().unwrap();
            heard.extend(sequences(&world, &mut receiver, 0));
            assert_eq!(heard, (0..100).collect::<Vec<_>>());
        }
        transport.sweep();
        assert!(!receiver.has_publisher());
    }
}

/// Who is not of the run, in its domain.
mod strangers {
    use super::*;

    /// The report of a subscriber of the run on messages that `transport` sends on its topic of forces, none of which it takes.
    fn said_of(domain: &Domain, mut transport: Ros2) -> (String, bool) {
        let mut run = domain.join("run");
        let mut receiver = run.subscriber(&samples(), 64, true).unwrap();
        let mut genuine = domain.join("genuine");
        let mut sender = genuine.publisher(&samples(), 1).unwrap();
        let mut stranger = transport.publisher(&samples(), 1).unwrap();
        assert!(eventually(domain, || receiver.has_publisher() && sender.listeners() == 1 && stranger.listeners() == 1));
        // The stranger speaks first, and then in between.
        for sequence in 100..110 {
            stranger.send(&sample(sequence)).unwrap();
        }
        let (mut taken, mut said) = (Vec::new(), None);
        let mut sent = 0;
        eventually(domain, || {
            if sent < 10 {
                sender.send(&sample(sent)).unwrap();
                stranger.send(&sample(1000 + sent)).unwrap();
                sent += 1;
            }
            match receiver.receive() {
                Ok(Some(message)) => taken.push(message.sequence()),
                Ok(None) => {}
                Err(TransportError::Stranger { topic, who, refused, moves }) => {
                    assert!(refused > 0 && topic == samples().name);
                    said.get_or_insert((who, moves));
                }
                Err(e) => panic!("{e}"),
            }
            taken.len() == 10 && said.is_some() && receiver.refused() == 20
        });
        assert_eq!((taken, receiver.refused()), ((0..10).collect::<Vec<_>>(), 20));
        said.unwrap()
    }

    fn open(domain: &Domain) -> Ros2 {
        Ros2::open(&domain.0, "stranger", Delivery::Reliable).unwrap()
    }

    #[test]
    fn nothing_is_taken_of_who_has_no_tag_another_run_or_another_key() {
        let domain = Domain::new();
        let (who, moves) = said_of(&domain, open(&domain));
        assert!(who.starts_with("a program outside the run sends on this topic (GID ") && moves, "{who}");
        let (who, _) = said_of(&domain, open(&domain).with_identity(identity("b2")));
        assert_eq!(who, "run b2 sends on this topic too");
        let (who, _) = said_of(&domain, open(&domain).with_identity(identity("a1")));
        assert!(who.starts_with("a stranger forges tags"), "{who}");
    }

    #[test]
    fn a_tool_of_no_run_hears_a_run() {
        let domain = Domain::new();
        let (mut tool, mut run) = (open(&domain), domain.join("run"));
        let mut receiver = tool.subscriber(&samples(), 64, true).unwrap();
        let mut sender = run.publisher(&samples(), 1).unwrap();
        assert!(eventually(&domain, || receiver.has_publisher() && sender.listeners() == 1));
        for sequence in 0..10 {
            sender.send(&sample(sequence)).unwrap();
        }
        assert_eq!(sequences(&domain, &mut receiver, 10), (0..10).collect::<Vec<_>>());
    }
}
