//! What a proof comes to: the least favourable of what was named, of each canceller against none with every hand, and of the live runs.

use super::case::Case;
use super::chosen::AS_GOOD;
use super::gain::Hand;
use super::live::LiveRun;
use super::worth::DIAGNOSED;
use backdrive_report::{Tone, number};
use serde::Serialize;

/// A canceller of the diagnosis that is worse than none with one hand.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Worse {
    /// The case.
    pub case: String,
    /// The canceller.
    pub canceller: &'static str,
    /// The hand.
    #[serde(rename = "grip")]
    pub hand: Hand,
    /// Highest stable mu*lambda with it.
    pub with: f64,
    /// The same without a canceller.
    pub none: f64,
}

/// A live run whose outcome differs from the prediction of the stability limit.
#[derive(Debug, Clone, Serialize)]
pub struct Otherwise {
    /// The case.
    pub case: String,
    /// The run.
    #[serde(flatten)]
    pub run: LiveRun,
}

/// What a proof comes to.
#[derive(Debug, Clone, Serialize)]
pub struct Headline {
    /// Whether all of it is favourable.
    pub favourable: bool,
    /// Cases whose effects were not all named by family and place, or in which something was named that is not there.
    pub misnamed: Vec<String>,
    /// Cancellers of the diagnosis that are worse than none, the worst first.
    pub worse: Vec<Worse>,
    /// How many were compared.
    pub compared: usize,
    /// Live runs that did something else than the limits say; those that should have been stable first.
    pub otherwise: Vec<Otherwise>,
    /// How many there were.
    pub live: usize,
}

impl Headline {
    /// Of cases.
    pub fn of<'a>(cases: impl IntoIterator<Item = &'a Case>) -> Headline {
        let mut headline =
            Headline { favourable: true, misnamed: Vec::new(), worse: Vec::new(), compared: 0, otherwise: Vec::new(), live: 0 };
        for case in cases {
            if !case.is_right() {
                headline.misnamed.push(case.name.clone());
            }
            for (canceller, hand) in DIAGNOSED.iter().flat_map(|c| case.hands().into_iter().map(move |hand| (*c, hand))) {
                let Some((with, none)) = case.gain(canceller, hand).zip(case.gain("none", hand)) else { continue };
                headline.compared += 1;
                if with < AS_GOOD * none {
                    headline.worse.push(Worse { case: case.name.clone(), canceller, hand, with, none });
                }
            }
            headline.live += case.live.len();
            let otherwise = case.live.iter().filter(|run| !run.agrees());
            headline.otherwise.extend(otherwise.map(|run| Otherwise { case: case.name.clone(), run: run.clone() }));
        }
        headline.worse.sort_by(|a, b| (a.with / a.none).total_cmp(&(b.with / b.none)));
        headline.otherwise.sort_by_key(|other| !other.run.below_edge);
        headline.favourable = headline.misnamed.is_empty() && headline.worse.is_empty() && headline.otherwise.is_empty();
        headline
    }

    /// The colour of the page: what would shake a user's hand is bad, a wrong name is a warning.
    pub fn tone(&self) -> Tone {
        let shakes = !self.worse.is_empty() || self.otherwise.iter().any(|other| other.run.below_edge);
        match (self.favourable, shakes) {
            (true, _) => Tone::Good,
            (false, true) => Tone::Bad,
            (false, false) => Tone::Warning,
        }
    }

    /// What is unfavourable, a sentence each, the worst of each kind named; what was not tried is said too.
    pub fn sentences(&self) -> Vec<String> {
        let mut all = Vec::new();
        if let Some(worst) = self.worse.first() {
            all.push(format!(
                "A canceller of the diagnosis is worse than none in {} of {} comparisons: the worst is \"{}\" with {}, stable up to {}; \
                    without a canceller {}.",
                self.worse.len(),
                self.compared,
                worst.canceller,
                worst.hand,
                number(worst.with),
                number(worst.none)
            ));
        }
        if let Some(first) = self.otherwise.first() {
            let should = if first.run.below_edge { "stable" } else { "not stable" };
            all.push(format!(
                "{} of {} live runs contradict the stability limits: with canceller \"{}\" at μλ = {} it should have been {should} and \
                    was {}.",
                self.otherwise.len(),
                self.live,
                first.run.canceller,
                number(first.run.gain),
                first.run.outcome.replace('_', " ")
            ));
        }
        if !self.misnamed.is_empty() {
            all.push(format!("The concealed effects were not named correctly in {}.", self.misnamed.join(", ")));
        }
        if self.compared == 0 {
            all.push("The effect of the diagnosis on the loop was not measured.".to_string());
        } else if self.worse.is_empty() {
            all.push(format!("No canceller of the diagnosis is worse than none ({} comparisons).", self.compared));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::super::gain::Gain;
    use super::*;
    use backdrive_diagnosis::verdict::Word;

    fn case() -> Case {
        Case {
            name: "case-001".to_string(),
            shows_hand: true,
            refitted: false,
            sealed: String::new(),
            word: Word::NothingMissing,
            sentence: String::new(),
            findings: Vec::new(),
            concealed: Vec::new(),
            marks: Vec::new(),
            nonlinear: false,
            held_out: [None; 3],
            refit_floors: None,
            gains: Vec::new(),
            recovery_s: None,
            live: Vec::new(),
            share: None,
        }
    }

    fn gain(canceller: &'static str, hand: Hand, stable_to: f64) -> Gain {
        Gain { canceller, hand, stable_to, because: String::new(), whole_range: false }
    }

    fn run(below_edge: bool, outcome: &str) -> LiveRun {
        LiveRun { canceller: "diagnosed", gain: 2.0, below_edge, outcome: outcome.to_string() }
    }

    #[test]
    fn the_headline_is_the_least_favourable_of_all() {
        let firm = Hand::Grip(1.4);
        let mut named = case();
        named.gains = vec![
            gain("none", Hand::SESSION, 2.1),
            gain("diagnosed", Hand::SESSION, 50.0),
            gain("none", firm, 2.55),
            gain("diagnosed", firm, 2.6),
        ];
        named.live = vec![run(true, "stable"), run(false, "limit_cycle")];
        let of = |case: &Case| Headline::of([case]);
        assert!(named.is_right() && of(&named).favourable && of(&named).tone() == Tone::Good, "{:?}", of(&named));
        // The page that was green: right in its names, with a canceller that a firmer hand makes worse than none.
        let mut worse = named.clone();
        worse.gains[3].stable_to = 0.74;
        let headline = of(&worse);
        assert!(worse.is_right() && !headline.favourable && headline.tone() == Tone::Bad);
        let said = headline.sentences().join(" ");
        assert!(said.contains("grip x1.4") && said.contains("0.740") && said.contains("2.55"), "{said}");
        // A live run that should have been stable.
        let mut shaken = named.clone();
        shaken.live[0] = run(true, "limit_cycle");
        assert!(!of(&shaken).favourable && of(&shaken).tone() == Tone::Bad && of(&shaken).sentences()[0].contains("was limit cycle"));
        let mut calm = named.clone();
        calm.live[1] = run(false, "stable");
        assert!(!of(&calm).favourable && of(&calm).tone() == Tone::Warning);
        // Nothing was tried: that is said.
        let mut untried = named.clone();
        (untried.gains, untried.live) = (Vec::new(), Vec::new());
        assert!(of(&untried).sentences().iter().any(|s| s.contains("was not measured")));
    }
}
