//! One bag from those that several hosts recorded of the same run.
//!
//! Every host records every topic, so most messages are in both bags. One copy is kept, the one that was recorded first by a common clock, which is
//! that of the host that sent it. What only one of them heard is kept too, so that the merged bag is as complete as all of them together. Log times
//! are in the first bag's clock: the clock records of the bags (events of kind [`CLOCK_OFFSET`]) are applied at the time nearest to each message.

use crate::account::{Account, Fault};
use crate::claim::not_itself;
use crate::clock_offset::{CLOCK_OFFSET, ClockOffset};
use crate::header::Clock;
use crate::{BagError, BagHeader, Completeness, Reader, Recorder, RecorderOptions, WhenFull};
use backdrive_msgs::Message;
use serde::Serialize;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// What was merged.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MergeReport {
    /// Messages in the merged bag.
    pub messages: u64,
    /// Messages that both bags hold.
    pub in_both: u64,
    /// Messages that only the first holds, and only the second.
    pub in_one: (u64, u64),
    /// By how much the second bag's clock is ahead of the first's, s: least and most over the run; none where nothing was measured.
    pub offset_s: Option<(f64, f64)>,
    /// How wrong that may be, s, where it is worst.
    pub uncertainty_s: f64,
    /// Messages that both bags hold, and not alike: the first bag's is in the merged one.
    pub differ: u64,
    /// Where the bags, or the merged one, contradict themselves, or cannot show that they are whole: a sentence each.
    pub faults: Vec<String>,
    /// The verdict in the merged bag.
    pub completeness: Completeness,
}

/// A message, by what is the same of it in every bag: topic, source, sequence, stamp.
type Key = (usize, u32, u64, i64);

/// Merges two bags of a run into a new one, in memory.
///
/// `offset_s` is by how much the second bag's clock is ahead, in place of what the bags say.
///
/// # Errors
/// A bag cannot be read or is none of a run, or they are of different graphs. In real time neither has records of the clocks and `offset_s` is not
/// given. `to` exists or cannot be written.
pub fn merge(first: &Path, second: &Path, to: &Path, offset_s: Option<f64>, overwrite: bool) -> Result<MergeReport, BagError> {
    not_itself(first, to)?;
    not_itself(second, to)?;
    let (a, b) = (Reader::open(first)?, Reader::open(second)?);
    let (head, other) = (header(&a, first)?, header(&b, second)?);
    let wrong =
        |path: &Path, key: &'static str, what: String| BagError::Metadata { path: path.to_owned(), record: crate::header::RUN, key, what };
    let accounts = [Account::of(&a)?, Account::of(&b)?];
    // A rate that the messages contradict does not identify the run.
    let rates = [(head, &accounts[0]), (other, &accounts[1])].map(|(head, account)| match (account.rate_is_denied, account.rate_hz) {
        (true, Some(found)) => found,
        _ => head.rate_hz,
    });
    let same_rate = rates[0].to_bits() == rates[1].to_bits() || accounts.iter().any(|account| account.rate_is_denied);
    if !same_rate || head.clock != other.clock || head.title != other.title {
        let what = format!("is not that of {}: {:?} at {} Hz", first.display(), head.title, rates[0]);
        return Err(wrong(second, "title", what));
    }
    let mut merged = head.clone();
    merged.rate_hz = rates[0];
    merged.topics.extend(other.topics.iter().filter(|info| head.topic(&info.topic.name).is_none()).cloned());
    if merged.host != other.host {
        merged.host = format!("{} and {}", head.host, other.host);
    }
    let clocks = match (offset_s, head.clock) {
        (Some(offset_s), _) => vec![(0, (offset_s * 1e9).round() as i64, 0)],
        (None, Clock::Realtime) => clocks(&a, &b)?,
        (None, _) => vec![(0, 0, 0)],
    };
    if clocks.is_empty() {
        let what = "the bags do not state the clock offsets; give the second's lead over the first with --offset".to_string();
        return Err(wrong(second, "clock", what));
    }

    let mut held: HashMap<Key, (i64, Message, bool)> = HashMap::new();
    let mut report = MergeReport { uncertainty_s: clocks.iter().map(|c| c.2).max().unwrap_or(0) as f64 * 1e-9, ..MergeReport::default() };
    if head.clock == Clock::Realtime {
        let leads = || clocks.iter().map(|c| c.1 as f64 * 1e-9);
        report.offset_s = Some((leads().fold(f64::INFINITY, f64::min), leads().fold(f64::NEG_INFINITY, f64::max)));
    }
    for (reader, is_second) in [(&a, false), (&b, true)] {
        for entry in reader.messages()? {
            let entry = entry?;
            let Some(topic) = merged.topic(&entry.topic.name) else { continue };
            let Some(message) = entry.message(reader.path())? else { continue };
            let mut log_ns = entry.log_time_ns as i64;
            if is_second {
                log_ns -= lead(&clocks, log_ns);
            }
            match held.entry((topic, message.source(), message.sequence(), message.stamp_ns())) {
                Entry::Vacant(place) => {
                    place.insert((log_ns, message, false));
                    if is_second { report.in_one.1 += 1 } else { report.in_one.0 += 1 }
                }
                Entry::Occupied(mut place) => {
                    let (earliest, other, both) = place.get_mut();
                    report.differ += u64::from(!alike(other, &message));
                    *earliest = log_ns.min(*earliest);
                    if is_second && !std::mem::replace(both, true) {
                        report.in_both += 1;
                        report.in_one.0 -= 1;
                    }
                }
            }
        }
    }
    let mut all: Vec<(i64, usize, Message)> =
        held.into_iter().map(|((topic, ..), (log_ns, message, _))| (log_ns, topic, message)).collect();
    all.sort_by_key(|(log_ns, topic, message)| (*log_ns, message.step(), *topic, message.sequence()));
    let options = RecorderOptions { when_full: WhenFull::Wait, overwrite, whole: true, ..RecorderOptions::default() };
    let mut recorder = Recorder::create(to, &merged, &options)?;
    for (log_ns, topic, message) in all {
        recorder.push(topic, message, log_ns)?;
        report.messages += 1;
    }
    // What the hosts' recorders know to have been sent is due in the merged bag too.
    for record in [&a, &b].into_iter().filter_map(|reader| reader.completeness()) {
        for told in &record.topics {
            if let Some(topic) = merged.topic(&told.topic) {
                recorder.expect(topic, told.written.saturating_sub(told.repeated).saturating_add(told.lost));
            }
        }
    }
    for fault in accounts.iter().flat_map(|account| &account.faults) {
        if let Fault::Lost { topic, of, .. } = fault
            && let Some(topic) = merged.topic(topic)
        {
            recorder.expect(topic, *of);
        }
    }
    if [&a, &b].iter().all(|reader| reader.completeness().is_none_or(|record| record.recovered)) {
        recorder.leave_end_open();
    }
    report.completeness = recorder.finish()?;
    let [one, two] = &accounts;
    for (path, account) in [(first, one), (second, two), (to, &Account::of(&Reader::open(to)?)?)] {
        // What one of them lost the other may hold; what is lost in both is in the verdict.
        let faults = account.faults.iter().filter(|fault| !matches!(fault, Fault::Lost { .. }));
        report.faults.extend(faults.map(|fault| format!("{}: {fault}", path.display())));
    }
    Ok(report)
}

/// Whether two copies of a message are the same.
fn alike(one: &Message, other: &Message) -> bool {
    match (one, other) {
        (Message::Sample(one), Message::Sample(other)) => one.same_bits(other),
        // Numbers that were not measured are NaN, which is not equal to itself.
        (one, other) => format!("{one:?}") == format!("{other:?}"),
    }
}

fn header<'a>(reader: &'a Reader, path: &Path) -> Result<&'a BagHeader, BagError> {
    reader.header().ok_or_else(|| BagError::Metadata {
        path: path.to_owned(),
        record: crate::header::RUN,
        key: "topics",
        what: "is not there, so the bag is none of a run".to_string(),
    })
}

/// (log time in the second's clock, its lead over the first's, uncertainty), ns, in order of time.
fn clocks(a: &Reader, b: &Reader) -> Result<Vec<(i64, i64, i64)>, BagError> {
    let name = |reader: &Reader| reader.header().map(|h| h.host.clone()).unwrap_or_default();
    let (first, second) = (name(a), name(b));
    // What the second measured stands in its bag with its own clock; the first's serves where there is none of that.
    for (reader, is_second) in [(b, true), (a, false)] {
        let mut found = Vec::new();
        for entry in reader.messages()? {
            let entry = entry?;
            let Some(Message::Event(event)) = entry.message(reader.path())? else { continue };
            if event.kind.as_str() != CLOCK_OFFSET {
                continue;
            }
            let Some(ClockOffset { of, against, offset_ns, uncertainty_ns, .. }) = ClockOffset::parse(event.text.as_str()) else {
                continue;
            };
            let log_ns = entry.log_time_ns as i64;
            match (is_second, of == first && against == second, of == second && against == first) {
                (true, true, _) => found.push((log_ns, -offset_ns, uncertainty_ns)),
                (false, _, true) => found.push((log_ns + offset_ns, offset_ns, uncertainty_ns)),
                _ => {}
            }
        }
        if !found.is_empty() {
            found.sort_unstable();
            return Ok(found);
        }
    }
    Ok(Vec::new())
}

/// The lead that was measured nearest to this time.
fn lead(clocks: &[(i64, i64, i64)], log_ns: i64) -> i64 {
    let after = clocks.partition_point(|(at, ..)| *at < log_ns);
    let near = |i: usize| clocks.get(i).map(|(at, lead, _)| ((at - log_ns).abs(), *lead));
    let before = after.checked_sub(1).and_then(near);
    [before, near(after)].into_iter().flatten().min().map_or(0, |(_, lead)| lead)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_measurement_counts() {
        let clocks = [(100, 5, 1), (200, 7, 1), (300, -9, 1)];
        assert_eq!([0, 149, 151, 260, 999].map(|at| lead(&clocks, at)), [5, 5, 7, -9, -9]);
    }
}
