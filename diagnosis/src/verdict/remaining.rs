//! What remains beside what was found: a statement of its own, for a claim is not taken back by it and does not hide it.

use super::rounded::rounded;
use super::signals::place_in_signals;
use super::types::{HeldOut, Remaining};
use crate::belief::decision::Decision;
use crate::output_error::candidate::Candidate;
use crate::recordings::problem::Problem;
use crate::search::Search;
use crate::verdict::words;

/// The residual of the claimed explanation; `None` where nothing was held against anything.
pub(super) fn remaining(problem: &Problem, search: &Search, decision: &Decision, held_out: &HeldOut) -> Option<Remaining> {
    let best = decision.best;
    let (refit, after, noise_sd) = (held_out.nrmse_refit?, held_out.nrmse_after?, held_out.noise_floor?);
    let share = |x: f64| if refit > 0.0 { rounded(x / refit, 3) } else { None };
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let left = !decision.at_floor;
    let largest = decision.floors.iter().fold(1.0f64, |a, b| a.max(*b));
    Some(Remaining {
        share: share(after),
        floor_share: share(noise_sd),
        noise_sd: rounded(level, 3),
        not_repeated: if largest > 1.0 { rounded(largest, 3) } else { None },
        shows: if left { place_in_signals(problem, &best.fit.residuals, &[]) } else { None },
        looks_like: if left { looks_like(search, best) } else { None },
    })
}

/// In words, the effect that would take most of what remains, of those that were tried beside the ones that are claimed; `None` where none was.
fn looks_like(search: &Search, best: &Candidate) -> Option<String> {
    let next = next_effect(search, best)?;
    let effect = next.structure.added.iter().find(|h| best.structure.added.iter().all(|own| own.id != h.id))?;
    Some(words::named(effect.physics.name, &effect.place))
}

/// The structure with one effect more that leaves least; `None` where none was fitted.
pub(super) fn next_effect<'s>(search: &'s Search, best: &Candidate) -> Option<&'s Candidate> {
    let own: Vec<&str> = best.structure.added.iter().map(|h| h.id.as_str()).collect();
    let more = |c: &&Candidate| {
        c.structure.added.len() == own.len() + 1
            && own.iter().all(|id| c.structure.added.iter().any(|h| h.id == *id))
            && c.fit.cost < best.fit.cost
    };
    search.found.iter().filter(more).min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
}
