//! Verdicts and numbers in words.

use backdrive_report::{Cell, Tone, number};
use backdrive_stability::energy::EnergyVerdict;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::verdict::Word;

pub(super) fn word(outcome: &Outcome) -> Word {
    Word::of(outcome)
}

pub(super) fn tone(word: Word) -> Tone {
    match word {
        Word::Stable => Tone::Good,
        Word::LimitCycle => Tone::Warning,
        Word::Unstable => Tone::Bad,
        Word::Limited => Tone::Limited,
        Word::CannotTell => Tone::Unsure,
    }
}

pub(super) fn text(word: Word) -> &'static str {
    match word {
        Word::Stable => "stable",
        Word::LimitCycle => "limit cycle",
        Word::Unstable => "unstable",
        Word::Limited => "limited",
        Word::CannotTell => "cannot tell",
    }
}

pub(super) fn verdict(word: Word) -> Cell {
    Cell::tone(text(word), tone(word))
}

pub(super) fn energy_verdict(verdict: EnergyVerdict) -> (&'static str, Tone) {
    match verdict {
        EnergyVerdict::Passive => ("passive", Tone::Good),
        EnergyVerdict::Active => ("active", Tone::Warning),
        EnergyVerdict::CannotTell => ("cannot tell", Tone::Unsure),
    }
}

pub(super) fn interval((low, high): (f64, Option<f64>)) -> String {
    match high {
        Some(high) => format!("{} to {}", number(low), number(high)),
        None => format!("{} or more", number(low)),
    }
}
