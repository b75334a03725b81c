//! Which step each sample of a bag is of: what a `JointState` has no field for, on a topic beside the others.
//!
//! Nearly always a topic's next sample is one step and one sequence number later than the one before it, from the same source and with the same
//! flags. So its facts are written once in every chunk for each topic that has messages in it, before its first sample there. They are written again
//! where a sample differs from counting on. A chunk can be read without those before it, and the messages cost about a hundredth of the bag, where
//! one beside each sample would double its index.

use crate::BagError;
use backdrive_msgs::Sample;
use backdrive_msgs::ros::{self, Facts};
use std::collections::{HashMap, VecDeque};
use std::path::Path;

/// The topic of these facts; its messages are [`ros::STEPS`].
pub(crate) const STEPS_TOPIC: &str = "/backdrive/steps";

/// While writing: what a reader expects of a topic's next sample.
#[derive(Debug, Default)]
pub(crate) struct Expected(Option<Facts>);

impl Expected {
    /// Takes a topic's next sample; returns whether its facts have to be written.
    pub(crate) fn must_say(&mut self, sample: &Sample) -> bool {
        let Sample { layout, source, step, sequence, flags, stamp_ns, .. } = *sample;
        let facts = Facts { layout, source, step, sequence, flags, stamp_ns: None };
        let is_expected = self.0 == Some(facts) && ros::header_holds(stamp_ns);
        self.0 = step.checked_add(1).zip(sequence.checked_add(1)).map(|(step, sequence)| Facts { step, sequence, ..facts });
        !is_expected
    }

    /// A chunk has ended, and the next is to be readable without it.
    pub(crate) fn forget(&mut self) {
        self.0 = None;
    }
}

/// As many of the last statements of a topic are remembered: another program may have written a sample behind the statement about the next one.
const REMEMBERED: usize = 8;

/// While reading: the last facts of each topic, the newest first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Said(HashMap<String, VecDeque<Facts>>);

impl Said {
    /// Takes in a message of [`STEPS_TOPIC`].
    ///
    /// Errors: it cannot be read.
    pub(crate) fn hear(&mut self, path: &Path, offset: u64, payload: &[u8]) -> Result<(), BagError> {
        let wrong = |source| BagError::Message { path: path.to_owned(), offset, topic: STEPS_TOPIC.to_owned(), source };
        let (topic, facts) = ros::decode_steps(payload).map_err(wrong)?;
        let said = self.0.entry(topic).or_default();
        said.truncate(REMEMBERED - 1);
        said.push_front(facts);
        Ok(())
    }

    /// The facts of the sample of `topic` whose sequence number ends in these 32 bits; `None` where there are none.
    pub(crate) fn of(&self, topic: &str, sequence: u32) -> Option<Facts> {
        // Some may be missing in between; none comes before the one with the facts.
        let ahead = |first: &Facts| sequence.wrapping_sub(first.sequence as u32);
        let first = self.0.get(topic)?.iter().find(|first| ahead(first) <= i32::MAX as u32)?;
        let ahead = ahead(first);
        let (step, sequence) = first.step.checked_add(ahead.into()).zip(first.sequence.checked_add(ahead.into()))?;
        Some(Facts { step, sequence, stamp_ns: first.stamp_ns.filter(|_| ahead == 0), ..*first })
    }

    /// Discards all facts: something may be missing.
    pub(crate) fn forget(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_msgs::{MAX_AXES, flag};

    /// The samples as read back from what is written of them, in order, and how often facts had to be written.
    fn there_and_back(samples: &[Sample]) -> (Vec<Sample>, usize) {
        let (mut expected, mut said, mut payload, mut count) = (Expected::default(), Said::default(), Vec::new(), 0);
        let read = samples.iter().map(|sample| {
            if expected.must_say(sample) {
                ros::encode_steps("/t", sample, &mut payload).unwrap();
                said.hear(Path::new("x.mcap"), 0, &payload).unwrap();
                count += 1;
            }
            ros::encode(&backdrive_msgs::Message::Sample(*sample), &[], &mut payload).unwrap();
            let facts = said.of("/t", sample.sequence as u32).unwrap();
            ros::decode_sample(&payload, &facts).unwrap()
        });
        (read.collect(), count)
    }

    #[test]
    fn every_sample_comes_back_and_little_is_said() {
        let at = |step: u64, sequence: u64, flags: u32| Sample { step, sequence, flags, stamp_ns: step as i64 * 1_000, ..Sample::new(2) };
        let mut samples: Vec<Sample> = (0..100).map(|k| at(k, k, 0)).collect();
        samples.extend((100..200).map(|k| at(k + 7, k, 0))); // seven steps were skipped
        samples.extend((205..300).map(|k| at(k + 7, k, 0))); // five samples were lost
        samples.extend((300..310).map(|k| at(k + 7, k, flag::LIMITED)));
        samples.push(at(310, 303, 0)); // one that was late
        samples.extend((0..50).map(|k| at(1000 + k, k, 0))); // started again
        let beyond = u64::from(u32::MAX) - 3;
        samples.extend((beyond..beyond + 8).map(|k| at(k, k, 0))); // 32 bits do not hold the number
        samples.extend([i64::MIN, i64::MAX, 0].map(|stamp_ns| Sample { stamp_ns, ..at(1, 1, 0) })); // the header does not hold the stamp
        samples.push(Sample { layout: u32::MAX, source: u32::MAX, ..at(u64::MAX, u64::MAX, u32::MAX) });
        samples.push(Sample::new(MAX_AXES));
        let (read, count) = there_and_back(&samples);
        for (sent, back) in samples.iter().zip(&read) {
            assert!(sent.same_bits(back), "sent {sent:?}\nback {back:?}");
        }
        assert_eq!(count, 12);
    }

    #[test]
    fn nothing_is_known_of_what_comes_before_it_was_said() {
        let (mut said, mut payload) = (Said::default(), Vec::new());
        assert_eq!(said.of("/t", 5), None);
        ros::encode_steps("/t", &Sample { step: 9, sequence: 5, ..Sample::new(1) }, &mut payload).unwrap();
        said.hear(Path::new("x.mcap"), 0, &payload).unwrap();
        assert_eq!(said.of("/t", 8).map(|facts| (facts.step, facts.sequence)), Some((12, 8)));
        assert_eq!((said.of("/t", 4), said.of("/u", 5)), (None, None));
        // A sample that another program wrote behind the statement about the next one.
        ros::encode_steps("/t", &Sample { step: 20, sequence: 9, ..Sample::new(1) }, &mut payload).unwrap();
        said.hear(Path::new("x.mcap"), 0, &payload).unwrap();
        assert_eq!([9, 8].map(|sequence| said.of("/t", sequence).map(|facts| facts.step)), [Some(20), Some(12)]);
        said.forget();
        assert_eq!(said.of("/t", 5), None);
    }
}
