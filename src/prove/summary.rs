//! Over all cases: shares of what was found, what was taken for what, and what the found models are worth.

use super::case::{Case, SHOWS};
use super::score::Mark;
use serde::Serialize;
use std::collections::BTreeMap;

/// A share as counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Share {
    /// How many are.
    pub are: usize,
    /// Of how many.
    pub of: usize,
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.are, self.of)
    }
}

/// How many effects were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Found {
    /// At their place.
    pub place: Share,
    /// By their family there.
    pub family: Share,
    /// Exactly.
    pub exact: Share,
}

impl Found {
    fn of<'a>(cases: impl Iterator<Item = &'a Case>) -> Found {
        let marks: Vec<&Mark> = cases.flat_map(|c| &c.marks).collect();
        let share = |is: &dyn Fn(&Mark) -> bool| Share { are: marks.iter().filter(|m| is(m)).count(), of: marks.len() };
        Found { place: share(&|m| m.place), family: share(&|m| m.family), exact: share(&|m| m.exact) }
    }
}

impl std::fmt::Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "place {}, family {}, exact {}", self.place, self.family, self.exact)
    }
}

/// What a canceller is worth at one grip, over several cases.
#[derive(Debug, Clone, Serialize)]
pub struct Worth {
    /// Factor on the grip of the session.
    pub grip: f64,
    /// Median of the diagnosed canceller's stable gain over that of the better linear one.
    pub diagnosed: Option<f64>,
    /// The same of the chosen canceller.
    pub chosen: Option<f64>,
    /// In how many cases the diagnosed canceller is below no canceller.
    pub diagnosed_below_none: Share,
    /// In how many cases the chosen one is.
    pub chosen_below_none: Share,
}

/// All cases in a few numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Of all effects.
    #[serde(flatten)]
    pub all: Found,
    /// Of those that show in recordings after the nominal model's numbers were fitted anew ([`Case::shows`]).
    pub showing: Found,
    /// Cases that conceal nothing and in which something was named.
    pub false_alarms: Share,
    /// Runs of the live graph about the edges that did what these say.
    pub live: Share,
    /// What was concealed, what was said first, how often. `nothing` stands for no effect and no finding.
    pub confusion: Vec<(String, String, usize)>,
    /// Cases that conceal something nonlinear: worth by grip.
    pub nonlinear: Vec<Worth>,
    /// The others.
    pub linear: Vec<Worth>,
}

impl Summary {
    /// Of cases.
    pub fn of(cases: &[Case]) -> Summary {
        let nulls: Vec<&Case> = cases.iter().filter(|c| c.marks.is_empty()).collect();
        let alarms = nulls.iter().filter(|c| !c.findings.is_empty()).count();
        let with = |nonlinear: bool| cases.iter().filter(|c| !c.marks.is_empty() && c.nonlinear == nonlinear).collect::<Vec<_>>();
        Summary {
            all: Found::of(cases.iter()),
            showing: Found::of(cases.iter().filter(|c| c.shows())),
            false_alarms: Share { are: alarms, of: nulls.len() },
            live: {
                let runs = || cases.iter().flat_map(|c| &c.live);
                Share { are: runs().filter(|run| run.agrees()).count(), of: runs().count() }
            },
            confusion: confusion(cases),
            nonlinear: worths(&with(true)),
            linear: worths(&with(false)),
        }
    }

    /// A few lines for a person.
    pub fn text(&self) -> String {
        let mut text = format!("{}; false alarms {}", self.all, self.false_alarms);
        text += &format!("\nof effects {SHOWS} noise floors and more from the refitted nominal model: {}", self.showing);
        if self.live.of > 0 {
            text += &format!("\nthe live graph agreed in {} runs", self.live);
        }
        for (name, worths) in [("nonlinear", &self.nonlinear), ("linear", &self.linear)] {
            for worth in worths {
                let of = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.1}"));
                text += &format!(
                    "\n{name} effects, grip x{:.2}: stable gain over the better linear canceller, median: diagnosed {}, chosen {}; below no canceller: diagnosed {}, chosen {}",
                    worth.grip,
                    of(worth.diagnosed),
                    of(worth.chosen),
                    worth.diagnosed_below_none,
                    worth.chosen_below_none
                );
            }
        }
        text
    }
}

fn confusion(cases: &[Case]) -> Vec<(String, String, usize)> {
    let mut counts: BTreeMap<(String, String), usize> = BTreeMap::new();
    let kind = |name: &str| name.split(' ').next().unwrap_or_default().to_string();
    for case in cases {
        let first = case.findings.first().map_or(case.word.name().to_string(), |f| f.physics.clone());
        let none = vec!["nothing".to_string()];
        for concealed in if case.concealed.is_empty() { &none } else { &case.concealed } {
            // With several effects that finding counts which has the effect's own name, if one has.
            let own = case.findings.iter().find(|f| f.physics == kind(concealed)).map(|f| f.physics.clone());
            *counts.entry((kind(concealed), own.unwrap_or_else(|| first.clone()))).or_default() += 1;
        }
    }
    counts.into_iter().map(|((concealed, said), count)| (concealed, said, count)).collect()
}

fn worths(cases: &[&Case]) -> Vec<Worth> {
    let grips = cases.first().map_or_else(Vec::new, |c| c.grips());
    let one = |grip: f64| {
        let below = |canceller: &str| {
            let both = cases.iter().filter_map(|c| Some((c.gain(canceller, grip)?, c.gain("none", grip)?)));
            // Both edges are known to 3 per cent only.
            let (are, of) = both.fold((0, 0), |(are, of), (with, none)| (are + usize::from(with < 0.94 * none), of + 1));
            Share { are, of }
        };
        Worth {
            grip,
            diagnosed: median(cases.iter().filter_map(|c| c.ratio("diagnosed", grip)).collect()),
            chosen: median(cases.iter().filter_map(|c| c.ratio("chosen", grip)).collect()),
            diagnosed_below_none: below("diagnosed"),
            chosen_below_none: below("chosen"),
        }
    };
    let mut all: Vec<Worth> = grips.into_iter().map(one).collect();
    all.sort_by(|a, b| a.grip.total_cmp(&b.grip));
    all
}

/// The middle one; of an even number the mean of the middle two.
pub fn median(mut of: Vec<f64>) -> Option<f64> {
    of.sort_by(f64::total_cmp);
    let n = of.len();
    (n > 0).then(|| 0.5 * (of[(n - 1) / 2] + of[n / 2]))
}
