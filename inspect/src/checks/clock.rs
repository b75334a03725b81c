//! The clock of each stream: gaps, time that goes back, stamps that stand twice, uneven steps.

use crate::advice;
use crate::finding::{Finding, FindingKind, Weight};
use crate::recording::Recording;
use backdrive_bags::{ClockFaultKind, clock_faults};

/// Least size of a gap, in usual steps and in seconds. A shorter jump is a late sample, which is visible in its time.
const GAP_STEPS: f64 = 5.0;
const GAP_S: f64 = 0.05;

/// Finds what is wrong.
pub fn check(recording: &Recording, out: &mut Vec<Finding>) {
    for stream in &recording.streams {
        for fault in clock_faults(&stream.times) {
            let kind = match fault.kind {
                ClockFaultKind::StandsStill => FindingKind::DuplicateTimes,
                ClockFaultKind::GoesBack => FindingKind::TimeGoesBack,
                ClockFaultKind::Jumps => FindingKind::Gap,
                ClockFaultKind::Uneven => FindingKind::Jitter,
            };
            let is_gap = fault.range[1] > GAP_STEPS * fault.usual && fault.range[1] > GAP_S;
            // Messages of one burst share a stamp; rows of a table do not.
            let is_table = stream.topic.is_empty();
            let weight = match fault.kind {
                ClockFaultKind::Jumps if !is_gap => Weight::Note,
                ClockFaultKind::Uneven => Weight::Note,
                ClockFaultKind::StandsStill if !is_table => Weight::Note,
                _ => Weight::Wrong,
            };
            let of = if is_table { String::new() } else { format!("{}: ", stream.topic) };
            let mut row = fault.row;
            if fault.kind == ClockFaultKind::Jumps
                && let Some(longest) = (1..stream.times.len()).max_by(|a, b| step(stream, *a).total_cmp(&step(stream, *b)))
            {
                row = longest - 1;
            }
            let mut finding = Finding::new(kind, &recording.file, &[], format!("{of}{fault}")).weighing(weight);
            finding.signals.extend(recording.time.clone().or_else(|| Some(stream.topic.clone()).filter(|topic| !topic.is_empty())));
            finding.rows = Some([stream.row(row), stream.row(row + 1)]);
            finding.time_s = Some([stream.time(row), stream.time(row + 1)]);
            finding.todo = match fault.kind {
                ClockFaultKind::Uneven => "nothing: the recorded times are used unchanged".to_string(),
                ClockFaultKind::StandsStill => format!("leave out {} {}", stream.row_word(), stream.row(row + 1)),
                _ => advice::without(&recording.file, row + 1, row + 1, stream.times.len()),
            };
            out.push(finding);
        }
    }
}

fn step(stream: &crate::recording::Stream, row: usize) -> f64 {
    stream.times[row] - stream.times[row - 1]
}
