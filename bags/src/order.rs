//! Puts messages that arrive in any order into the order (step, topic, sequence), so that a lockstep bag is the
//! same however the machine ran.
//!
//! A step is complete when every sample topic has delivered it. Sparse topics (events, gains, status) cannot be waited for. But a node sends its
//! sparse messages of step k before its sample of step k + 1. At the second checkpoint after the samples of step k + 1 are here, they have therefore
//! arrived too. Nothing waits without bound: when a topic falls silent for [`STALL`], or [`MOST_HELD`] messages wait, the held messages are released
//! in order and the silent topic is no longer waited for.

use backdrive_msgs::Message;
use std::collections::BTreeMap;
use std::time::Duration;

/// How long the slowest topic may stand still while messages wait for it.
pub(crate) const STALL: Duration = Duration::from_secs(1);

/// Most messages that wait; about 24 MB.
pub(crate) const MOST_HELD: usize = 65_536;

/// A message on its way to the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrived {
    pub(crate) topic: usize,
    pub(crate) receive_ns: i64,
    pub(crate) message: Message,
}

/// Step, topic, sequence, and the order of arrival so that a repeated message has a place of its own.
type Key = (u64, usize, u64, u64);

/// Messages in the order in which they go to the file.
pub(crate) type Ordered = BTreeMap<Key, Arrived>;

/// See the module.
#[derive(Debug)]
pub(crate) struct Order {
    topics: Vec<Progress>,
    held: Ordered,
    arrivals: u64,
    /// Every step below it has been released.
    floor: u64,
    /// What was complete at the last checkpoint.
    ready: u64,
    /// The last watermark, and when it moved.
    moved: (u64, Duration),
    /// Messages that came when their step had been released.
    pub(crate) late: u64,
}

#[derive(Debug, Clone, Copy)]
struct Progress {
    dense: bool,
    /// One more than the newest step that it delivered.
    upto: u64,
    /// It fell silent, and is not waited for.
    silent: bool,
}

impl Order {
    /// For topics that deliver every step (`true`) or now and then (`false`).
    pub(crate) fn new(dense: impl IntoIterator<Item = bool>) -> Order {
        let topics = dense.into_iter().map(|dense| Progress { dense, upto: 0, silent: false }).collect();
        Order { topics, held: Ordered::new(), arrivals: 0, floor: 0, ready: 0, moved: (0, Duration::ZERO), late: 0 }
    }

    /// Takes a message; gives it back when it is too late for its place and has to be written as it comes.
    pub(crate) fn push(&mut self, arrived: Arrived) -> Option<Arrived> {
        let (step, topic) = (arrived.message.step(), arrived.topic);
        if let Some(progress) = self.topics.get_mut(topic) {
            progress.upto = progress.upto.max(step.saturating_add(1));
            progress.silent &= step < self.floor;
        }
        if step < self.floor {
            self.late += 1;
            return Some(arrived);
        }
        self.held.insert((step, topic, arrived.message.sequence(), self.arrivals), arrived);
        self.arrivals += 1;
        None
    }

    /// Every step below it has come from every sample topic.
    fn watermark(&self) -> u64 {
        let dense = self.topics.iter().filter(|topic| topic.dense && !topic.silent).map(|topic| topic.upto).min();
        dense.unwrap_or_else(|| self.topics.iter().map(|topic| topic.upto).max().unwrap_or(0))
    }

    /// Marks that every topic has been asked for its messages since the last checkpoint, and takes what may go to the file.
    ///
    /// `now` is any steadily growing time.
    pub(crate) fn checkpoint(&mut self, now: Duration) -> Ordered {
        let watermark = self.watermark();
        if watermark != self.moved.0 || self.held.is_empty() {
            self.moved = (watermark, now);
        }
        // The samples of step `upto - 1` are here: what was sent in the steps before it arrives before the next checkpoint.
        let mut upto = std::mem::replace(&mut self.ready, watermark.saturating_sub(1));
        if now.saturating_sub(self.moved.1) >= STALL || self.held.len() > MOST_HELD {
            let newest = self.topics.iter().filter(|topic| topic.dense).map(|topic| topic.upto).max();
            upto = upto.max(newest.unwrap_or(watermark));
            for topic in self.topics.iter_mut().filter(|topic| topic.dense) {
                topic.silent = topic.upto < upto;
            }
            if self.held.len() > MOST_HELD {
                // Even messages of steps to come must not grow without bound.
                upto = upto.max(self.held.keys().nth(self.held.len() / 2).map_or(0, |key| key.0));
            }
        }
        self.floor = self.floor.max(upto);
        let rest = self.held.split_off(&(self.floor, 0, 0, 0));
        std::mem::replace(&mut self.held, rest)
    }

    /// Messages that wait.
    pub(crate) fn held(&self) -> usize {
        self.held.len()
    }

    /// Everything that is still held, in order.
    pub(crate) fn finish(&mut self) -> Ordered {
        std::mem::take(&mut self.held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_msgs::text::Text;
    use backdrive_msgs::{Event, LAYOUT, NOT_MEASURED, Sample};

    fn sample(topic: usize, step: u64) -> Arrived {
        Arrived { topic, receive_ns: 0, message: Message::Sample(Sample { step, sequence: step, ..Sample::new(1) }) }
    }

    fn event(topic: usize, step: u64, sequence: u64) -> Arrived {
        let (kind, text) = (Text::new("k"), Text::new(""));
        let (layout, source, stamp_ns, severity, reserved, value) = (LAYOUT, 0, 0, 0, 0, NOT_MEASURED);
        Arrived {
            topic,
            receive_ns: 0,
            message: Message::Event(Event { layout, source, step, sequence, stamp_ns, severity, reserved, value, kind, text }),
        }
    }

    fn places(ordered: Ordered) -> Vec<(u64, usize)> {
        ordered.into_keys().map(|(step, topic, ..)| (step, topic)).collect()
    }

    #[test]
    fn a_step_goes_when_every_sample_topic_has_gone_past_it_and_stragglers_had_their_chance() {
        let mut order = Order::new([true, false, true]);
        for step in 0..4 {
            assert!(order.push(sample(2, step)).is_none());
        }
        assert!(order.checkpoint(Duration::ZERO).is_empty(), "topic 0 has delivered nothing");
        for step in 0..3 {
            assert!(order.push(sample(0, step)).is_none());
        }
        assert!(order.checkpoint(Duration::ZERO).is_empty());
        assert!(order.push(event(1, 1, 0)).is_none(), "an event of step 1 may come until the next checkpoint");
        assert_eq!(places(order.checkpoint(Duration::ZERO)), [(0, 0), (0, 2), (1, 0), (1, 1), (1, 2)]);
        assert_eq!(places(order.finish()), [(2, 0), (2, 2), (3, 2)]);
        assert_eq!(order.late, 0);
    }

    #[test]
    fn a_silent_topic_is_not_waited_for_and_may_come_back() {
        let mut order = Order::new([true, true]);
        let second = Duration::from_secs(1);
        order.push(sample(0, 0));
        order.push(sample(1, 0));
        order.checkpoint(Duration::ZERO);
        for step in 1..10 {
            order.push(sample(0, step));
        }
        assert_eq!(places(order.checkpoint(second / 2)), []);
        assert_eq!(places(order.checkpoint(second * 2)).len(), 11, "everything that is held goes");
        for step in 10..20 {
            order.push(sample(0, step));
        }
        order.checkpoint(second * 2);
        assert_eq!(places(order.checkpoint(second * 2)).len(), 9, "only the speaking topic counts");
        assert!(order.push(sample(1, 5)).is_some(), "its step is gone: it is written as it comes");
        assert_eq!(order.late, 1);
        assert!(order.push(sample(1, 30)).is_none());
        assert_eq!(order.watermark(), 20, "it is waited for again");
    }

    #[test]
    fn it_is_bounded() {
        let mut order = Order::new([true, true, false]);
        let (mut out, mut most) = (0, 0);
        for step in 0..3 * MOST_HELD as u64 {
            order.push(sample(0, step));
            order.push(event(2, u64::MAX - step, step)); // steps that never come
            if step % 100 == 0 {
                out += order.checkpoint(Duration::ZERO).len();
            }
            most = most.max(order.held.len());
        }
        assert!(most <= MOST_HELD + 200, "{most}");
        out += order.finish().len() + order.late as usize;
        assert_eq!(out, 6 * MOST_HELD, "and nothing is dropped");
    }
}
