//! What has arrived for a subscriber, taken over from the middleware before anybody asks.

use super::participant::Reader;
use super::raw::Reads;
use crate::clock::now_ns;
use crate::transport::bell::Bell;
use crate::transport::{TransportError, check_layout};
use backdrive_msgs::Message;
use backdrive_msgs::topic::{Kind, Topic};
use rustdds::StatusEvented;
use rustdds::dds::ReadError;
use rustdds::{DataReaderStatus, GUID, Timestamp};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Wake, Waker};
use std::time::{Duration, Instant};

/// A topic's speaker that is silent for this long gives way to another.
const SPEAKER_SILENCE: Duration = Duration::from_millis(100);

/// The same for what is told now and then.
const TELLER_SILENCE: Duration = Duration::from_secs(2);

/// How often a second speaker is complained about.
const COMPLAIN_EVERY: Duration = Duration::from_secs(1);

/// Rings the node's bell when the middleware has something.
struct Ring(Arc<Bell>);

impl Wake for Ring {
    fn wake(self: Arc<Self>) {
        self.0.ring(0);
    }
}

/// A waker that rings a bell.
pub(super) fn ringing(bell: &Arc<Bell>) -> Waker {
    Waker::from(Arc::new(Ring(Arc::clone(bell))))
}

/// Who speaks on the topic, and how far it has come.
#[derive(Clone, Copy)]
pub(super) struct Speaker {
    guid: GUID,
    sequence: u64,
    heard: Instant,
}

/// What has arrived on a topic, and from whom.
pub(super) struct Inbox {
    pub(super) topic: Topic,
    pub(super) depth: usize,
    pub(super) awaited: bool,
    pub(super) waker: Waker,
    pub(super) reader: Reader,
    pub(super) life: u32,
    pub(super) matched: usize,
    pub(super) speaker: Option<Speaker>,
    /// With when each was taken in: CLOCK_MONOTONIC, ns.
    pub(super) queue: VecDeque<(Result<Message, TransportError>, i64)>,
    /// The latest of these times, ns.
    pub(super) newest_ns: i64,
    pub(super) late: u64,
    pub(super) strangers: u64,
    pub(super) complained: Option<Instant>,
}

/// The inboxes of a node.
pub(super) type Inboxes = Mutex<Vec<Weak<Mutex<Inbox>>>>;

/// How often what has arrived is taken over where nobody asks: what is unread when its reliable writer ends is gone with it.
const TAKE_OVER_EVERY: Duration = Duration::from_millis(2);

/// Nothing lies in the middleware for so long; an age beyond it says that the wall clock was set, ns.
const LONGEST_AGE_NS: i64 = 10_000_000_000;

pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes over what has arrived for a node's subscribers, in a thread of its own, for as long as the node is there.
pub(super) fn take_over(inboxes: &Arc<Inboxes>) -> std::io::Result<()> {
    let inboxes = Arc::downgrade(inboxes);
    let work = move || {
        while let Some(all) = inboxes.upgrade() {
            let now: Vec<_> = locked(&all).iter().filter_map(Weak::upgrade).collect();
            drop(all);
            for inbox in now {
                let mut inbox = locked(&inbox);
                let before = inbox.queue.len();
                inbox.drain();
                if inbox.awaited && inbox.queue.len() > before {
                    inbox.waker.wake_by_ref();
                }
            }
            std::thread::sleep(TAKE_OVER_EVERY);
        }
    };
    std::thread::Builder::new().name("ros2-take-over".to_string()).spawn(work).map(drop)
}

/// Takes over what has arrived for all of them.
pub(super) fn drain(inboxes: &Inboxes) {
    let now: Vec<_> = locked(inboxes).iter().filter_map(Weak::upgrade).collect();
    now.iter().for_each(|inbox| locked(inbox).drain());
}

/// When the middleware took something in, in CLOCK_MONOTONIC, ns. It says so by the wall clock, which may have been set since: then now is
/// the best that is known.
fn taken_in_ns(at: Timestamp) -> i64 {
    let age_ns = Timestamp::now().duration_since(at).to_nanoseconds();
    now_ns() - if (0..LONGEST_AGE_NS).contains(&age_ns) { age_ns } else { 0 }
}

impl Inbox {
    /// Takes over what has arrived, and asks to be woken for what comes next.
    pub(super) fn drain(&mut self) {
        if self.awaited {
            // Before the look: what arrives after it rings.
            self.reader.set_waker(Some(self.waker.clone()));
        }
        loop {
            let mut arrived_ns = now_ns();
            let entry = match self.reader.try_take_one_with(Reads(self.topic.kind)) {
                Ok(None) => return,
                Ok(Some(change)) => {
                    // The middleware hands over in order what has overtaken each other on the way, and its times are read by two
                    // clocks: nothing counts as there before what is used before it.
                    arrived_ns = taken_in_ns(change.receive_instant).max(self.newest_ns);
                    let guid = change.writer_guid();
                    let message = change.into_value();
                    if !self.admits(guid, &message) {
                        continue;
                    }
                    check_layout(&self.topic.name, &message).map(|()| message)
                }
                Err(ReadError::Deserialization { reason }) => Err(self.broken(reason)),
                Err(e) => Err(self.broken(e.to_string())),
            };
            self.newest_ns = self.newest_ns.max(arrived_ns);
            if self.queue.len() == self.depth {
                self.queue.pop_front();
            }
            self.queue.push_back((entry, arrived_ns));
        }
    }

    fn broken(&self, reason: String) -> TransportError {
        TransportError::Broken { topic: self.topic.name.clone(), reason }
    }

    /// Whether this message is the topic's next: from its speaker, and later than what was heard.
    fn admits(&mut self, guid: GUID, message: &Message) -> bool {
        let silence = if self.topic.kind == Kind::Sample { SPEAKER_SILENCE } else { TELLER_SILENCE };
        let (heard, sequence) = (Instant::now(), message.sequence());
        let admitted = match self.speaker {
            None => true,
            Some(s) if s.guid == guid => {
                self.late += u64::from(sequence <= s.sequence);
                sequence > s.sequence
            }
            Some(s) => {
                // What is told now and then goes on where a publisher was made anew; of samples two may count alike.
                let continues = self.topic.kind != Kind::Sample && sequence == s.sequence + 1;
                let admitted = continues || s.heard.elapsed() >= silence;
                self.strangers += u64::from(!admitted);
                admitted
            }
        };
        if admitted {
            self.speaker = Some(Speaker { guid, sequence, heard });
        }
        admitted
    }

    /// Once a second, that somebody else speaks on the topic too.
    pub(super) fn complaint(&mut self) -> Option<TransportError> {
        if self.strangers == 0 || self.complained.is_some_and(|at| at.elapsed() < COMPLAIN_EVERY) {
            return None;
        }
        self.complained = Some(Instant::now());
        let ignored = std::mem::take(&mut self.strangers);
        Some(self.broken(format!("another publisher speaks here too; {ignored} of its messages were ignored")))
    }

    /// Learns who is connected.
    pub(super) fn hear_statuses(&mut self) {
        while let Some(status) = self.reader.try_recv_status() {
            if let DataReaderStatus::SubscriptionMatched { current, writer, .. } = status {
                self.matched = current.count().max(0) as usize;
                if current.count_change() < 0 && self.speaker.is_some_and(|s| s.guid == writer) {
                    self.speaker = None;
                }
            }
        }
    }
}
