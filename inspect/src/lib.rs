//! Is a recording right? What its signals are, what is wrong with them, and how each joint answers its command.
//!
//! [`inspect`] reads tables, bags and datasets through the reading layer of the bags and needs no model. What it cannot know it does not claim: a finding is
//! what the data themselves show, with how sure it is and what to do.
//!
//! ```
//! use backdrive_inspect::{Options, Source, inspect};
//!
//! let t: Vec<f64> = (0..1500).map(|i| f64::from(i) * 0.02).collect();
//! let command: Vec<f64> = t.iter().map(|t| (1.3 * t).sin()).collect();
//! let position: Vec<f64> = t.iter().map(|t| -(1.3 * (t - 0.1)).sin()).collect();
//! let columns = vec![("t".to_string(), t), ("command".to_string(), command), ("position".to_string(), position)];
//! let report = inspect(&[Source::Columns { name: "memory".to_string(), columns }], &Options::default())?;
//! assert!(report.wrong().any(|finding| finding.todo.contains("scale = -1")));
//! # Ok::<(), backdrive_inspect::InspectError>(())
//! ```

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod advice;
mod checks;
mod finding;
mod joints;
mod names;
mod numeric;
mod quantity;
mod read;
mod recognise;
mod recording;
mod report;
mod response;
mod runs;
mod settle;
mod source;
mod time;

pub use finding::{Finding, FindingKind, Weight};
pub use quantity::{Quantity, Side};
pub use recording::{Recording, Signal, Stream};
pub use report::{ClockReport, Report, SignalReport};
pub use response::{Bandwidth, Interval, Response};
pub use source::{InspectError, Options, Source};

use backdrive_diagnosis::recordings::noise;
use joints::Joint;

/// Inspects recordings: each by itself, and the zeros of their joints beside each other.
///
/// # Errors
/// A file is missing, damaged or of a format that is not read; a table has no times.
pub fn inspect(sources: &[Source], options: &Options) -> Result<Report, InspectError> {
    Ok(inspect_with_data(sources, options)?.0)
}

/// As [`inspect`], with the recordings, for pictures.
///
/// # Errors
/// As of [`inspect`].
pub fn inspect_with_data(sources: &[Source], options: &Options) -> Result<(Report, Vec<Recording>), InspectError> {
    let mut recordings = read::recordings(sources, options)?;
    recordings.iter_mut().for_each(recognise::recognise);
    let mut all: Vec<(Recording, Vec<Joint>)> = recordings
        .into_iter()
        .map(|recording| {
            let joints = joints::joints(&recording);
            (recording, joints)
        })
        .collect();
    let mut report = Report {
        files: all.iter().map(|(recording, _)| recording.file.clone()).collect(),
        clocks: Vec::new(),
        signals: Vec::new(),
        responses: Vec::new(),
        findings: Vec::new(),
        notes: Vec::new(),
    };
    for (recording, joints) in &mut all {
        let joints = joints.as_slice();
        let mut findings = checks::all(recording, joints);
        for (response, limit) in response::responses(recording, joints) {
            findings.extend(limit.map(|limit| settle::limited(recording, &response, &limit)));
            report.responses.push(response);
        }
        report.findings.extend(settle::settled(findings));
        let recording = &*recording;
        report.clocks.extend(recording.streams.iter().map(|stream| clock(recording, stream)));
        report.signals.extend(recording.signals.iter().map(|signal| known(recording, signal)));
        report.notes.extend(recording.notes.iter().map(|note| format!("{}: {note}", recording.file)));
    }
    let mut shifted = Vec::new();
    checks::zeros(&all, &mut shifted);
    report.findings.extend(settle::without_scaled(shifted, &report.findings));
    report.findings.sort_by_key(|finding| std::cmp::Reverse(finding.weight));
    Ok((report, all.into_iter().map(|(recording, _)| recording).collect()))
}

fn clock(recording: &Recording, stream: &Stream) -> ClockReport {
    let steps: Vec<f64> = stream.times.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
    let usual = numeric::median(&steps);
    ClockReport {
        file: recording.file.clone(),
        topic: stream.topic.clone(),
        samples: stream.times.len(),
        rate_hz: if usual > 0.0 { 1.0 / usual } else { 0.0 },
        jitter_ms: numeric::jitter_ms(&steps),
        duration_s: stream.time(stream.times.len().saturating_sub(1)),
    }
}

fn known(recording: &Recording, signal: &Signal) -> SignalReport {
    let (low, high) = numeric::extremes(&signal.values).unwrap_or((0.0, 0.0));
    SignalReport {
        file: recording.file.clone(),
        name: signal.name.clone(),
        joint: signal.joint.clone(),
        quantity: signal.quantity,
        unit: signal.stated.or(signal.hint).map(|unit| unit.name.to_string()),
        sure: signal.sure,
        why: signal.why.clone(),
        range: [low, high],
        step: noise::step_of(&signal.values),
        noise: noise::white(&signal.values).filter(|noise| noise.is_finite()),
    }
}
