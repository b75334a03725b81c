//! Over all cases: shares of what was found, what was taken for what, and what the found models are worth.

use super::case::{Case, KINDS, SHOWS};
use super::score::Mark;
use super::statistics::Share;
use super::worth::Group;
use serde::Serialize;
use std::collections::BTreeMap;

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

/// All cases in a few numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Of all effects.
    #[serde(flatten)]
    pub all: Found,
    /// Of those that show in recordings after the nominal model's parameters were refitted ([`Case::shows`]).
    pub showing: Found,
    /// Cases that conceal nothing and in which something was named.
    pub false_alarms: Share,
    /// Runs of the live graph about the critical gains whose outcome agreed with these.
    pub live: Share,
    /// What was concealed, what was said first, how often. `nothing` stands for no effect and no finding.
    pub confusion: Vec<(String, String, usize)>,
    /// What cancellers are worth, by what is concealed: each kind of effect, then all that is nonlinear and all that is linear.
    pub worth: Vec<Group>,
}

impl Summary {
    /// Of cases.
    pub fn of(cases: &[Case]) -> Summary {
        let nulls: Vec<&Case> = cases.iter().filter(|c| c.marks.is_empty()).collect();
        let alarms = nulls.iter().filter(|c| !c.findings.is_empty()).count();
        let with = |nonlinear: bool| cases.iter().filter(|c| !c.marks.is_empty() && c.nonlinear == nonlinear).collect::<Vec<_>>();
        let of_kind = |kind: &str| cases.iter().filter(|c| c.kind() == Some(kind)).collect::<Vec<_>>();
        let of_kinds = KINDS.iter().map(|(kind, _)| (*kind, of_kind(kind)));
        Summary {
            all: Found::of(cases.iter()),
            showing: Found::of(cases.iter().filter(|c| c.shows())),
            false_alarms: Share { are: alarms, of: nulls.len() },
            live: {
                let runs = || cases.iter().flat_map(|c| &c.live);
                Share { are: runs().filter(|run| run.agrees()).count(), of: runs().count() }
            },
            confusion: confusion(cases),
            worth: of_kinds
                .chain([("nonlinear effects", with(true)), ("linear effects", with(false))])
                .filter_map(|(kind, cases)| Group::of(kind, &cases))
                .collect(),
        }
    }

    /// A few lines for a person.
    pub fn text(&self) -> String {
        let mut text = format!("{}; false alarms {}", self.all, self.false_alarms);
        text += &format!("\nof visible effects (at least {SHOWS} sd of the noise after a refit of the nominal model): {}", self.showing);
        if self.live.of > 0 {
            text += &format!("\nthe live graph agreed in {} runs", self.live);
        }
        self.worth.iter().for_each(|group| text += &group.text());
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
