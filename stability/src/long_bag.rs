//! A bag of ours that is longer than what is judged at once: read in pieces, so that memory does not grow with its length.

use crate::bag_rows::{Place, Rows, check_steps};
use crate::outcome::Outcome;
use crate::session::Session;
use crate::signal_role::{SessionError, cut_short};
use crate::unjudged::Unjudged;
use crate::verdict::recorded_outcome;
use backdrive_bags::Reader;
use backdrive_msgs::Message;
use backdrive_nodes::graph::Graph;
use std::collections::BTreeMap;

/// Steps of one axis that are judged at once: 500 s at 1 kHz, with all that is computed from them below 500 MB.
pub const MOST_ROWS: usize = 500_000;

/// Pieces overlap by so much, so that a hold at the end of one is whole in the next, s. To be judged a hold needs less than half a second.
const OVERLAP_S: f64 = 5.0;

/// Reads a bag in pieces of `most` steps: its rows are those of the worst piece, of equals the first.
pub(crate) fn read(reader: &Reader, graph: &Graph, place: &Place, most: u64) -> Result<Session, SessionError> {
    let overlap = ((OVERLAP_S / graph.period_s()) as u64).min(most / 4);
    let mut pieces = Pieces { most, overlap, open: BTreeMap::new(), next: 0, gains: Vec::new(), found: Vec::new() };
    let (mut first, mut last, mut messages) = (u64::MAX, 0, 0_u64);
    for entry in reader.messages()? {
        let entry = entry?;
        match (place.message(&entry)?, place.heard(&entry)) {
            (Some(Message::Sample(sample)), Some(index)) => {
                (first, last, messages) = (first.min(sample.step), last.max(sample.step), messages + 1);
                check_steps(reader.path(), first, last, messages)?;
                // What comes to a piece that is closed is missing there, which is a gap.
                for number in pieces.of(sample.step).filter(|number| *number >= pieces.next) {
                    pieces.open.entry(number).or_insert_with(|| Rows::of(place)).hear(place, index, &sample);
                }
                // Behind another half of a piece nothing comes late any more.
                let ended = sample.step.saturating_sub(overlap + most / 2) / most;
                while pieces.open.first_key_value().is_some_and(|(number, _)| *number < ended) {
                    pieces.close(reader, graph, place);
                }
            }
            (Some(Message::Gains(g)), None) => pieces.gains.push((g.step, g.mu, g.lambda)),
            _ => {}
        }
    }
    while !pieces.open.is_empty() {
        pieces.close(reader, graph, place);
    }
    let rows = last.saturating_sub(first.min(last)) as usize + 1;
    let cut_short = cut_short(reader, graph.timing.steps.unwrap_or(0) as usize, rows);
    let outcome = Outcome::worst(pieces.found.iter().map(|(_, outcome)| *outcome));
    let rank = |outcome: &Outcome| outcome.rank();
    let worst = outcome.as_ref().map_or(0, rank);
    let chosen = pieces.found.iter().find(|(_, outcome)| rank(outcome) == worst).map_or(0, |(number, _)| *number);

    let mut kept = Rows::of(place);
    for entry in reader.messages()? {
        let entry = entry?;
        // Without decoding it: a bag of ours states the step beside every other fact.
        if entry.facts.is_some_and(|facts| !pieces.of(facts.step).contains(&chosen)) {
            continue;
        }
        if let (Some(Message::Sample(sample)), Some(index)) = (place.message(&entry)?, place.heard(&entry))
            && pieces.of(sample.step).contains(&chosen)
        {
            kept.hear(place, index, &sample);
        }
    }
    kept.gains = pieces.gains.clone();
    let mut session = kept.session(reader, graph, place)?;
    let seconds = |steps: u64| steps as f64 * session.period_s;
    let from = (chosen * most).max(first);
    session.notes.push(format!(
        "the recording of {:.0} s is too long to analyse at once: its motion is judged in {} parts. Frequency response, models and \
         re-simulation use {:.0} s to {:.0} s, {}",
        seconds(rows as u64),
        pieces.found.len(),
        seconds(from - first),
        seconds(from - first) + session.len() as f64 * session.period_s,
        if worst <= Outcome::Stable.rank() { "the first part with the most information" } else { "the first of the least stable parts" }
    ));
    session.elsewhere = outcome;
    session.cut_short = cut_short;
    Ok(session)
}

struct Pieces {
    /// Steps of a piece, the overlap aside.
    most: u64,
    overlap: u64,
    open: BTreeMap<u64, Rows>,
    /// Every piece below it is closed.
    next: u64,
    gains: Vec<(u64, f64, f64)>,
    /// Number of a piece, and what the recording did in it.
    found: Vec<(u64, Outcome)>,
}

impl Pieces {
    /// The pieces that a step is in: one, or two where they overlap; none that is closed.
    fn of(&self, step: u64) -> std::ops::RangeInclusive<u64> {
        let number = step / self.most;
        let before = number > 0 && step % self.most < self.overlap;
        if before { number - 1..=number } else { number..=number }
    }

    /// Judges the first piece that is open.
    fn close(&mut self, reader: &Reader, graph: &Graph, place: &Place) {
        let Some((number, mut rows)) = self.open.pop_first() else { return };
        self.next = number + 1;
        rows.gains = self.gains.clone();
        let outcome = match rows.session(reader, graph, place) {
            // Whether the end of the recording is there is judged for the whole.
            Ok(session) => recorded_outcome(&Session { cut_short: None, ..session }).unwrap_or(Outcome::NotJudged { why: Unjudged::Empty }),
            // A signal of the loop is silent for all of the piece.
            Err(_) => Outcome::NotJudged { why: Unjudged::Gaps { steps: self.most as usize, of: self.most as usize } },
        };
        self.found.push((number, outcome));
    }
}
