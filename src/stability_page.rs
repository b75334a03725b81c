//! The report of `backdrive stability`.

use crate::stability::Point;
use backdrive_report::{Page, Tone};
use backdrive_stability::session::Session;
use backdrive_stability::verdict::{Answer, Word};

/// The report of an answer.
pub fn page(found: &Answer, _session: &Session, _curve: &[&Point]) -> Page {
    let mut page = Page::new(&format!("Stability of {}", found.bag));
    let tone = match found.verdict {
        Word::Stable => Tone::Good,
        Word::CannotTell => Tone::Unsure,
        _ => Tone::Bad,
    };
    page.lead(tone, &found.reason);
    page
}
