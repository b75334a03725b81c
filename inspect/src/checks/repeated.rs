//! Stretches of rows that stand in a file twice.

use crate::advice;
use crate::finding::{Finding, FindingKind};
use crate::numeric::span;
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal};
use std::collections::{HashMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};

/// A repeated stretch has at least this number of rows, all different from the row before.
const LEAST_ROWS: usize = 8;
/// Values that change in it, over all columns: one slow column may pass a place twice alike.
const LEAST_CHANGES: usize = 22;
/// Share of its range that something measured moves in it: at rest, coarse values repeat by themselves.
const MOVES: f64 = 0.02;
/// Beyond this share of the recording it is a motion that repeats itself, simulated without noise.
const MOST: f64 = 0.4;

/// Finds them.
pub fn check(recording: &Recording, out: &mut Vec<Finding>) {
    for (place, stream) in recording.streams.iter().enumerate() {
        let columns: Vec<&Signal> = recording
            .signals
            .iter()
            .filter(|signal| signal.stream == place && signal.other.is_none() && signal.quantity != Quantity::Counter)
            .filter(|signal| span(&signal.values) > 0.0)
            .collect();
        if !columns.iter().any(|signal| signal.quantity.is_measured()) {
            continue;
        }
        let rows = stream.times.len();
        let hash = |row: usize| {
            let mut hasher = DefaultHasher::new();
            columns.iter().for_each(|signal| signal.values[row].to_bits().hash(&mut hasher));
            hasher.finish()
        };
        let mut seen: HashMap<u64, usize> = HashMap::with_capacity(rows);
        // Length of the stretch that ends here, and from where it was copied.
        let (mut best, mut total, mut begun): ((usize, usize, usize, usize), usize, usize) = Default::default();
        let mut now: Option<(usize, usize)> = None;
        for row in 0..rows {
            // Where nothing changes rows are alike anyway.
            let rests = row > 0 && columns.iter().all(|signal| signal.values[row] == signal.values[row - 1]);
            let earlier = seen.insert(hash(row), row);
            if rests {
                continue;
            }
            now = match (now, earlier) {
                (Some((offset, length)), Some(earlier)) if row - earlier == offset => Some((offset, length + 1)),
                (_, Some(earlier)) => Some((row - earlier, 1)),
                (_, None) => None,
            };
            if let Some((offset, length)) = now {
                total += 1;
                if length == 1 {
                    begun = row;
                }
                if length > best.0 {
                    best = (length, begun, row, offset);
                }
            }
        }
        let (length, from, to, offset) = best;
        let distinct: HashSet<u64> = (from..=to).map(hash).collect();
        let part = |signal: &Signal| signal.values.get(from..=to).map_or(0.0, span);
        let moves = columns.iter().any(|signal| signal.quantity.is_measured() && part(signal) > MOVES * span(&signal.values));
        let changes: usize = columns
            .iter()
            .filter_map(|signal| signal.values.get(from..=to))
            .map(|part| part.windows(2).filter(|w| w[0] != w[1]).count())
            .sum();
        if length < LEAST_ROWS || distinct.len() < LEAST_ROWS || changes < LEAST_CHANGES || !moves || total as f64 > MOST * rows as f64 {
            continue;
        }
        let (word, a, b, c) = (stream.row_word(), stream.row(from), stream.row(to), stream.row(from - offset));
        let message = format!("{word} {a} to {b} repeat the values of {word} {c} and following exactly: the logger wrote a buffer twice");
        let mut finding = Finding::new(FindingKind::Repeated, &recording.file, &[], message);
        finding.signals = columns.iter().map(|signal| signal.name.clone()).collect();
        finding.rows = Some([a, b]);
        finding.time_s = Some([stream.time(from), stream.time(to)]);
        out.push(finding.todo(advice::without(&recording.file, from, to + 1, rows)));
    }
}
