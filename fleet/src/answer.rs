//! The answer to one recording: a row for each joint, and the verdict.

mod device;
mod fit;
mod loops;

use crate::answered::Answered;
use crate::error::FleetError;
use crate::manifest::{Entry, Loaded, Manifest, Source};
use crate::triage::triage;
use crate::what::What;

/// Answers for one recording. What is wrong with the recording is part of the answer.
///
/// # Errors
/// This machine cannot read a file.
pub fn answer(manifest: &Manifest, entry: &Entry, loaded: &Loaded, what: What) -> Result<Answered, FleetError> {
    let answered = match what {
        What::Triage => triage(manifest, entry, loaded),
        What::Diagnose => device::diagnosed(manifest, entry, loaded),
        What::Fit => device::fitted(manifest, entry, loaded),
        What::Stability => loops::judged(manifest, entry),
    };
    match answered {
        Err(FleetError::Input(why)) => Ok(Answered::failed(without_path(why, entry))),
        other => other,
    }
}

/// A message without the place of the recording: the same bytes have the same answer wherever they are.
fn without_path(why: String, entry: &Entry) -> String {
    let (Source::File(path) | Source::Episode(path, _)) = &entry.source;
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.clone());
    why.replace(&whole.display().to_string(), "the recording").replace(&path.display().to_string(), "the recording")
}
