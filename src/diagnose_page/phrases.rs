//! What every part of the page says in the same way.

use backdrive_diagnosis::candidate::Candidate;
use backdrive_diagnosis::verdict::Word;
use backdrive_report::Tone;

/// Whether a candidate adds any physics.
pub(super) fn adds(candidate: &Candidate) -> bool {
    !candidate.structure.added.is_empty()
}

/// A sentence from a clause: its first letter large, a full stop at its end.
pub(super) fn capital(clause: &str) -> String {
    let mut chars = clause.chars();
    let first: String = chars.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    let stop = if clause.is_empty() || clause.ends_with(['.', '!', '?', ':']) { "" } else { "." };
    format!("{first}{}{stop}", chars.as_str())
}

/// The colour of a verdict.
pub(super) fn tone(word: Word) -> Tone {
    match word {
        Word::NothingMissing => Tone::Good,
        Word::Parameters => Tone::Limited,
        Word::Missing => Tone::Warning,
        Word::Ambiguous | Word::CannotTell => Tone::Unsure,
        Word::Unexplained => Tone::Bad,
    }
}
