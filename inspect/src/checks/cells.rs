//! Cells that hold no number.

use crate::advice;
use crate::finding::{Finding, FindingKind, Weight};
use crate::recording::Recording;

/// Finds what is missing.
pub fn check(recording: &Recording, out: &mut Vec<Finding>) {
    for signal in &recording.signals {
        let stream = recording.stream(signal);
        if let Some(other) = &signal.other {
            // A column of words is one from its first row on; another one was broken off.
            let first = stream.lines.first().map(|line| format!("in line {line}:"));
            let is_words = first.is_none_or(|first| other.contains(&first));
            let weight = if is_words { Weight::Note } else { Weight::Wrong };
            let finding =
                Finding::new(FindingKind::Missing, &recording.file, &[&signal.name], format!("column {:?} holds {other}", signal.name));
            out.push(finding.weighing(weight).todo("remove these rows, or omit the column if it is not needed"));
            continue;
        }
        let Some(first) = signal.values.iter().position(|x| !x.is_finite()) else { continue };
        let count = signal.values.iter().filter(|x| !x.is_finite()).count();
        let last = (first..signal.values.len()).take_while(|row| !signal.values[*row].is_finite()).last().unwrap_or(first);
        let (word, row) = (stream.row_word(), stream.row(first));
        let message = format!("{:?}: {count} of {} values are missing, the first in {word} {row}", signal.name, signal.values.len());
        let mut finding = Finding::new(FindingKind::Missing, &recording.file, &[&signal.name], message).at(&signal.joint);
        finding.rows = Some([row, stream.row(last)]);
        finding.time_s = Some([stream.time(first), stream.time(last)]);
        out.push(finding.todo(advice::without(&recording.file, first, last + 1, signal.values.len())));
    }
}
