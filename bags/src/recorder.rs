//! Records while a graph runs: a bounded queue, and a thread that writes.

use crate::claim::claim;
use crate::completeness::{Completeness, Tracker};
use crate::header::BagHeader;
use crate::order::{Arrived, MOST_HELD, Order, Ordered};
use crate::whole::Whole;
use crate::writer::{BagWriter, Store, WriteError};
use crate::{BagError, TopicInfo};
use backdrive_msgs::Message;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Without explicit checkpoints, how often the order is settled.
const SETTLE: Duration = Duration::from_millis(50);

/// How long the thread sleeps when the queue is empty. Sleeping instead of waiting keeps `push` free of system calls.
const NAP: Duration = Duration::from_millis(1);

/// What happens to a message that the queue has no room for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WhenFull {
    /// It is lost, and counted: the caller never waits. For a realtime run.
    #[default]
    Refuse,
    /// The caller waits: the disk slows the run down, and nothing is lost. For a lockstep run.
    Wait,
}

/// How to record.
#[derive(Debug, Clone)]
pub struct RecorderOptions {
    /// Messages that the queue holds (about 260 bytes each); 32 768, which is 0.5 s at 60 000 messages per second.
    pub queue: usize,
    /// What happens when it is full.
    pub when_full: WhenFull,
    /// At least this often everything is handed to the operating system, so that a killed recorder loses no more; 0.08 s.
    pub flush: Duration,
    /// Size at which a chunk is closed, bytes before compression; 1 MiB.
    pub chunk_bytes: u64,
    /// Write in the order (step, topic, sequence) whatever the order of arrival. For a lockstep run.
    pub ordered: bool,
    /// Replace a bag that exists; otherwise it is an error. One that is being written is never replaced.
    pub overwrite: bool,
    /// The bag has its name once it is whole, and otherwise not at all: for what is made of something that is still there. A run records
    /// under the bag's own name, so that what it has recorded survives it.
    pub whole: bool,
}

impl Default for RecorderOptions {
    fn default() -> RecorderOptions {
        let (queue, flush, chunk_bytes) = (32_768, Duration::from_millis(80), 1 << 20);
        RecorderOptions { queue, when_full: WhenFull::Refuse, flush, chunk_bytes, ordered: false, overwrite: false, whole: false }
    }
}

impl RecorderOptions {
    /// For a lockstep run: ordered, and nothing lost because the disk is slow.
    pub fn lockstep() -> RecorderOptions {
        RecorderOptions { ordered: true, when_full: WhenFull::Wait, ..RecorderOptions::default() }
    }
}

/// How a recording is doing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// Messages written so far.
    pub written: u64,
    /// Size of the file so far, bytes.
    pub bytes: u64,
    /// Messages known to be lost so far.
    pub lost: u64,
    /// Why writing stopped, if it did.
    pub error: Option<String>,
}

/// Writes a bag on a thread of its own.
///
/// Dropping it finishes the bag too, but then losses are not reported; one that is to be whole is removed.
pub struct Recorder {
    name: String,
    queue: Option<SyncSender<Item>>,
    thread: Option<JoinHandle<Option<Completeness>>>,
    trackers: Vec<Tracker>,
    /// Messages per topic that the queue or a dead writer refused.
    refused: Vec<u64>,
    /// Messages per topic that are known to have been sent.
    due: Vec<u64>,
    /// Whether it is unknown what is missing behind the last message.
    open_end: bool,
    when_full: WhenFull,
    /// Where the file is put once it is whole.
    whole: Option<Whole>,
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    written: AtomicU64,
    bytes: Arc<AtomicU64>,
    error: OnceLock<String>,
}

#[allow(clippy::large_enum_variant)] // nearly all are the large one
enum Item {
    Message(Arrived),
    Checkpoint,
    /// The front's counts; the thread adds its own.
    Finish(Completeness),
}

impl Recorder {
    /// Starts a bag at `path`. When it returns, header, graph and files are on their way to the disk.
    ///
    /// The file is locked until the bag is finished. Errors: it exists and may not be overwritten, is being written by
    /// somebody else, or cannot be written.
    pub fn create(path: &Path, header: &BagHeader, options: &RecorderOptions) -> Result<Recorder, BagError> {
        let whole = options.whole.then(|| Whole::begin(path, options.overwrite)).transpose()?;
        let file = whole.as_ref().map_or_else(|| claim(path, options.overwrite), Whole::file)?;
        let mut recorder = Recorder::to_store(Box::new(file), path.display().to_string(), header, options)?;
        recorder.whole = whole;
        Ok(recorder)
    }

    /// Writes to something else than a file; `name` stands in error messages.
    pub fn with_sink<W: std::io::Write + std::io::Seek + Send + 'static>(
        sink: W,
        name: &str,
        header: &BagHeader,
        options: &RecorderOptions,
    ) -> Result<Recorder, BagError> {
        Recorder::to_store(Box::new(sink), name.to_owned(), header, options)
    }

    fn to_store(store: Box<dyn Store>, name: String, header: &BagHeader, options: &RecorderOptions) -> Result<Recorder, BagError> {
        let shared = Arc::new(Shared::default());
        let failed = |error: WriteError| BagError::Write { name: name.clone(), what: error.to_string() };
        let writer = BagWriter::new(store, header, options.chunk_bytes, shared.bytes.clone()).map_err(failed)?;
        let (sender, receiver) = sync_channel(options.queue.max(1));
        let order = options.ordered.then(|| Order::new(header.topics.iter().map(TopicInfo::is_dense)));
        let scribe = Scribe { writer, order, flush: options.flush, shared: shared.clone(), started: Instant::now() };
        let spawned = std::thread::Builder::new().name("bag writer".to_owned()).spawn(move || scribe.run(&receiver));
        let thread = spawned.map_err(|error| BagError::Write { name: name.clone(), what: error.to_string() })?;
        Ok(Recorder {
            name,
            queue: Some(sender),
            thread: Some(thread),
            trackers: header.topics.iter().map(|info| Tracker::new(&info.topic.name)).collect(),
            refused: vec![0; header.topics.len()],
            due: vec![0; header.topics.len()],
            open_end: false,
            when_full: options.when_full,
            whole: None,
            shared,
        })
    }

    /// Takes a message of the header's topic number `topic`; `receive_ns` is its time of arrival, ns since the Unix epoch.
    ///
    /// A message that the queue has no room for is counted as lost, and that is no error (see [`WhenFull`]).
    /// Errors: writing has stopped (the message is counted as lost), or there is no such topic.
    pub fn push(&mut self, topic: usize, message: Message, receive_ns: i64) -> Result<(), BagError> {
        let count = self.trackers.len();
        let (Some(tracker), Some(refused)) = (self.trackers.get_mut(topic), self.refused.get_mut(topic)) else {
            return Err(BagError::NoSuchIndex { index: topic, count });
        };
        tracker.see(&message);
        let item = Item::Message(Arrived { topic, receive_ns, message });
        let Some(queue) = &self.queue else { return Ok(()) };
        let sent = match self.when_full {
            WhenFull::Refuse => queue.try_send(item),
            WhenFull::Wait => queue.send(item).map_err(|unsent| TrySendError::Disconnected(unsent.0)),
        };
        match sent {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                *refused += 1;
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => {
                *refused += 1;
                Err(self.stopped())
            }
        }
    }

    /// Marks that every topic has been asked for its messages since the last checkpoint. An ordered bag is then exactly in order; without checkpoints
    /// the order is settled every 50 ms, which a machine that stalls for longer may defeat for events, gains and status.
    pub fn checkpoint(&mut self) {
        if let Some(queue) = &self.queue {
            // A full queue means that the thread is behind; the next checkpoint has the same effect.
            let _ = queue.try_send(Item::Checkpoint);
        }
    }

    /// Sets that at least this number of messages of a topic were sent, from another source: those that do not come are counted as lost.
    pub(crate) fn expect(&mut self, topic: usize, messages: u64) {
        if let Some(due) = self.due.get_mut(topic) {
            *due = messages.max(*due);
        }
    }

    /// Marks that it is unknown what is missing behind the last message, as for a bag that was recovered.
    pub(crate) fn leave_end_open(&mut self) {
        self.open_end = true;
    }

    /// How it is doing; cheap enough to ask at every pass.
    pub fn health(&self) -> Health {
        Health {
            written: self.shared.written.load(Ordering::Relaxed),
            bytes: self.shared.bytes.load(Ordering::Relaxed),
            lost: self.trackers.iter().map(|tracker| tracker.found.lost).sum::<u64>() + self.refused.iter().sum::<u64>(),
            error: self.shared.error.get().cloned(),
        }
    }

    /// Writes what is queued, the verdict and the summary.
    ///
    /// Errors: the bag could not be written to its end. It then holds what had been written before, or is not there if it was to be whole.
    /// [`Recorder::health`], asked before, has the counts.
    pub fn finish(mut self) -> Result<Completeness, BagError> {
        self.close()
    }

    fn close(&mut self) -> Result<Completeness, BagError> {
        let counted = self.trackers.iter().zip(&self.refused).zip(&self.due).map(|((tracker, refused), due)| {
            let mut found = tracker.found.clone();
            found.written = found.written.saturating_sub(*refused);
            found.lost = (found.lost + refused).max(due.saturating_sub(found.written));
            found
        });
        let completeness = Completeness { topics: counted.collect(), late: 0, recovered: self.open_end };
        if let Some(queue) = self.queue.take() {
            // Waits for room. A thread that has stopped gives the reason below.
            let _ = queue.send(Item::Finish(completeness));
        }
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Some(completeness))) => self.whole.take().map_or(Ok(()), Whole::commit).map(|()| completeness),
            _ => Err(self.stopped()),
        }
    }

    fn stopped(&self) -> BagError {
        let what = self.shared.error.get().map_or("the writer thread ended", String::as_str);
        BagError::Write { name: self.name.clone(), what: what.to_owned() }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.thread.is_some() {
            // Without a word about its end it is not whole.
            self.whole = None;
            let _ = self.close();
        }
    }
}

/// The writing side.
struct Scribe {
    writer: BagWriter,
    order: Option<Order>,
    flush: Duration,
    shared: Arc<Shared>,
    started: Instant,
}

impl Scribe {
    /// The verdict, or `None` after an error, which is then in `shared`.
    fn run(mut self, queue: &Receiver<Item>) -> Option<Completeness> {
        match self.record(queue) {
            Ok(completeness) => Some(completeness),
            Err(error) => {
                let _ = self.shared.error.set(error.to_string());
                // What is on the disk stays unchanged: closing the bag would write to a disk that has just refused.
                self.writer.abandon();
                None
            }
        }
    }

    fn record(&mut self, queue: &Receiver<Item>) -> Result<Completeness, WriteError> {
        let (mut flushed, mut settled) = (Instant::now(), Instant::now());
        let (mut unflushed, mut asked_for) = (false, false);
        loop {
            for _ in 0..1024 {
                match queue.try_recv() {
                    Ok(Item::Message(arrived)) => {
                        unflushed = true;
                        self.take(arrived)?;
                    }
                    Ok(Item::Checkpoint) => {
                        (asked_for, settled) = (true, Instant::now());
                        self.checkpoint()?;
                    }
                    Ok(Item::Finish(completeness)) => return self.finish(completeness),
                    Err(TryRecvError::Empty) => {
                        std::thread::sleep(NAP);
                        break;
                    }
                    // The recorder went away without a word: the bag is closed, its verdict is what is in it.
                    Err(TryRecvError::Disconnected) => return self.finish(Completeness::default()),
                }
            }
            // A recorder that checkpoints itself may be late with it, for its process may be held up: only silence of a second counts.
            let patience = if asked_for { Duration::from_secs(1) } else { SETTLE };
            if settled.elapsed() >= patience || self.order.as_ref().is_some_and(|order| order.held() > MOST_HELD) {
                settled = Instant::now();
                self.checkpoint()?;
            }
            if unflushed && flushed.elapsed() >= self.flush {
                (unflushed, flushed) = (self.order.as_ref().is_some_and(|order| order.held() > 0), Instant::now());
                self.writer.flush()?;
            }
        }
    }

    fn take(&mut self, arrived: Arrived) -> Result<(), WriteError> {
        let now = match &mut self.order {
            None => Some(arrived),
            Some(order) => order.push(arrived),
        };
        if let Some(arrived) = now {
            self.write(&arrived)?;
        }
        Ok(())
    }

    fn write(&mut self, arrived: &Arrived) -> Result<(), WriteError> {
        self.writer.write(arrived.topic, &arrived.message, arrived.receive_ns)?;
        self.shared.written.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn write_all(&mut self, ordered: &Ordered) -> Result<(), WriteError> {
        ordered.values().try_for_each(|arrived| self.write(arrived))
    }

    fn checkpoint(&mut self) -> Result<(), WriteError> {
        let now = self.started.elapsed();
        let Some(order) = &mut self.order else { return Ok(()) };
        let ordered = order.checkpoint(now);
        self.write_all(&ordered)
    }

    fn finish(&mut self, mut completeness: Completeness) -> Result<Completeness, WriteError> {
        if let Some(order) = &mut self.order {
            completeness.late = order.late;
            let rest = order.finish();
            self.write_all(&rest)?;
        }
        for (topic, written) in completeness.topics.iter_mut().zip(self.writer.written()) {
            topic.lost += topic.written.saturating_sub(written);
            topic.written = written;
        }
        self.writer.finish(&completeness)?;
        Ok(completeness)
    }
}
