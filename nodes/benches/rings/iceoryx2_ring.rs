//! A ring of processes over iceoryx2 as one finds it: per hop a publisher, a subscriber and an event, and a listener that blocks.
//!
//! A member copies what it has received into memory that it has borrowed for what it sends: a node writes its own message.

use super::Result;
use super::children::Process;
use super::stopwatch::{Figures, Stopwatch, warm_up};
use backdrive_nodes::transport::Location;
use iceoryx2::port::{listener::Listener, notifier::Notifier, publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use std::process::{ExitCode, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// The first argument of a member's process.
pub const MEMBER: &str = "iceoryx2";

fn join(location: &Location) -> Result<Node<ipc::Service>> {
    set_log_level(LogLevel::Error);
    let mut config = Config::default();
    config.global.prefix = FileName::new(location.prefix.as_bytes())?;
    config.global.set_root_path(&Path::new(location.root.as_os_str().as_encoded_bytes())?);
    config.global.creation_timeout = Duration::from_secs(5);
    Ok(NodeBuilder::new().signal_handling_mode(SignalHandlingMode::Disabled).config(&config).create()?)
}

/// The way out of the member with this number.
struct Hop {
    data: publish_subscribe::PortFactory<ipc::Service, [u8], ()>,
    event: event::PortFactory<ipc::Service>,
}

impl Hop {
    fn open(node: &Node<ipc::Service>, from: usize) -> Result<Hop> {
        let name = ServiceName::new(&format!("hop{from}"))?;
        let data = node.service_builder(&name).publish_subscribe::<[u8]>().open_or_create()?;
        Ok(Hop { data, event: node.service_builder(&name).event().open_or_create()? })
    }
}

/// A member's ports.
struct Member {
    listener: Listener<ipc::Service>,
    subscriber: Subscriber<ipc::Service, [u8], ()>,
    publisher: Publisher<ipc::Service, [u8], ()>,
    notifier: Notifier<ipc::Service>,
}

impl Member {
    fn send(&self, bytes: &[u8]) -> Result<()> {
        self.publisher.loan_slice_uninit(bytes.len())?.write_from_slice(bytes).send()?;
        self.notifier.notify()?;
        Ok(())
    }
}

/// The member at `index` of `members`, as a process of its own. It prints `ready`; the first one then waits for a line, sends a message round `loops`
/// times and prints its figures. All end with their standard input.
pub fn member(index: usize, members: usize, size: usize, location: &Location, loops: u64) -> Result<ExitCode> {
    let node = join(location)?;
    let from = (index + members - 1) % members;
    let (input, output) = (Hop::open(&node, from)?, Hop::open(&node, index)?);
    let member = Member {
        listener: input.event.listener_builder().create()?,
        subscriber: input.data.subscriber_builder().create()?,
        publisher: output.data.publisher_builder().initial_max_slice_len(size).create()?,
        notifier: output.event.notifier_builder().create()?,
    };
    let ended = Arc::new(AtomicBool::new(false));
    let go = listen(from, location.clone(), Arc::clone(&ended));
    let connected = || {
        let (from, to) = (input.data.dynamic_config(), output.data.dynamic_config());
        let woken = output.event.dynamic_config().number_of_listeners() > 0;
        from.number_of_publishers() > 0 && to.number_of_subscribers() > 0 && woken
    };
    while !connected() && !ended.load(Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(1));
    }
    println!("ready");
    if index == 0 && go.recv().is_ok() {
        let mut bytes = vec![0; size];
        let mut watch = Stopwatch::new(loops);
        watch.look();
        for _ in 0..warm_up(loops) + loops {
            member.send(&bytes)?;
            while !ended.load(Ordering::SeqCst) {
                member.listener.blocking_wait(|_| {})?;
                if let Some(message) = member.subscriber.receive()? {
                    bytes.copy_from_slice(message.payload());
                    break;
                }
            }
            watch.look();
        }
        println!("{}", serde_json::to_string(&watch.figures())?);
    }
    while !ended.load(Ordering::SeqCst) {
        member.listener.blocking_wait(|_| {})?;
        while let Some(message) = member.subscriber.receive()? {
            member.send(message.payload())?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Hands on that a line has come on standard input. At its end the listener at the hop `from` is woken, so that the member ends and
/// takes its shared memory with it.
fn listen(from: usize, location: Location, ended: Arc<AtomicBool>) -> Receiver<()> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for _ in std::io::stdin().lines().map_while(std::result::Result::ok) {
            let _ = sender.send(());
        }
        ended.store(true, Ordering::SeqCst);
        drop(sender);
        let woken = (|| -> Result<()> {
            let node = join(&location)?;
            let notifier = Hop::open(&node, from)?.event.notifier_builder().create()?;
            notifier.notify()?;
            Ok(())
        })();
        if let Err(error) = woken {
            eprintln!("a member of the ring cannot be woken: {error}");
            std::process::exit(1);
        }
    });
    receiver
}

/// The processes of a ring, and where they meet, which is removed after their end.
struct Ring {
    processes: Vec<Process>,
    location: Location,
    /// Holds the location's files.
    _root: tempfile::TempDir,
}

impl Drop for Ring {
    fn drop(&mut self) {
        self.processes.clear();
        if let Err(error) = self.location.remove() {
            eprintln!("{error}");
        }
    }
}

/// A ring of `members` processes, each of which is this program with the arguments of [`member`].
pub fn ring(members: usize, size: usize, loops: u64) -> Result<Figures> {
    let root = tempfile::tempdir()?;
    let location = Location { prefix: format!("iox{}_", std::process::id()), root: root.path().join("run") };
    let place = serde_json::to_string(&location)?;
    let mut ring = Ring { processes: Vec::new(), location, _root: root };
    let (count, size, loops) = (members.to_string(), size.to_string(), loops.to_string());
    for index in 0..members {
        ring.processes.push(Process::start(&[MEMBER, &index.to_string(), &count, &size, &place, &loops], Stdio::piped())?);
    }
    for process in &mut ring.processes {
        if process.line()? != "ready" {
            return Err("a member of the iceoryx2 ring ended before it was ready".into());
        }
    }
    let first = ring.processes.first_mut().ok_or("a ring without members")?;
    first.say("go")?;
    let figures = serde_json::from_str(&first.line()?)?;
    ring.processes.iter_mut().try_for_each(Process::end)?;
    Ok(figures)
}
