//! The content of a bag, counted message by message, and compared with the bag's own records. The messages win: a record that they deny is reported.
//!
//! Every verb that reads a bag asks here whether it is whole, so that all of them give the same answer.

use crate::completeness::{TopicCompleteness, Tracker};
use crate::header::Clock;
use crate::reader::{Entry, Reader};
use crate::{BagError, BagHeader};
use backdrive_msgs::Message;
use backdrive_msgs::topic::Kind;
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::Table;
use serde::Serialize;
use std::collections::VecDeque;

/// Something that forbids calling a bag whole.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "fault", rename_all = "snake_case")]
pub enum Fault {
    /// Messages of a topic are missing.
    Lost {
        /// The topic.
        topic: String,
        /// How many are missing.
        messages: u64,
        /// How many there should be.
        of: u64,
    },
    /// It ends before its graph does, and its recorder left no record of the cause.
    Short {
        /// Steps in it.
        steps: u64,
        /// Steps of its graph.
        of: u64,
    },
    /// Nothing in it shows how much is missing at its end.
    EndUnknown,
    /// Its writer did not close it.
    NotClosed,
    /// Bytes of it are wrong.
    Damaged {
        /// Where and how.
        what: String,
    },
    /// Its own records contradict its messages, or each other.
    Contradiction {
        /// What.
        what: String,
    },
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Fault::Lost { topic, messages, of } => write!(f, "{topic}: {messages} of {of} messages are missing"),
            Fault::Short { steps, of } => write!(f, "it ends after {steps} of the {of} steps of its graph: {} are missing", of - steps),
            Fault::EndUnknown => {
                write!(f, "what is missing at its end is not known: its recorder wrote no summary, and its graph has no duration")
            }
            Fault::NotClosed => write!(f, "its writer did not close it: what is missing at its end is not known"),
            Fault::Damaged { what } => write!(f, "damaged: {what}"),
            Fault::Contradiction { what } => write!(f, "it contradicts itself: {what}"),
        }
    }
}

/// What a bag holds, by its messages.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Account {
    /// Each of [`Reader::topics`], by its messages; `lost` counts what the recorder's record and the sequence numbers show to be missing. `None` for topics
    /// of other people's types.
    pub topics: Vec<Option<TopicCompleteness>>,
    /// First and last log time of each topic, ns.
    pub spans: Vec<Option<(u64, u64)>>,
    /// Messages of each topic.
    pub counts: Vec<u64>,
    /// Rate at which the samples' steps follow each other by their stamps, 1/s.
    pub rate_hz: Option<f64>,
    /// Highest step of a sample.
    pub last_step: Option<u64>,
    /// Steps up to the last of which no sample is there.
    pub empty_steps: u64,
    /// What forbids calling it whole; empty where nothing does.
    pub faults: Vec<Fault>,
    /// Errors in its own records that have no consequences.
    pub notes: Vec<String>,
    /// Whether the rate in its metadata is none, or not that of its messages.
    pub rate_is_denied: bool,
}

impl Account {
    /// Reads every message of a bag. Damage is a fault, and what stands behind it is not counted.
    ///
    /// # Errors
    /// The bag cannot be read at all.
    pub fn of(reader: &Reader) -> Result<Account, BagError> {
        let mut hearing = Hearing::of(reader);
        for entry in reader.messages()? {
            match entry {
                Ok(entry) => hearing.take(reader, &entry),
                Err(error) => {
                    hearing.damage.push(error.to_string());
                    break;
                }
            }
        }
        Ok(hearing.account(reader))
    }

    /// Whether nothing is missing, damaged or contradictory.
    pub fn is_whole(&self) -> bool {
        self.faults.is_empty()
    }

    /// Messages known to be missing, over all topics.
    pub fn lost(&self) -> u64 {
        let lost = |fault: &Fault| if let Fault::Lost { messages, .. } = fault { *messages } else { 0 };
        self.faults.iter().map(lost).sum()
    }

    /// What contradicts itself, a sentence each.
    pub fn contradictions(&self) -> impl Iterator<Item = &str> {
        self.faults.iter().filter_map(|fault| if let Fault::Contradiction { what } = fault { Some(what.as_str()) } else { None })
    }
}

/// The run as a graph plans it.
#[derive(Default)]
struct Plan {
    rate_hz: Option<f64>,
    steps: Option<u64>,
}

impl Plan {
    fn of(header: &BagHeader) -> Plan {
        let Ok(mut top) = Table::parse(header.graph_toml.as_str(), "the graph") else { return Plan::default() };
        let rate_hz = top.number("rate_hz", Range::Positive).ok().flatten();
        let duration_s = top.number("duration_s", Range::Positive).ok().flatten();
        Plan { rate_hz, steps: rate_hz.zip(duration_s).map(|(rate, s)| (s * rate).round().max(1.0) as u64) }
    }
}

/// A share by which the rate of a real-time run may be off, whose steps come late where the machine is busy.
const RATE_OF_REALTIME: f64 = 0.2;
/// The same in lockstep.
const RATE_OF_LOCKSTEP: f64 = 1e-3;
/// Steps beyond this are not marked one by one.
const MOST_MARKED: u64 = 1 << 27;
/// Number of a topic's last messages that are remembered, to distinguish a repetition from another message of the same number.
const REMEMBERED: usize = 64;

/// What is known of a topic while its messages go by.
struct TopicHeard {
    tracker: Tracker,
    ours: bool,
    unreadable: u64,
    /// First and last sample: step, stamp.
    first: Option<(u64, i64)>,
    last: Option<(u64, i64)>,
    /// Samples whose stamp is, and is not, that of their step; step of the first that is not.
    stamped: [u64; 2],
    stamped_wrong: u64,
    logged_apart: u64,
    /// Source, number and checksum of the last messages.
    recent: VecDeque<(u32, u64, u32)>,
    twice_but_different: Option<u64>,
    /// A number of axes that is not that of the header.
    axes: Option<usize>,
}

struct Hearing {
    plan: Plan,
    lockstep: bool,
    topics: Vec<TopicHeard>,
    spans: Vec<Option<(u64, u64)>>,
    counts: Vec<u64>,
    damage: Vec<String>,
    marked: Vec<u64>,
    last_step: Option<u64>,
}

impl Hearing {
    fn of(reader: &Reader) -> Hearing {
        let topics = reader.topics().iter().map(|topic| TopicHeard {
            tracker: Tracker::new(&topic.name),
            ours: false,
            unreadable: 0,
            first: None,
            last: None,
            stamped: [0, 0],
            stamped_wrong: 0,
            logged_apart: 0,
            recent: VecDeque::new(),
            twice_but_different: None,
            axes: None,
        });
        Hearing {
            plan: reader.header().map(Plan::of).unwrap_or_default(),
            lockstep: reader.header().is_some_and(|header| header.clock == Clock::Lockstep),
            topics: topics.collect(),
            spans: vec![None; reader.topics().len()],
            counts: vec![0; reader.topics().len()],
            damage: reader.damage().to_vec(),
            marked: Vec::new(),
            last_step: None,
        }
    }

    fn take(&mut self, reader: &Reader, entry: &Entry) {
        let (index, time) = (entry.topic.index, entry.log_time_ns);
        let (Some(heard), Some(span), Some(count)) = (self.topics.get_mut(index), self.spans.get_mut(index), self.counts.get_mut(index))
        else {
            return;
        };
        *count += 1;
        *span = Some(span.map_or((time, time), |(first, last)| (first.min(time), last.max(time))));
        let message = match entry.message(reader.path()) {
            Ok(Some(message)) => message,
            Ok(None) => {
                heard.unreadable += 1;
                return;
            }
            Err(error) => {
                heard.unreadable += 1;
                if self.damage.is_empty() {
                    self.damage.push(error.to_string());
                }
                return;
            }
        };
        heard.ours = true;
        let (source, sequence) = (message.source(), message.sequence());
        let sum = crc32fast::hash(&entry.payload);
        if heard.recent.iter().any(|(from, other, was)| (*from, *other) == (source, sequence) && *was != sum)
            && heard.tracker.found.restarts == 0
        {
            heard.twice_but_different.get_or_insert(message.step());
        }
        heard.recent.push_back((source, sequence, sum));
        if heard.recent.len() > REMEMBERED {
            heard.recent.pop_front();
        }
        heard.tracker.see(&message);
        let Message::Sample(sample) = message else { return };
        let here = (sample.step, sample.stamp_ns);
        heard.first.get_or_insert(here);
        if heard.last.is_none_or(|last| last.0 < here.0) {
            heard.last = Some(here);
        }
        if !entry.topic.axes.is_empty() && entry.topic.axes.len() != sample.len() {
            heard.axes.get_or_insert(sample.len());
        }
        if let (true, Some(rate)) = (self.lockstep, self.plan.rate_hz) {
            let due = (sample.step as f64 * 1e9 / rate).round();
            let fits = (sample.stamp_ns as f64 - due).abs() <= 1.0;
            heard.stamped[usize::from(!fits)] += 1;
            if !fits && heard.stamped[1] == 1 {
                heard.stamped_wrong = sample.step;
            }
            heard.logged_apart += u64::from(entry.log_time_ns as i64 != sample.stamp_ns);
        }
        self.last_step = self.last_step.max(Some(sample.step));
        if sample.step < MOST_MARKED {
            let (word, bit) = ((sample.step / 64) as usize, sample.step % 64);
            if self.marked.len() <= word {
                self.marked.resize(word + 1, 0);
            }
            self.marked[word] |= 1 << bit;
        }
    }

    /// The rate of the samples' steps by their stamps: the middle one of all topics.
    fn rate_hz(&self) -> Option<f64> {
        let rates = self.topics.iter().filter_map(|heard| {
            let ((from, start), (to, end)) = heard.first.zip(heard.last)?;
            let time_s = end.checked_sub(start)? as f64 * 1e-9;
            (to > from && time_s > 0.0).then(|| (to - from) as f64 / time_s)
        });
        let mut rates: Vec<f64> = rates.collect();
        rates.sort_by(f64::total_cmp);
        let middle = rates.get(rates.len() / 2).copied()?;
        // Stamps are whole nanoseconds: further digits are their rounding.
        format!("{middle:.9e}").parse().ok()
    }

    fn account(self, reader: &Reader) -> Account {
        let (mut faults, mut notes) = (Vec::new(), Vec::new());
        let (rate_hz, mut rate_is_denied) = (self.rate_hz(), false);
        if !reader.ended_cleanly() {
            faults.push(Fault::NotClosed);
        }
        faults.extend(self.damage.iter().map(|what| Fault::Damaged { what: what.clone() }));
        let mut contradiction = |what: String| faults.push(Fault::Contradiction { what });
        reader.contradictions().iter().for_each(|what| contradiction(what.clone()));
        if let Some(header) = reader.header().filter(|header| header.clock != Clock::Imported) {
            let tolerance = if self.lockstep { RATE_OF_LOCKSTEP } else { RATE_OF_REALTIME };
            let apart = |rate: f64| rate_hz.is_some_and(|found| rate.is_nan() || (found / rate - 1.0).abs() > tolerance);
            let found = rate_hz.map_or("nothing".to_owned(), |hz| format!("{hz:.6} Hz"));
            if let Some(rate) = self.plan.rate_hz.filter(|rate| apart(*rate)) {
                contradiction(format!("its graph runs at {rate} Hz, and the steps of its messages follow each other at {found}"));
            }
            rate_is_denied = !(header.rate_hz.is_finite() && header.rate_hz > 0.0) || apart(header.rate_hz);
            if rate_is_denied {
                notes.push(format!("its metadata give the rate as {} Hz; by its messages it is {found}, which counts", header.rate_hz));
            }
        }
        for (topic, heard) in reader.topics().iter().zip(&self.topics) {
            let name = &topic.name;
            if let Some(step) = heard.twice_but_different {
                contradiction(format!("{name} contains two different messages with one sequence number, at step {step}"));
            }
            if let Some(axes) = heard.axes {
                contradiction(format!("{name} has {} axes by its header, and messages with {axes}", topic.axes.len()));
            }
            let rate_fits = self.plan.rate_hz.zip(rate_hz).is_some_and(|(plan, found)| (found / plan - 1.0).abs() <= RATE_OF_LOCKSTEP);
            match heard.stamped {
                [0, wrong] if wrong > 0 && rate_fits => {
                    notes.push(format!("{name}: no stamp is that of its step, so the steps count"));
                }
                [_, wrong] if wrong > 0 && rate_fits => {
                    let step = heard.stamped_wrong;
                    contradiction(format!("{name}: {wrong} messages have another time than their step, the first at step {step}"));
                }
                _ => {}
            }
            if heard.logged_apart > 0 && heard.stamped[1] == 0 {
                notes.push(format!(
                    "{name}: {} messages were logged at another time than they were sent; that of sending counts",
                    heard.logged_apart
                ));
            }
            if heard.tracker.found.repeated > 0 && heard.twice_but_different.is_none() {
                notes.push(format!("{name}: {} messages are there twice, alike", heard.tracker.found.repeated));
            }
            if heard.tracker.found.backward > 0 && self.lockstep {
                notes.push(format!("{name}: {} messages are not in order", heard.tracker.found.backward));
            }
        }
        self.ends(reader, &mut faults, &mut notes);
        let missing = self.missing(reader);
        let topics = self.topics.iter().zip(reader.topics()).map(|(heard, topic)| {
            heard.ours.then(|| {
                let lost = missing.iter().find(|(name, ..)| *name == topic.name).map_or(0, |(_, lost, _)| *lost);
                TopicCompleteness { lost, ..heard.tracker.found.clone() }
            })
        });
        let topics = topics.collect();
        faults.extend(missing.into_iter().map(|(topic, messages, of)| Fault::Lost { topic, messages, of }));
        let steps = self.last_step.map_or(0, |last| last.min(MOST_MARKED - 1) + 1);
        let there: u64 = self.marked.iter().map(|word| u64::from(word.count_ones())).sum();
        Account {
            topics,
            spans: self.spans,
            counts: self.counts,
            rate_hz,
            last_step: self.last_step,
            empty_steps: steps.saturating_sub(there),
            faults,
            notes,
            rate_is_denied,
        }
    }

    /// Whether its end is there.
    fn ends(&self, reader: &Reader, faults: &mut Vec<Fault>, notes: &mut Vec<String>) {
        let Some(header) = reader.header().filter(|header| header.clock != Clock::Imported && !header.graph_toml.is_empty()) else {
            return;
        };
        let steps = self.last_step.map_or(0, |last| last + 1);
        let record = reader.completeness();
        match self.plan.steps {
            Some(of) if of > steps && record.is_none_or(|record| record.recovered) => faults.push(Fault::Short { steps, of }),
            // In real time the last node may be some steps further when the run ends.
            Some(of) if steps > of + of / 20 + 10 => {
                notes.push(format!("its graph has {of} steps, and the bag contains {steps}; these are used"));
            }
            None if record.is_none_or(|record| record.recovered) && reader.ended_cleanly() => faults.push(Fault::EndUnknown),
            _ => {}
        }
        if record.is_none() && reader.ended_cleanly() {
            let by = if header.topics.is_empty() { "" } else { ", so its messages were counted by their numbers and steps" };
            notes.push(format!("the record of its recorder is not there: another program wrote it again{by}"));
        }
    }

    /// Per topic how many messages are missing, and of how many: by their numbers, by the recorder's record, and where there is none by the other topics.
    fn missing(&self, reader: &Reader) -> Vec<(String, u64, u64)> {
        let by_name = |name: &str| reader.topics().iter().position(|topic| topic.name == name).and_then(|index| self.topics.get(index));
        let mut missing: Vec<(String, u64, u64)> = Vec::new();
        let mut miss = |topic: &str, there: u64, lost: u64| {
            if lost > 0 && !missing.iter().any(|(name, ..)| name == topic) {
                missing.push((topic.to_owned(), lost, there + lost));
            }
        };
        let kept = |heard: &TopicHeard| heard.tracker.found.written.saturating_sub(heard.tracker.found.repeated);
        match (reader.completeness(), reader.header()) {
            (Some(record), _) => {
                for told in &record.topics {
                    let (there, by_number) = by_name(&told.topic).map_or((0, 0), |heard| (kept(heard), heard.tracker.found.lost));
                    let due = (told.written.saturating_sub(told.repeated)).saturating_add(told.lost);
                    miss(&told.topic, there, by_number.max(due.saturating_sub(there)));
                }
            }
            (None, Some(header)) if header.clock != Clock::Imported => {
                let last = self.last_step.unwrap_or(0);
                for info in header.topics.iter().filter(|info| info.topic.kind == Kind::Sample) {
                    let heard = by_name(&info.topic.name);
                    let (there, by_number) = heard.map_or((0, 0), |heard| (kept(heard), heard.tracker.found.lost));
                    let ends = heard.and_then(|heard| heard.last).map_or(0, |(step, _)| step + 1);
                    // In real time the nodes do not end with the same step.
                    let behind = (last + 1).saturating_sub(ends);
                    let slack = if self.lockstep { 0 } else { 10 + last / 200 };
                    miss(&info.topic.name, there, by_number + if behind > slack && last > 0 { behind } else { 0 });
                }
            }
            _ => {}
        }
        // Topics of which no record speaks.
        for heard in self.topics.iter().filter(|heard| heard.ours) {
            miss(&heard.tracker.found.topic, kept(heard), heard.tracker.found.lost);
        }
        for (topic, heard) in reader.topics().iter().zip(&self.topics) {
            let is_ours = reader.header().is_some_and(|header| header.topic(&topic.name).is_some());
            if is_ours && heard.unreadable > 0 {
                miss(&topic.name, kept(heard), heard.unreadable);
            }
        }
        missing
    }
}
