//! Phrases that every part of the page uses in the same way.

use backdrive_diagnosis::output_error::candidate::Candidate;
use backdrive_diagnosis::verdict::Word;
use backdrive_report::Tone;

/// Whether a candidate adds any effect.
pub(super) fn adds(candidate: &Candidate) -> bool {
    !candidate.structure.added.is_empty()
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
