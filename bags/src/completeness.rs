//! Whether everything that was sent is in the bag, per topic.

use backdrive_msgs::Message;
use serde::{Deserialize, Serialize};

/// Name of the metadata record that holds a [`Completeness`].
pub(crate) const COMPLETENESS: &str = "backdrive.completeness";

/// Whether everything that was sent is in the bag.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Completeness {
    /// In the order of the header's topics.
    pub topics: Vec<TopicCompleteness>,
    /// Messages that arrived too late to be put in order; they are in the bag, behind their place.
    #[serde(default)]
    pub late: u64,
    /// It was computed from a bag whose recorder did not finish: what was lost behind its end is not known.
    #[serde(default)]
    pub recovered: bool,
}

impl Completeness {
    /// Messages that are missing, over all topics.
    pub fn lost(&self) -> u64 {
        self.topics.iter().map(|topic| topic.lost).sum()
    }

    /// Messages in the bag, over all topics.
    pub fn written(&self) -> u64 {
        self.topics.iter().map(|topic| topic.written).sum()
    }

    /// Whether nothing is missing.
    pub fn is_complete(&self) -> bool {
        self.lost() == 0 && !self.recovered
    }
}

/// What is in the bag of one topic.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TopicCompleteness {
    /// Name of the topic.
    pub topic: String,
    /// Messages in the bag.
    pub written: u64,
    /// Messages known to be missing: holes in the sequence, and what the queue or the disk refused.
    pub lost: u64,
    /// Messages whose sequence number had been seen before.
    #[serde(default)]
    pub repeated: u64,
    /// Messages that came behind one with a higher sequence number.
    #[serde(default)]
    pub backward: u64,
    /// Number of times that the publisher restarted its count.
    #[serde(default)]
    pub restarts: u64,
    /// Step of the first message.
    pub first_step: Option<u64>,
    /// Highest step of any message.
    pub last_step: Option<u64>,
}

/// Follows the sequence numbers of one topic.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tracker {
    /// What was found so far; `written` counts what was seen.
    pub(crate) found: TopicCompleteness,
    /// Highest sequence number of this count.
    last: Option<u64>,
    /// Bit n: sequence number `last - n` was seen.
    seen: u64,
}

impl Tracker {
    pub(crate) fn new(topic: &str) -> Tracker {
        Tracker { found: TopicCompleteness { topic: topic.to_owned(), ..Default::default() }, ..Default::default() }
    }

    /// Takes notice of a message. Publishers count from 0, so what is missing before the first message is lost too.
    pub(crate) fn see(&mut self, message: &Message) {
        let (step, sequence) = (message.step(), message.sequence());
        let found = &mut self.found;
        found.written += 1;
        let last_step = found.last_step;
        found.first_step.get_or_insert(step);
        found.last_step = Some(last_step.map_or(step, |last| last.max(step)));
        let Some(last) = self.last else {
            found.lost += sequence;
            (self.last, self.seen) = (Some(sequence), 1);
            return;
        };
        if sequence > last {
            let ahead = sequence - last;
            found.lost += ahead - 1;
            self.seen = if ahead < 64 { self.seen << ahead | 1 } else { 1 };
            self.last = Some(sequence);
            return;
        }
        let behind = last - sequence;
        // A lower number with a later step is a publisher that was started again; with an earlier or the same step it is
        // a message that was overtaken or doubled on its way.
        if behind > 0 && last_step.is_some_and(|last| step > last) {
            found.restarts += 1;
            found.lost += sequence;
            (self.last, self.seen) = (Some(sequence), 1);
        } else if behind < 64 && self.seen >> behind & 1 == 0 {
            found.backward += 1;
            found.lost = found.lost.saturating_sub(1); // it had been counted as a hole
            self.seen |= 1 << behind;
        } else if behind < 64 {
            found.repeated += 1;
        } else {
            found.backward += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_msgs::Sample;

    fn follow(messages: &[(u64, u64)]) -> TopicCompleteness {
        let mut tracker = Tracker::new("/t");
        for (step, sequence) in messages {
            tracker.see(&Message::Sample(Sample { step: *step, sequence: *sequence, ..Sample::new(1) }));
        }
        tracker.found
    }

    #[test]
    fn holes_are_losses() {
        let found = follow(&[(0, 0), (1, 1), (5, 5), (6, 6)]);
        assert_eq!((found.written, found.lost, found.first_step, found.last_step), (4, 3, Some(0), Some(6)));
        assert_eq!(follow(&[(10, 10), (11, 11)]).lost, 10, "publishers count from 0");
        assert_eq!(follow(&[(0, 0), (500, 500)]).lost, 499);
        assert_eq!(follow(&[]).first_step, None);
    }

    #[test]
    fn a_late_message_fills_its_hole() {
        let found = follow(&[(0, 0), (2, 2), (3, 3), (1, 1), (4, 4)]);
        assert_eq!((found.written, found.lost, found.backward, found.repeated), (5, 0, 1, 0));
    }

    #[test]
    fn repeated_messages_are_counted_and_fill_no_hole() {
        let found = follow(&[(0, 0), (2, 2), (2, 2), (0, 0), (3, 3)]);
        assert_eq!((found.lost, found.repeated, found.backward, found.restarts), (1, 2, 0, 0));
    }

    #[test]
    fn a_restarted_publisher_counts_anew() {
        let found = follow(&[(0, 0), (1, 1), (100, 0), (101, 1), (103, 3)]);
        assert_eq!((found.lost, found.restarts, found.repeated), (1, 1, 0));
    }
}
