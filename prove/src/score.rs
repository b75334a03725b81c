//! What was found against what was concealed. Nothing here is read before the verdict is written.

use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::verdict::{Verdict, Word};
use backdrive_sealed::effects::{Effect, Site};
use backdrive_sealed::truth::Truth;
use serde::Serialize;

/// A finding of a verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the effect.
    pub physics: String,
    /// Bodies, or a signal.
    pub place: Vec<String>,
    /// 0 to 1.
    pub confidence: f64,
}

/// How right a verdict is about an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Mark {
    /// A finding sits where the effect does.
    pub place: bool,
    /// One there is of its family.
    pub family: bool,
    /// One there is the effect itself.
    pub exact: bool,
}

/// The findings of a verdict.
pub fn findings(verdict: &Verdict) -> Vec<Finding> {
    let one = |f: &backdrive_diagnosis::verdict::Finding| Finding {
        physics: f.physics.clone(),
        place: match &f.place {
            Place::Between(a, b) => vec![a.clone(), b.clone()],
            Place::Signal(name) => vec![name.clone()],
        },
        confidence: f.confidence,
    };
    verdict.findings.iter().map(one).collect()
}

fn sits_at(finding: &Finding, site: &Site) -> bool {
    // The model that is diagnosed has the grip's name before its bodies' names: `normal.hand`.
    let same = |found: &str, name: &str| found == name || found.strip_suffix(name).is_some_and(|before| before.ends_with('.'));
    match (&finding.place[..], site) {
        ([one, other], Site::Between([a, b])) => (same(one, a) && same(other, b)) || (same(one, b) && same(other, a)),
        ([one], Site::Signal(name)) => one == name,
        _ => false,
    }
}

/// How a case was handed over.
#[derive(Debug, Clone, Copy)]
pub struct Handed {
    /// Whether nobody measured the hand.
    pub hand_hidden: bool,
    /// Whether the nominal parameters had been refitted before.
    pub refitted: bool,
}

/// Marks a verdict's findings for an effect. Where it can only be distinguished by the model's parameters, or by what an unmeasured hand may do, the right
/// verdict names nothing. Where those parameters were refitted before, they may be right already.
pub fn mark(effect: &Effect, word: Word, findings: &[Finding], handed: Handed) -> Mark {
    let possible = || effect.accept.iter().filter(|answer| handed.hand_hidden || !answer.hand_hidden);
    let says = |name: &str| name == word.name() || handed.refitted && name == Word::Parameters.name() && word == Word::NothingMissing;
    if findings.is_empty() && possible().any(|answer| answer.physics.iter().any(|name| says(name))) {
        return Mark { place: true, family: true, exact: true };
    }
    let right = |f: &Finding| {
        possible().any(|answer| {
            let beside = |name: &String| findings.iter().any(|other| other.physics == *name && sits_at(other, &answer.site));
            sits_at(f, &answer.site) && answer.physics.contains(&f.physics) && answer.together_with.iter().all(beside)
        })
    };
    let exact = findings.iter().any(right);
    let there: Vec<&Finding> = findings.iter().filter(|f| sits_at(f, &effect.site) || possible().any(|a| sits_at(f, &a.site))).collect();
    Mark { place: exact || !there.is_empty(), family: exact || there.iter().any(|f| effect.family.contains(&f.physics)), exact }
}

/// The effect in words: `stribeck drum-ground`.
pub fn name_of(effect: &Effect) -> String {
    let place = match &effect.site {
        Site::Between(ends) => ends.join("-"),
        Site::Signal(name) => name.clone(),
    };
    format!("{} {place}", effect.physics.name())
}

/// Whether any concealed effect is nonlinear.
pub fn is_nonlinear(truth: &Truth) -> bool {
    truth.effects.iter().any(|e| e.nonlinear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_number_can_be_is_no_finding_and_after_a_refit_not_even_a_number() {
        let truth = r#"{ "physics": "inertia", "parameters": { "inertia": 0.1 }, "between": ["drum", "ground"], "replaces": [], "family": ["inertia"],
            "nonlinear": false, "in_formats": true, "accept": [{ "between": ["drum", "ground"], "physics": ["inertia", "parameters"] }] }"#;
        let effect: Effect = serde_json::from_str(truth).unwrap();
        let right = |word: Word, refitted: bool| mark(&effect, word, &[], Handed { hand_hidden: false, refitted }).exact;
        assert!(right(Word::Parameters, false) && right(Word::Parameters, true));
        assert!(!right(Word::NothingMissing, false) && right(Word::NothingMissing, true));
        assert!(!right(Word::Unexplained, true));
    }

    #[test]
    fn what_only_a_hidden_hand_makes_the_same_is_wrong_where_the_hand_is_known() {
        let truth = r#"{ "physics": "bias", "parameters": { "force": 0.1 }, "between": ["drum", "ground"], "replaces": [], "family": ["bias"],
            "nonlinear": false, "in_formats": true, "accept": [{ "between": ["drum", "ground"], "physics": ["bias"] },
            { "between": ["drum", "handle"], "physics": ["bias"], "hand_hidden": true }] }"#;
        let effect: Effect = serde_json::from_str(truth).unwrap();
        let found = Finding { physics: "bias".to_string(), place: vec!["drum".to_string(), "handle".to_string()], confidence: 1.0 };
        let marked =
            |hand_hidden: bool| mark(&effect, Word::Missing, std::slice::from_ref(&found), Handed { hand_hidden, refitted: false });
        assert!(marked(true).exact && marked(true).place);
        assert!(!marked(false).exact && !marked(false).place && !marked(false).family);
    }

    #[test]
    fn a_finding_sits_where_the_effect_does_whatever_the_grip_is_called() {
        let found =
            |place: &[&str]| Finding { physics: "bias".to_string(), place: place.iter().map(|p| p.to_string()).collect(), confidence: 1.0 };
        let joint = Site::Between(["handle".to_string(), "hand".to_string()]);
        for place in [["handle", "hand"], ["hand", "handle"], ["handle", "normal.hand"]] {
            assert!(sits_at(&found(&place), &joint), "{place:?}");
        }
        for place in [["handle", "ground"], ["handle", "otherhand"], ["handle", "handle"]] {
            assert!(!sits_at(&found(&place), &joint), "{place:?}");
        }
        assert!(sits_at(&found(&["feedback_force"]), &Site::Signal("feedback_force".to_string())));
        assert!(!sits_at(&found(&["feedback_force"]), &joint));
    }
}
