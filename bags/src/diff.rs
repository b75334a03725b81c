//! Compares two bags by what their messages say.

use crate::{BagError, Clock, Entry, Messages, Reader};
use backdrive_msgs::{Message, Sample};
use serde::Serialize;
use std::collections::{HashMap, VecDeque};
use std::fmt;

/// How to compare.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DiffOptions {
    /// Largest difference of a number that still counts as equal, per topic, in the unit of the number; without an
    /// entry numbers must agree in every bit (what was not measured agrees with itself).
    pub tolerances: HashMap<String, f64>,
    /// Topics that are left out.
    pub ignore: Vec<String>,
}

/// What differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DiffReport {
    /// Whether nothing differs.
    pub same: bool,
    /// Topics that are in both.
    pub topics: Vec<TopicDiff>,
    /// Topics only in the first.
    pub only_in_a: Vec<String>,
    /// Topics only in the second.
    pub only_in_b: Vec<String>,
    /// Topics left out.
    pub ignored: Vec<String>,
    /// Stamps were not compared, because they are times of day in a realtime bag.
    pub stamps_ignored: bool,
    /// Where the bags part: the earliest of all first divergences, with its topic.
    pub first: Option<(String, Divergence)>,
}

/// What differs on one topic.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TopicDiff {
    /// Its name.
    pub topic: String,
    /// Messages that are in both.
    pub compared: u64,
    /// Of these, how many differ.
    pub differing: u64,
    /// Messages only in the first bag.
    pub only_in_a: u64,
    /// Messages only in the second bag.
    pub only_in_b: u64,
    /// Largest difference of any number, where both have one.
    pub largest: f64,
    /// The first message that differs.
    pub first: Option<Divergence>,
}

/// One difference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Divergence {
    /// Step of the message; for other people's messages its count on the topic.
    pub step: u64,
    /// Sequence number.
    pub sequence: u64,
    /// The field, such as `effort[0]`; `message` when one bag does not have it.
    pub field: String,
    /// In the first bag.
    pub a: String,
    /// In the second bag.
    pub b: String,
}

/// Compares two bags message by message, matched by topic, step and sequence; neither log times nor the order between topics count.
///
/// In realtime bags stamps do not count either. Memory grows only with how far the bags run apart.
/// Errors: a bag is damaged.
pub fn diff(a: &Reader, b: &Reader, options: &DiffOptions) -> Result<DiffReport, BagError> {
    let ignored = |name: &str| options.ignore.iter().any(|ignored| ignored == name);
    let has = |reader: &Reader, name: &str| reader.topics().iter().any(|topic| topic.name == name);
    let only = |this: &Reader, other: &Reader| -> Vec<String> {
        this.topics().iter().map(|topic| topic.name.clone()).filter(|name| !has(other, name) && !ignored(name)).collect()
    };
    let realtime = |reader: &Reader| reader.header().is_some_and(|header| header.clock == Clock::Realtime);
    let stamps_ignored = realtime(a) || realtime(b);
    let names = a.topics().iter().map(|topic| &topic.name).filter(|name| has(b, name) && !ignored(name));
    let mut pairs: Vec<Pair> = names
        .map(|name| Pair {
            found: TopicDiff { topic: name.clone(), ..TopicDiff::default() },
            tolerance: options.tolerances.get(name).copied(),
            stamps_ignored,
            sides: Default::default(),
        })
        .collect();
    let places: HashMap<String, usize> = pairs.iter().enumerate().map(|(index, pair)| (pair.found.topic.clone(), index)).collect();
    let mut sides = [Side::open(a)?, Side::open(b)?];
    while sides.iter().any(|side| !side.ended) {
        for side in 0..2 {
            let Some((entry, message)) = sides[side].next()? else { continue };
            if let Some(place) = places.get(&entry.topic.name) {
                pairs[*place].take(side, Item::new(entry, message));
                pairs[*place].compare();
            }
        }
    }
    for pair in &mut pairs {
        pair.end();
    }
    let topics: Vec<TopicDiff> = pairs.into_iter().map(|pair| pair.found).collect();
    let (only_in_a, only_in_b) = (only(a, b), only(b, a));
    let first = topics.iter().filter_map(|topic| Some((topic.topic.clone(), topic.first.clone()?))).min_by_key(|(_, first)| first.step);
    let same = first.is_none() && only_in_a.is_empty() && only_in_b.is_empty();
    let ignored = options.ignore.iter().filter(|name| has(a, name) || has(b, name)).cloned().collect();
    Ok(DiffReport { same, topics, only_in_a, only_in_b, ignored, stamps_ignored, first })
}

struct Side<'a> {
    reader: &'a Reader,
    messages: Messages,
    ended: bool,
}

impl<'a> Side<'a> {
    fn open(reader: &'a Reader) -> Result<Side<'a>, BagError> {
        Ok(Side { reader, messages: reader.messages()?, ended: false })
    }

    fn next(&mut self) -> Result<Option<(Entry, Option<Message>)>, BagError> {
        if self.ended {
            return Ok(None);
        }
        let Some(entry) = self.messages.next().transpose()? else {
            self.ended = true;
            return Ok(None);
        };
        let message = entry.message(self.reader.path())?;
        Ok(Some((entry, message)))
    }
}

/// A message that waits for its counterpart.
struct Item {
    key: (u64, u64),
    content: Content,
}

#[allow(clippy::large_enum_variant)] // nearly all are the large one
enum Content {
    Ours(Message),
    Foreign(Vec<u8>),
}

impl Item {
    fn new(entry: Entry, message: Option<Message>) -> Item {
        match message {
            Some(message) => Item { key: (message.step(), message.sequence()), content: Content::Ours(message) },
            None => Item { key: (0, u64::from(entry.sequence)), content: Content::Foreign(entry.payload) },
        }
    }
}

struct Pair {
    found: TopicDiff,
    tolerance: Option<f64>,
    stamps_ignored: bool,
    sides: [(VecDeque<Item>, u64); 2],
}

impl Pair {
    fn take(&mut self, side: usize, mut item: Item) {
        let (queue, count) = &mut self.sides[side];
        if let Content::Foreign(_) = item.content {
            item.key = (*count, item.key.1); // other people's messages are matched by their order
        }
        *count += 1;
        queue.push_back(item);
    }

    fn compare(&mut self) {
        let [(a, _), (b, _)] = &mut self.sides;
        while let (Some(first), Some(second)) = (a.front(), b.front()) {
            let foreign = matches!((&first.content, &second.content), (Content::Foreign(_), Content::Foreign(_)));
            if first.key == second.key || foreign {
                self.found.compared += 1;
                let difference = differs(first, second, self.tolerance, self.stamps_ignored, &mut self.found.largest);
                if let Some(divergence) = difference {
                    self.found.differing += 1;
                    self.found.first.get_or_insert(divergence);
                }
                a.pop_front();
                b.pop_front();
            } else if first.key < second.key {
                self.found.alone(0, first.key);
                a.pop_front();
            } else {
                self.found.alone(1, second.key);
                b.pop_front();
            }
        }
    }

    fn end(&mut self) {
        for side in 0..2 {
            while let Some(item) = self.sides[side].0.pop_front() {
                self.found.alone(side, item.key);
            }
        }
    }
}

impl TopicDiff {
    fn alone(&mut self, side: usize, (step, sequence): (u64, u64)) {
        let (there, not) = ("present".to_owned(), "missing".to_owned());
        let (a, b) = if side == 0 { (there, not) } else { (not, there) };
        *if side == 0 { &mut self.only_in_a } else { &mut self.only_in_b } += 1;
        self.first.get_or_insert(Divergence { step, sequence, field: "message".to_owned(), a, b });
    }
}

fn differs(a: &Item, b: &Item, tolerance: Option<f64>, stamps_ignored: bool, largest: &mut f64) -> Option<Divergence> {
    let (step, sequence) = a.key;
    let divergence = |field: String, a: String, b: String| Divergence { step, sequence, field, a, b };
    let (a, b) = match (&a.content, &b.content) {
        (Content::Ours(a), Content::Ours(b)) => (a, b),
        (Content::Foreign(a), Content::Foreign(b)) => {
            let at = a.iter().zip(b).position(|(a, b)| a != b).unwrap_or(a.len().min(b.len()));
            let byte = |bytes: &[u8]| bytes.get(at).map_or("end".to_owned(), |byte| format!("{byte:#04x}"));
            return (a != b).then(|| divergence(format!("byte {at}"), byte(a), byte(b)));
        }
        (Content::Ours(_), Content::Foreign(_)) | (Content::Foreign(_), Content::Ours(_)) => {
            return Some(divergence("type".to_owned(), "one of backdrive's and".to_owned(), "one of somebody else's".to_owned()));
        }
    };
    let mut first = None;
    let mut whole = |field: &str, a: String, b: String| {
        if a != b {
            first.get_or_insert(divergence(field.to_owned(), a, b));
        }
    };
    whole("layout", a.layout().to_string(), b.layout().to_string());
    whole("source", format!("{:08x}", a.source()), format!("{:08x}", b.source()));
    if !stamps_ignored {
        whole("stamp_ns", a.stamp_ns().to_string(), b.stamp_ns().to_string());
    }
    let mut numbers: Vec<(String, f64, f64)> = Vec::new();
    match (a, b) {
        (Message::Sample(a), Message::Sample(b)) => {
            whole("axes", a.axes.to_string(), b.axes.to_string());
            whole("flags", a.flags.to_string(), b.flags.to_string());
            if !a.same_bits(b) {
                let quantity = |name: &'static str, of: fn(&Sample) -> &[f64]| {
                    of(a).iter().zip(of(b)).enumerate().map(move |(axis, (a, b))| (format!("{name}[{axis}]"), *a, *b)).collect::<Vec<_>>()
                };
                numbers.extend(quantity("position", |sample| &sample.position));
                numbers.extend(quantity("velocity", |sample| &sample.velocity));
                numbers.extend(quantity("effort", |sample| &sample.effort));
            }
        }
        (Message::Gains(a), Message::Gains(b)) => {
            numbers.extend([("mu", a.mu, b.mu), ("lambda", a.lambda, b.lambda), ("ramp_s", a.ramp_s, b.ramp_s)].map(named));
        }
        (Message::Event(a), Message::Event(b)) => {
            whole("severity", a.severity.to_string(), b.severity.to_string());
            whole("kind", a.kind.to_string(), b.kind.to_string());
            whole("text", a.text.to_string(), b.text.to_string());
            numbers.push(named(("value", a.value, b.value)));
        }
        (Message::Status(a), Message::Status(b)) => {
            whole("steps", a.steps.to_string(), b.steps.to_string());
            whole("missed_deadlines", a.missed_deadlines.to_string(), b.missed_deadlines.to_string());
            whole("lost", a.lost.to_string(), b.lost.to_string());
            numbers.extend([("loop_p50_s", a.loop_p50_s, b.loop_p50_s), ("loop_p99_s", a.loop_p99_s, b.loop_p99_s)].map(named));
        }
        (Message::Margin(a), Message::Margin(b)) => {
            whole("axis", a.axis.to_string(), b.axis.to_string());
            whole("known", a.known.to_string(), b.known.to_string());
            numbers.extend([("gain", a.gain, b.gain), ("factor", a.factor, b.factor), ("deviation", a.deviation, b.deviation)].map(named));
            numbers.extend([("frequency_hz", a.frequency_hz, b.frequency_hz), ("decay_per_s", a.decay_per_s, b.decay_per_s)].map(named));
        }
        (Message::Sample(_) | Message::Gains(_) | Message::Event(_) | Message::Status(_) | Message::Margin(_), _) => {
            whole("type", format!("{:?}", a.kind()), format!("{:?}", b.kind()))
        }
    }
    for (field, a, b) in numbers {
        let distance = (a - b).abs();
        if distance > *largest {
            *largest = distance;
        }
        let equal = a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan() || tolerance.is_some_and(|tolerance| distance <= tolerance);
        if !equal {
            whole(&field, format!("{a:?}"), format!("{b:?}"));
        }
    }
    first
}

fn named((field, a, b): (&str, f64, f64)) -> (String, f64, f64) {
    (field.to_owned(), a, b)
}

impl fmt::Display for DiffReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.topics.iter().map(|topic| topic.topic.len()).max().unwrap_or(0);
        for topic in &self.topics {
            write!(f, "{:width$}  {:>9} compared", topic.topic, topic.compared)?;
            match &topic.first {
                None => writeln!(f, "  same")?,
                Some(first) => {
                    write!(f, "  {} differ", topic.differing)?;
                    if topic.only_in_a + topic.only_in_b > 0 {
                        write!(f, ", {} only in the first, {} only in the second", topic.only_in_a, topic.only_in_b)?;
                    }
                    writeln!(f, "; first at step {}: {} is {} and {}", first.step, first.field, first.a, first.b)?;
                }
            }
        }
        for (names, which) in [(&self.only_in_a, "only in the first"), (&self.only_in_b, "only in the second"), (&self.ignored, "left out")]
        {
            for name in names {
                writeln!(f, "{name:width$}  {which}")?;
            }
        }
        match &self.first {
            _ if self.same => writeln!(f, "the bags are the same{}", if self.stamps_ignored { ", stamps aside" } else { "" }),
            Some((topic, first)) => writeln!(f, "the bags part at step {} on {topic}", first.step),
            None => writeln!(f, "the bags have different topics"),
        }
    }
}
