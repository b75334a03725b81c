//! What remains beside what was found: a statement of its own, for a claim is not taken back by it and does not hide it.

use super::signals::place_in_signals;
use super::{LEFT_OVER, findings};
use crate::problem::Problem;
use crate::search::{Candidate, Search};
use crate::words;
use backdrive_plant::write::round_significant;
use serde_json::{Value as Json, json};

/// What the explanation that is claimed leaves over: how much of the residual of the refitted nominal model on recordings that no fit has seen
/// (`share`), what of that the sensors' noise would be (`floor_share`), in standard deviations of that noise on the fitted recordings
/// (`noise_sd`), where it shows and what it looks like. `Null` where nothing was held against anything.
pub(super) fn remaining(problem: &Problem, search: &Search, best: &Candidate, held_out: &Json) -> Json {
    let of = |key: &str| held_out[key].as_f64();
    let (Some(refit), Some(after), Some(floor)) = (of("nrmse_refit"), of("nrmse_after"), of("noise_floor")) else { return Json::Null };
    let share = |x: f64| if refit > 0.0 { json!(round_significant(x / refit, 3)) } else { Json::Null };
    let level = best.levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let left = level >= LEFT_OVER;
    json!({
        "share": share(after),
        "floor_share": share(floor),
        "noise_sd": round_significant(level, 3),
        "where": if left { place_in_signals(problem, &best.fit.residuals, &[]) } else { Json::Null },
        "looks_like": if left { json!(looks_like(search, best)) } else { Json::Null },
    })
}

/// In words, the effect that would take most of what remains, of those that were tried beside the ones that are claimed; `None` where none was.
fn looks_like(search: &Search, best: &Candidate) -> Option<String> {
    let own: Vec<&str> = best.structure.added.iter().map(|h| h.id.as_str()).collect();
    let more = |c: &&Candidate| {
        c.structure.added.len() == own.len() + 1
            && own.iter().all(|id| c.structure.added.iter().any(|h| h.id == *id))
            && c.fit.cost < best.fit.cost
    };
    let next = search.found.iter().filter(more).min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))?;
    let effect = next.structure.added.iter().find(|h| !own.contains(&h.id.as_str()))?;
    let mut named = findings::place(&effect.place);
    named["physics"] = json!(effect.physics.name);
    Some(format!("{} {}", words::physics(effect.physics.name), words::place(&named)))
}
