//! The stability of a recorded loop as a row.

use crate::answered::{Answered, Row};
use crate::error::FleetError;
use crate::manifest::{Entry, Manifest, Source};
use backdrive_stability::asked::{Asked, Options};
use backdrive_stability::verdict::{Answer, answer};
use std::sync::atomic::AtomicBool;

/// Judges the loop of one recording at its own gain.
pub(super) fn judged(manifest: &Manifest, entry: &Entry) -> Result<Answered, FleetError> {
    let Source::File(recording) = &entry.source else {
        return Err(FleetError::input("an episode of a dataset holds no loop; --what stability takes bags"));
    };
    let found = loop_of(&Options { recording: recording.clone(), roles: manifest.roles.clone(), ..Options::default() })?;
    let mut row = Row::of("loop");
    row.word("verdict", found.verdict.text());
    row.number("gain", found.gain.product());
    row.number("critical_gain", found.critical_gain.unwrap_or(f64::NAN));
    row.number("critical_gain_at_least", found.at_least.unwrap_or(f64::NAN));
    if let Some((low, high)) = found.critical_gain_ci95 {
        row.number("critical_gain_low", low);
        row.number("critical_gain_high", high.unwrap_or(f64::NAN));
    }
    row.number("critical_frequency_hz", found.critical_frequency_hz.unwrap_or(f64::NAN));
    let apart: Vec<&str> = found.checks.iter().filter(|check| !check.agrees).map(|check| check.part).collect();
    row.word("disagreeing_models", &apart.join(", "));
    let mut verdict = found.json();
    verdict["bag"] = serde_json::json!(entry.name);
    Ok(Answered { sentence: format!("{}: {}", found.verdict.text(), found.reason), error: None, rows: vec![row], verdict })
}

/// The answer to the question about a recorded loop.
///
/// # Errors
/// The recording holds no loop, or it cannot be judged.
pub(crate) fn loop_of(options: &Options) -> Result<Answer, FleetError> {
    let asked = Asked::read(options).map_err(FleetError::input)?;
    let question = asked.question(options).map_err(FleetError::input)?;
    let no = |e: &dyn std::fmt::Display| FleetError::input(format!("{}: {e}", options.recording.display()));
    answer(&question, &|_, _, _| {}, &AtomicBool::new(false)).map_err(|e| no(&e))
}
