//! A bag in one look.

use crate::account::{Account, Fault};
use crate::header::Clock;
use crate::offer::recover_command;
use crate::reader::TopicRef;
use crate::{BagError, Reader};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// What a bag holds. Fields that only backdrive writes are empty for other people's bags.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BagInfo {
    /// The file.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// Its profile, such as `ros2`.
    pub profile: String,
    /// Who wrote it.
    pub library: String,
    /// Title of the graph.
    pub title: Option<String>,
    /// How time ran: `lockstep`, `realtime` or `imported`.
    pub clock: Option<&'static str>,
    /// Steps per second.
    pub rate_hz: Option<f64>,
    /// Host or machine, where the bag names it.
    pub host: Option<String>,
    /// Program and version.
    pub versions: BTreeMap<String, String>,
    /// What each seed was for, and the seed.
    pub seeds: BTreeMap<String, u64>,
    /// Names of the models and other files in it.
    pub files: Vec<String>,
    /// Log time of the first message, s.
    pub start_s: Option<f64>,
    /// From the first to the last log time, s.
    pub duration_s: f64,
    /// Messages.
    pub messages: u64,
    /// Topic by topic.
    pub topics: Vec<TopicSummary>,
    /// Whether nothing is missing; unknown for other people's bags.
    pub complete: Option<bool>,
    /// Messages known to be missing.
    pub lost: Option<u64>,
    /// Whether its writer closed it. If not, `recover` makes a clean copy.
    pub ended_cleanly: bool,
    /// The first damage, if there is any; what stands behind it is not counted.
    pub damage: Option<String>,
    /// What forbids calling it whole: losses, damage, contradictions. Empty where nothing does.
    pub faults: Vec<Fault>,
    /// Errors in its own records that have no consequences.
    pub notes: Vec<String>,
    /// Whether every message and its checksum was read; otherwise all this is what stands at the end of the file.
    pub read_whole: bool,
}

/// A topic of a bag.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TopicSummary {
    /// Name.
    pub name: String,
    /// ROS type.
    pub type_name: String,
    /// Node that speaks on it.
    pub publisher: String,
    /// Names of its axes.
    pub axes: Vec<String>,
    /// Messages.
    pub messages: u64,
    /// Mean rate between its first and its last message, 1/s; unknown with fewer than two.
    pub rate_hz: Option<f64>,
    /// Messages known to be missing; unknown for other people's messages.
    pub lost: Option<u64>,
    /// Why no command reads its messages, and what to do, where that is so.
    pub unread: Option<String>,
}

/// Sums a bag up from what stands at its end, without reading its messages: in the same time whatever its size. Damage among the
/// messages is not seen, for which see [`check`].
///
/// A bag is read whole, as by [`check`], where its end does not represent its messages. Reasons are: it was not closed, others wrote it without
/// statistics or indices, or rewrote a bag of ours, or its recorder's record and its statistics have different counts. Errors: it cannot be read or
/// is no MCAP file.
pub fn info(path: &Path) -> Result<BagInfo, BagError> {
    let Some((reader, spans)) = Reader::of_summary(path)? else { return check(path) };
    if !end_is_believed(&reader) {
        return check(path);
    }
    let by_topic = |topic: &Arc<TopicRef>| spans.0.get(&topic.channel).copied();
    let lost = |topic: &Arc<TopicRef>| {
        reader.completeness().and_then(|record| record.topics.iter().find(|told| told.topic == topic.name)).map(|told| told.lost)
    };
    let of_record = reader.completeness().into_iter().flat_map(|record| &record.topics).filter(|told| told.lost > 0);
    let faults = of_record.map(|told| Fault::Lost { topic: told.topic.clone(), messages: told.lost, of: told.written + told.lost });
    let damaged = reader.damage().iter().map(|what| Fault::Damaged { what: what.clone() });
    let denied = reader.contradictions().iter().map(|what| Fault::Contradiction { what: what.clone() });
    let heard = Heard {
        spans: reader.topics().iter().map(by_topic).collect(),
        counts: reader.counts().to_vec(),
        lost: reader.topics().iter().map(lost).collect(),
        faults: damaged.chain(denied).chain(faults).collect(),
        ..Heard::default()
    };
    Ok(sum_up(&reader, heard))
}

/// Whether the records at the end of a bag of ours represent its messages.
fn end_is_believed(reader: &Reader) -> bool {
    let Some(header) = reader.header() else { return true };
    let Some(record) = reader.completeness() else { return false };
    let counted = |name: &str| reader.topics().iter().position(|topic| topic.name == name).and_then(|index| reader.counts().get(index));
    let is_rate = header.rate_hz.is_finite() && header.rate_hz > 0.0 || header.clock == Clock::Imported;
    is_rate && !record.recovered && record.topics.iter().all(|told| counted(&told.topic).copied().unwrap_or(0) == told.written)
}

/// What is known of a bag's messages, by topic.
#[derive(Default)]
struct Heard {
    /// First and last log time, ns.
    spans: Vec<Option<(u64, u64)>>,
    counts: Vec<u64>,
    /// Messages that are missing.
    lost: Vec<Option<u64>>,
    faults: Vec<Fault>,
    notes: Vec<String>,
    /// That of the messages, where the metadata say another.
    rate_hz: Option<f64>,
    whole: bool,
}

/// Reads a whole bag, checksums included, and sums it up.
///
/// Errors: it cannot be read or is no MCAP file. Damage inside is reported in the result.
pub fn check(path: &Path) -> Result<BagInfo, BagError> {
    let reader = Reader::open(path)?;
    let Account { topics, spans, counts, rate_hz, faults, notes, rate_is_denied, .. } = Account::of(&reader)?;
    let rate_hz = rate_hz.filter(|_| rate_is_denied);
    let lost = topics.iter().map(|topic| topic.as_ref().map(|topic| topic.lost)).collect();
    Ok(sum_up(&reader, Heard { spans, counts, lost, faults, notes, rate_hz, whole: true }))
}

fn sum_up(reader: &Reader, heard: Heard) -> BagInfo {
    let Heard { spans, counts, lost, faults, notes, rate_hz, whole } = heard;
    let topics: Vec<TopicSummary> = reader
        .topics()
        .iter()
        .enumerate()
        .map(|(index, topic)| TopicSummary {
            name: topic.name.clone(),
            type_name: topic.type_name.clone(),
            publisher: reader
                .header()
                .and_then(|header| header.topics.iter().find(|info| info.topic.name == topic.name))
                .map(|info| info.publisher.clone())
                .unwrap_or_default(),
            axes: topic.axes.clone(),
            messages: counts[index],
            rate_hz: spans[index]
                .filter(|(first, last)| last > first)
                .map(|(first, last)| (counts[index] - 1) as f64 / ((last - first) as f64 * 1e-9)),
            lost: lost[index],
            unread: topic.unread(),
        })
        .collect();
    let first = spans.iter().flatten().map(|span| span.0).min();
    let last = spans.iter().flatten().map(|span| span.1).max();
    let is_known = reader.header().is_some() || lost.iter().any(Option::is_some);
    let lost = faults.iter().map(|fault| if let Fault::Lost { messages, .. } = fault { *messages } else { 0 }).sum();
    let header = reader.header().cloned();
    let told = header.as_ref();
    BagInfo {
        path: reader.path().display().to_string(),
        bytes: reader.bytes(),
        profile: reader.profile().to_owned(),
        library: reader.library().to_owned(),
        title: told.map(|header| header.title.clone()),
        clock: told.map(|header| header.clock.as_str()),
        // Of a rate that the messages deny, theirs.
        rate_hz: told.map(|header| rate_hz.unwrap_or(header.rate_hz)),
        host: told.map(|header| header.host.clone()).filter(|host| !host.is_empty()),
        files: told.map(|header| header.files.iter().map(|file| file.0.clone()).collect()).unwrap_or_default(),
        start_s: first.map(|time| time as f64 * 1e-9),
        duration_s: first.zip(last).map_or(0.0, |(first, last)| (last - first) as f64 * 1e-9),
        messages: counts.iter().sum(),
        topics,
        complete: reader.header().is_some().then_some(faults.is_empty()),
        lost: is_known.then_some(lost),
        ended_cleanly: reader.ended_cleanly(),
        damage: faults.iter().find_map(|fault| if let Fault::Damaged { what } = fault { Some(what.clone()) } else { None }),
        read_whole: whole,
        versions: header.as_ref().map(|header| header.versions.clone()).unwrap_or_default(),
        seeds: header.map(|header| header.seeds).unwrap_or_default(),
        faults,
        notes,
    }
}

impl fmt::Display for BagInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}  {}", self.path, size(self.bytes))?;
        if let Some(title) = self.title.as_deref().filter(|title| !title.is_empty()) {
            writeln!(f, "  {title}")?;
        }
        let clock = self.clock.map_or(String::new(), |clock| format!("{clock}, "));
        let rate = self.rate_hz.map_or(String::new(), |rate| format!(" at {rate} Hz"));
        writeln!(f, "  {clock}{:.3} s{rate}, {} messages", self.duration_s, self.messages)?;
        if !self.files.is_empty() {
            writeln!(f, "  with {}", self.files.join(", "))?;
        }
        let by = if self.library.is_empty() { "an unknown program" } else { &self.library };
        writeln!(f, "  written by {by}{}", self.host.as_deref().map_or(String::new(), |host| format!(" on {host}")))?;
        let width = self.topics.iter().map(|topic| topic.name.len()).max().unwrap_or(0);
        let types = self.topics.iter().map(|topic| topic.type_name.len()).max().unwrap_or(0);
        for topic in &self.topics {
            let rate = topic.rate_hz.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}"));
            let lost = match topic.lost {
                Some(0) | None => String::new(),
                Some(lost) => format!("  {lost} LOST"),
            };
            writeln!(f, "  {:width$}  {:types$}  {:>9}  {rate:>9} Hz{lost}", topic.name, topic.type_name, topic.messages)?;
        }
        for unread in self.topics.iter().filter_map(|topic| topic.unread.as_ref()) {
            writeln!(f, "  NOT READ: {unread}")?;
        }
        let verdict = match (self.complete, self.lost) {
            (_, Some(lost)) if lost > 0 => format!("INCOMPLETE: {lost} messages lost"),
            (_, _) if self.faults.iter().any(|fault| matches!(fault, Fault::Contradiction { .. })) => "CONTRADICTORY".to_owned(),
            (Some(true), _) => "complete".to_owned(),
            (Some(false), _) => "no gaps, but what is missing at its end is not known".to_owned(),
            (None, _) => "whether it is complete is not known".to_owned(),
        };
        writeln!(f, "  {verdict}")?;
        for fault in self.faults.iter().filter(|fault| !matches!(fault, Fault::NotClosed | Fault::Damaged { .. })) {
            writeln!(f, "    {fault}")?;
        }
        for note in &self.notes {
            writeln!(f, "  note: {note}")?;
        }
        if !self.ended_cleanly {
            match self.messages {
                0 => writeln!(f, "  the file was not closed and is cut off before its first message; record it again")?,
                _ => writeln!(f, "  the file was not closed; `{}` makes a clean copy", recover_command(Path::new(&self.path)))?,
            }
            writeln!(f, "  it has no summary at its end, so all of it was read")?;
        }
        if let Some(damage) = &self.damage {
            writeln!(f, "  DAMAGED: {damage}")?;
        }
        if self.read_whole && self.ended_cleanly {
            writeln!(f, "  every message was read, with its checksum where there is one")?;
        }
        if !self.read_whole {
            writeln!(f, "  from its summary; `backdrive bag info --check` reads every message and its checksum")?;
        }
        Ok(())
    }
}

fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 * 1e-3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 * 1e-6),
        _ => format!("{:.2} GB", bytes as f64 * 1e-9),
    }
}
