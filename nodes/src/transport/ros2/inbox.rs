//! What has arrived for a subscriber, taken over from the middleware before anybody asks.

use super::identity::{Identity, Why};
use super::order::{Admission, First, Proven};
use super::participant::Reader;
use super::raw::{Checked, Reads};
use super::refusals::Refusals;
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

/// The same for topics that publish now and then.
const TELLER_SILENCE: Duration = Duration::from_secs(2);

/// How long a second publisher of a topic is listened for before the start: one that runs sends in this time, and one that was killed does not.
const SECOND: Duration = Duration::from_millis(300);

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

/// Whose messages are taken.
pub(super) enum Taken {
    /// Those of a run.
    Run(Identity, Proven<GUID>),
    /// Anybody's.
    Anybody(First<GUID>),
}

impl Taken {
    pub fn new(identity: Option<&Identity>, topic: &Topic) -> Taken {
        let is_sample = topic.kind == Kind::Sample;
        let silence = if is_sample { SPEAKER_SILENCE } else { TELLER_SILENCE };
        identity.map_or_else(|| Taken::Anybody(First::new(silence, !is_sample)), |i| Taken::Run(i.clone(), Proven::default()))
    }

    /// Whether who is unknown may be a host of the run that has just begun.
    fn is_of_several(&self) -> bool {
        matches!(self, Taken::Run(identity, _) if identity.is_of_several())
    }
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
    /// Since when it has more than one publisher.
    pub(super) crowded: Option<Instant>,
    pub(super) from: Taken,
    /// With when each was taken in: CLOCK_MONOTONIC, ns.
    pub(super) queue: VecDeque<(Result<Message, TransportError>, i64)>,
    /// The latest of these times, ns.
    pub(super) newest_ns: i64,
    pub(super) late: u64,
    pub(super) refusals: Refusals,
}

/// The inboxes of a node.
pub(super) type Inboxes = Mutex<Vec<Weak<Mutex<Inbox>>>>;

/// How often arrived messages are taken over without a request: unread messages are lost when their reliable writer ends.
const TAKE_OVER_EVERY: Duration = Duration::from_millis(2);

/// Nothing stays in the middleware for this long; a larger age means that the wall clock was set, ns.
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

/// When the middleware took something in, in CLOCK_MONOTONIC, ns. Its time is from the wall clock, which may have been set since: then now is the
/// best that is known.
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
            let identity = match &self.from {
                Taken::Run(identity, _) => Some(identity),
                Taken::Anybody(_) => None,
            };
            let entry = match self.reader.try_take_one_with(Reads { topic: &self.topic, identity }) {
                Ok(None) => return,
                Ok(Some(change)) => {
                    // The middleware hands over in order what has overtaken each other on the way, and its times are read by two
                    // clocks: nothing counts as there before what is used before it.
                    arrived_ns = taken_in_ns(change.receive_instant).max(self.newest_ns);
                    let guid = change.writer_guid();
                    let Some(message) = self.admitted(guid, change.into_value()) else { continue };
                    check_layout(&self.topic.name, &message).map(|()| message)
                }
                // No node of a run sends what cannot be read.
                Err(ReadError::Deserialization { .. }) if identity.is_some() => {
                    self.refusals.add(None, Why::Unreadable, false);
                    continue;
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

    /// The message, if it is of the topic's publisher and later than what was heard.
    fn admitted(&mut self, guid: GUID, checked: Checked) -> Option<Message> {
        let (admission, message) = match (checked, &mut self.from) {
            (Checked::Ours(message, run, life), Taken::Run(_, proven)) => {
                (proven.admit(guid, run, life, message.sequence()), Some(message))
            }
            (Checked::Anybodys(message), Taken::Anybody(first)) => (first.admit(guid, message.sequence()), Some(message)),
            (Checked::Refused(why), _) => (Admission::Refused(why), None),
            // What is read without a judgement is nothing for a run, and there is no judgement without one.
            (Checked::Ours(..) | Checked::Anybodys(_), _) => (Admission::Refused(Why::Untagged), None),
        };
        match admission {
            Admission::Next => message,
            Admission::Late => {
                self.late += 1;
                None
            }
            Admission::Refused(why) => {
                self.refusals.add(Some(guid), why, self.from.is_of_several());
                None
            }
        }
    }

    /// Once a second, that somebody else speaks on the topic too.
    pub(super) fn complaint(&mut self) -> Option<TransportError> {
        self.refusals.complaint(&self.topic)
    }

    /// Before the start: who else speaks on the topic. Of a run on several hosts who is unknown may still be found.
    pub(super) fn stranger(&mut self) -> Option<TransportError> {
        self.drain();
        let complaint = self.refusals.complaint(&self.topic);
        if complaint.is_none() {
            self.refusals.forgive();
        }
        complaint
    }

    /// Whether the topic has its publisher, and another one, if there is, has not been heard for long enough.
    pub(super) fn is_met(&mut self) -> bool {
        self.hear_statuses();
        self.crowded = if self.matched > 1 { self.crowded.or_else(|| Some(Instant::now())) } else { None };
        let settled = matches!(self.from, Taken::Anybody(_)) || self.crowded.is_none_or(|since| since.elapsed() >= SECOND);
        self.matched > 0 && settled
    }

    /// Learns who is connected.
    pub(super) fn hear_statuses(&mut self) {
        while let Some(status) = self.reader.try_recv_status() {
            if let DataReaderStatus::SubscriptionMatched { current, writer, .. } = status {
                self.matched = current.count().max(0) as usize;
                if let (true, Taken::Anybody(first)) = (current.count_change() < 0, &mut self.from) {
                    first.gone(writer);
                }
            }
        }
    }
}
