//! Where the refitted nominal model and the recordings part: when, at which frequencies, and in which state of the device.

use super::signals::place_in_signals;
use super::types::{Finding, Where, Word};
use crate::belief::decision::Decision;
use crate::locate::{self, Location};
use crate::physics::physics_named;
use crate::recordings::problem::Problem;
use crate::search::Search;

/// Where the refitted nominal model and the recordings part.
pub(super) fn shows(problem: &Problem, search: &Search, decision: &Decision, location: Option<&Location>) -> Option<Where> {
    let mut shows = place_in_signals(problem, &search.nominal.fit.residuals, &decision.bursts)?;
    shows.state = state(decision.word, &decision.findings, location);
    if decision.word == Word::Unexplained {
        // What kind of force it is, where no law is its name.
        shows.class = location.and_then(|l| l.ranking.first()).map(|best| best.character);
    }
    Some(shows)
}

/// In which state the mismatch shows: as the law that is claimed has it, else as the latent force does.
fn state(word: Word, findings: &[Finding], location: Option<&Location>) -> Option<String> {
    match word {
        Word::Missing | Word::Ambiguous => {
            findings.first().and_then(|first| Some(physics_named(&first.physics)?.state_at(&first.place.to_string())))
        }
        Word::Unexplained => location.and_then(locate::state),
        Word::Parameters | Word::NothingMissing | Word::CannotTell => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypothesis::Place;
    use std::collections::BTreeMap;

    #[test]
    fn the_state_is_that_of_the_claimed_law() {
        let found = |physics: &str, place: Place| Finding {
            physics: physics.to_string(),
            place,
            parameters: BTreeMap::new(),
            replaces: Vec::new(),
            confidence: 0.9,
            family: None,
            family_confidence: 0.0,
            alternatives: Vec::new(),
            closed_loop: None,
        };
        let rubs = found("coulomb", Place::Between("drum".to_string(), "ground".to_string()));
        assert_eq!(state(Word::Missing, &[rubs], None).as_deref(), Some("reversals of the velocity across drum-ground"));
        let late = found("delay", Place::Signal("force".to_string()));
        assert_eq!(state(Word::Missing, &[late], None).as_deref(), Some("with the rate of change of force"));
        assert_eq!(state(Word::NothingMissing, &[], None), None);
    }
}
