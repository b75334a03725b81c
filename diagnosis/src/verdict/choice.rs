//! Which of the structures is claimed, and which cannot be told from it.

use crate::candidate::{Candidate, advantage_over};
use crate::hypothesis::{Hypothesis, Physics};
use crate::physics::{PHYSICS, withheld};
use crate::search::Search;
use crate::tuning::tuning;
use std::collections::HashSet;

/// Which of the structures is claimed.
pub fn chosen(search: &Search) -> &Candidate {
    let mut best = &search.nominal;
    for effects in 1..=search.found.iter().map(|c| c.structure.added.len()).max().unwrap_or(0) {
        let next = search.found.iter().filter(|c| c.structure.added.len() == effects).min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let Some(next) = next else { continue };
        let next = search
            .found
            .iter()
            .filter(|c| c.structure.added.len() == effects)
            .fold(next, |best, c| if evidence(search, best, c) > 0.0 { c } else { best });
        // Ties go to the fewest parameters, then to the physics that is named first.
        let simplest = search
            .found
            .iter()
            .filter(|c| c.structure.added.len() == effects && evidence(search, c, next) < tuning().claim.alike)
            .min_by_key(|c| (c.structure.free.len(), c.structure.added.iter().map(order).sum::<usize>()))
            .unwrap_or(next);
        if worth(search, best, simplest) {
            best = simplest;
        }
    }
    best
}

fn order(h: &Hypothesis) -> usize {
    PHYSICS.iter().position(|p| *p == h.physics).unwrap_or(usize::MAX)
}

/// What the fits and the held-out recordings say for a candidate against another one, as a difference of information
/// criteria with effective samples.
pub(super) fn evidence(search: &Search, base: &Candidate, better: &Candidate) -> f64 {
    advantage_over(base, better, search.samples) + unseen_evidence(search, base, better)
}

/// What the held-out recordings say alone; 0 where there are none.
pub(super) fn unseen_evidence(search: &Search, base: &Candidate, better: &Candidate) -> f64 {
    match (base.unseen, better.unseen) {
        (Some(a), Some(b)) if a.mean_square > 0.0 && b.mean_square > 0.0 => {
            (search.unseen_samples as f64 / a.correlation_time.max(b.correlation_time)) * (a.mean_square / b.mean_square).ln()
        }
        _ => 0.0,
    }
}

fn worth(search: &Search, base: &Candidate, better: &Candidate) -> bool {
    // Held-out recordings must not speak against it: a law that is there is there in every recording, if not always to be seen.
    let seen_again = match (base.unseen, better.unseen) {
        (Some(a), Some(b)) => b.mean_square < a.mean_square * tuning().claim.unseen,
        _ => true,
    };
    evidence(search, base, better) > tuning().claim.least_advantage
        && better.fit.cost < (1.0 - tuning().claim.least_share) * base.fit.cost
        && seen_again
}

/// Structures of as many effects that cannot be told from the best: another place, or a law that is no richer form of its own.
pub(super) fn alike<'s>(search: &'s Search, best: &Candidate) -> Vec<&'s Candidate> {
    let ids = |c: &Candidate| c.structure.added.iter().map(|h| h.id.clone()).collect::<HashSet<String>>();
    let own = ids(best);
    let differs = |c: &Candidate| {
        let other: Vec<&Hypothesis> = c.structure.added.iter().filter(|h| !own.contains(&h.id)).collect();
        let mine: Vec<&Hypothesis> = best.structure.added.iter().filter(|h| !ids(c).contains(&h.id)).collect();
        match (other.as_slice(), mine.as_slice()) {
            ([rival], [own]) => !(rival.place.same(&own.place) && contains(rival.physics, own)) && rival.class != own.class,
            ([], _) => false,
            _ => true,
        }
    };
    let mut seen = HashSet::new();
    let close = |c: &&Candidate| {
        c.structure.added.len() == best.structure.added.len() && evidence(search, c, best) < tuning().claim.alike && differs(c)
    };
    search.found.iter().filter(close).filter(|c| seen.insert(c.structure.name())).take(tuning().claim.rivals).collect()
}

/// The structures of as many effects that come nearest to the best, at most two.
pub(super) fn nearest<'s>(search: &'s Search, best: &Candidate) -> Vec<&'s Candidate> {
    let name = best.structure.name();
    let mut rivals: Vec<&Candidate> =
        search.found.iter().filter(|c| c.structure.added.len() == best.structure.added.len() && c.structure.name() != name).collect();
    rivals.sort_by(|a, b| evidence(search, a, best).total_cmp(&evidence(search, b, best)));
    rivals.truncate(2);
    rivals
}

/// Whether a physics has another one, or one of its family at the same place, as a special or limiting case.
pub(super) fn contains(rich: &Physics, own: &Hypothesis) -> bool {
    withheld(&[own.physics.name]).contains(&rich.name) || rich.family == own.physics.family
}
