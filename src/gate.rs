//! `backdrive gate`: did a change of software or hardware change the device, and does it matter?

use crate::failure::{Failure, code};
use crate::{cli, output, progress};
use backdrive_fleet::gate::{Bounds, Check, Gated, Outcome, gate as compared, junit};

/// Compares, prints what changed, and ends with 1 where it matters.
pub fn gate(options: &cli::Gate) -> Result<u8, Failure> {
    if let Some(file) = &options.junit {
        output::writable(file)?;
    }
    let bounds = options.bounds.as_deref().map(Bounds::open).transpose()?.unwrap_or_default();
    let work = || compared(&options.old, &options.new, options.model.as_deref(), options.roles.as_deref(), &bounds);
    let found = progress::busy("comparing", work)?;
    if let Some(file) = &options.junit {
        output::file(file, junit(&found))?;
    }
    let code = ended(&found);
    match options.json {
        true => output::json(&serde_json::json!({ "code": code, "checks": found.checks, "notes": found.notes }))?,
        false => output::text(text(&found))?,
    }
    Ok(code)
}

/// The exit code: a failed check outweighs one that is not known.
fn ended(found: &Gated) -> u8 {
    match (found.with(Outcome::Failed).next(), found.with(Outcome::Uncertain).next()) {
        (Some(_), _) => code::NEGATIVE,
        (None, Some(_)) => code::CANNOT_TELL,
        (None, None) => 0,
    }
}

fn text(found: &Gated) -> String {
    let mut lines = Vec::new();
    for (title, outcome) in [("changed", Outcome::Failed), ("not known", Outcome::Uncertain)] {
        lines.extend(found.with(outcome).map(|check| format!("{title:9} {}", check.sentence)));
    }
    let open: Vec<String> = found.with(Outcome::NotJudged).map(|check| format!("{} {}", check.place, check.quantity)).collect();
    if !open.is_empty() {
        lines.push(format!("not judged, for the old recordings do not determine them to within their bounds: {}", open.join(", ")));
    }
    let is_stated = |check: &&Check| check.place == "loop" && check.sentence.starts_with("loop: the graphs state");
    lines.extend(found.with(Outcome::Passed).filter(is_stated).map(|check| format!("stated    {}", check.sentence)));
    lines.extend(found.notes.iter().map(|note| format!("note      {note}")));
    let passed = found.with(Outcome::Passed).count();
    lines.push(match ended(found) {
        0 => format!("answer    no change beyond the bounds in {passed} checks"),
        code::NEGATIVE => format!("answer    {} of {} checks failed", found.with(Outcome::Failed).count(), found.checks.len()),
        _ => format!("answer    not known: {} of {} checks are not determined", found.with(Outcome::Uncertain).count(), found.checks.len()),
    });
    lines.join("\n") + "\n"
}
