//! The search: what has to be added to the nominal model, one effect after the other, each judged by held-out segments of the logs.

use crate::arms::consistent::consistent;
use crate::arms::error::ArmError;
use crate::arms::fit::{Fit, Structure, Weights};
use crate::arms::joint_by_joint::joint_by_joint;
use crate::arms::local::{JointFound, Local};
use crate::arms::offers::{is_possible, load_spread, ranked, shaped, slipped, tolerated, torque_share, with, without, without_term};
use crate::arms::one_load::under_one_load;
use crate::arms::physics::{At, Physics, Term, candidates};
use crate::arms::regression::Data;
use crate::arms::remaining_residual::{Left, left};
use crate::arms::weighing::{
    LEAST_SHARE, LEAST_TORQUE, LOAD_CHANGES, added, compare, first_weights, is_local, largest_share, may_be, rare,
};
use crate::belief::predictive::Gain;
use crate::output_error::work::Limit;

/// Effects that are added at most, without those that every joint has.
pub const MOST: usize = 8;
/// Candidates that are fitted in full in each round, those that promise most.
const FITTED: usize = 10;
/// The same for effects that inertial parameters can compensate, where they are free.
const FITTED_BESIDE: usize = 3;
/// Which of [`TOLERANCES`] is that of a file that somebody made with care.
const STATED: usize = 1;
/// By how much the information criterion has to fall for an effect to be added. A Bayes factor of 150 ("very strong", Kass & Raftery 1995) is 10.
const WORTH: f64 = 10.0;

/// A candidate that was fitted in full.
#[derive(Debug, Clone)]
pub struct Tried {
    /// What it was.
    pub term: Term,
    /// By how much it lowered the information criterion.
    pub worth: f64,
    /// How much better it predicts what its fit has not seen.
    pub gain: Option<Gain>,
    /// Whether it was taken up in that round.
    pub taken: bool,
}

/// What a search found.
pub struct Search {
    /// The nominal model's terms with the file's inertial parameters.
    pub as_given: Fit,
    /// The nominal model's terms, numbers refitted.
    pub refit: Fit,
    /// The structure that was found.
    pub best: Fit,
    /// Weights of the last fits.
    pub weights: Weights,
    /// What was tried, in order.
    pub tried: Vec<Tried>,
    /// For each added term of the best structure: how much better the model with it predicts held-out segments than one without it.
    pub gains: Vec<Option<Gain>>,
    /// Of each added term: what could stand in its place, with the score of that structure above the best one's.
    pub rivals: Vec<Vec<Rival>>,
    /// For each added term that inertial parameters could compensate: the score, above the best one's, of the structure without it and with its bodies as free
    /// as is worth it.
    pub freed: Vec<Option<f64>>,
    /// Of each added term: whether it is a torque constant that these logs do not separate from other bodies.
    pub like_bodies: Vec<bool>,
    /// Joints at which the logs do not distinguish load-dependent friction from friction of one level, or whose load hardly changes with its bodies.
    pub under_one_load: Vec<usize>,
    /// By joint: the laws of its own torque, and how sure each is.
    pub locals: Vec<JointFound>,
}

impl Search {
    /// What is known of a term that is a law of a joint's own torque, or part of one.
    pub(crate) fn local(&self, term: &Term) -> Option<&Local> {
        let found = self.locals.get(term.at.joint()?)?;
        let is_named = |local: &&Local| local.terms.last().is_some_and(|own| own.is_like(term));
        let is_part = |local: &&Local| local.terms.iter().any(|own| own.is_like(term));
        found.chosen.iter().find(is_named).or_else(|| found.chosen.iter().find(is_part))
    }
}

/// Another structure, with a term instead of one that was found.
#[derive(Debug, Clone)]
pub struct Rival {
    /// The term.
    pub term: Term,
    /// Score above that of the best structure.
    pub above: f64,
    /// All of it.
    pub structure: Structure,
}

/// Looks for what is missing. `without`: names of effects that are not considered; `most`: effects that are added at most; `limit`: what
/// ends the search from outside, with what was found until then.
///
/// Where a joint has no motor and much of the torque of one with a motor remains, the bodies stay those of the file. The residual of a missing law does not
/// measure a mass, and the friction of a joint without a motor is known only in the size of its inertia.
///
/// # Errors
/// Where a fit cannot be computed at all.
pub fn search(data: &mut Data, without: &[String], most: usize, limit: Limit) -> Result<Search, ArmError> {
    let found = search_within(data, without, most, limit)?;
    if !(0..data.problem.joints.len()).any(|j| data.is_passive(j)) || found.best.structure.tolerance == 0 {
        return Ok(found);
    }
    // Bodies that no body can be explain any torque.
    let Some(bodies) = consistent(data, &found.best, &found.weights) else { return Ok(found) };
    let remains = |(j, left): (usize, &Left)| !data.is_passive(j) && left.shows.is_some();
    if !left(data, &bodies).iter().enumerate().any(remains) {
        return Ok(found);
    }
    data.most_tolerance = 0;
    data.see(&data.problem.bodies.nominal)?;
    search_within(data, without, most, limit)
}

/// First by the evidence of all joints together, with the bodies near the file's. Then, beside what several joints show, the laws of each joint's own
/// torque are compared by left-out stretches in several bands: those hold where what no law explains is larger than the sensors' noise, and not white.
fn search_within(data: &mut Data, without: &[String], most: usize, limit: Limit) -> Result<Search, ArmError> {
    let failed = || ArmError::Robot("the regression has no solution; are all joints logged in motion?".to_string());
    let pool = pool(data, without);
    let nominal = data.nominal_structure();
    let mut weights = first_weights(data, &nominal).ok_or_else(failed)?;
    let mut tried = Vec::new();
    let mut best = data.fit(&nominal, &weights).ok_or_else(failed)?;
    // Twice: what was found is the better view of what the joints pass on, and of how much their residuals scatter.
    for round in 0..2 {
        best = data.fit(&Structure { ..best.structure.clone() }, &weights).ok_or_else(failed)?;
        best = slipped(data, best, &weights);
        grow(data, &pool, most, &mut best, &weights, &mut tried, limit);
        if round == 0 {
            let bodies = consistent(data, &best, &weights).ok_or_else(failed)?;
            data.see(&data.parameters(&bodies))?;
            best = data.fit(&best.structure, &weights).ok_or_else(failed)?;
            weights = data.weights(&best.residual);
        }
    }
    best = data.fit(&best.structure, &weights).ok_or_else(failed)?;
    shrink(data, &mut best, &weights, &|_| false);
    let locals = joint_by_joint(data, &pool, most, &mut best, &weights, limit)?;
    shrink(data, &mut best, &weights, &|term| is_local(data, term) && !shows_elsewhere(term));
    // What a factor of the torque is a factor of, and what friction grows with, is what these bodies take.
    for _ in 0..2 {
        let bodies = consistent(data, &best, &weights).ok_or_else(failed)?;
        data.see(&data.parameters(&bodies))?;
        best = data.fit(&best.structure, &weights).ok_or_else(failed)?;
    }
    let refit = refitted(data, &nominal, &best.structure.slip, &weights).ok_or_else(failed)?;
    let as_given = data.fit(&Structure { slip: best.structure.slip.clone(), ..nominal }, &weights).ok_or_else(failed)?;
    let added: Vec<usize> = added(&best.structure);
    let gains =
        added.iter().map(|i| without_term(data, &best, *i, &weights).and_then(|less| compare(data, &less, &best, &weights))).collect();
    let rivals = added.iter().map(|i| rivals(data, &pool, &best, *i, &weights)).collect();
    let freed = added.iter().map(|i| freed(data, &best, *i, &weights)).collect();
    let is_gain = |i: &usize| best.structure.terms[*i].physics == Physics::Gain;
    let like_bodies = added.iter().map(|i| is_gain(i) && !is_not_of_bodies(data, &best, *i, &weights)).collect();
    let mut under_one_load = under_one_load(data, &best, &weights);
    let rubs = |j: usize| best.structure.terms.iter().any(|t| t.physics == Physics::Coulomb && t.at == At::Joint(j));
    under_one_load
        .extend((0..data.problem.joints.len()).filter(|j| rubs(*j) && !data.unsigned[*j] && load_spread(data, *j) < LOAD_CHANGES));
    Ok(Search { as_given, refit, best, weights, tried, gains, rivals, freed, like_bodies, under_one_load, locals })
}

/// Everything that a search may add.
fn pool(data: &Data, without: &[String]) -> Vec<Term> {
    let is_wanted = |t: &Term| !without.iter().any(|w| w == t.physics.facts().name) && may_be(data, t);
    candidates(data.problem, &data.motions[..data.fit_count]).into_iter().filter(is_wanted).collect()
}

/// Adds what is worth it.
fn grow(data: &Data, pool: &[Term], most: usize, best: &mut Fit, weights: &Weights, tried: &mut Vec<Tried>, limit: Limit) {
    // Adding and exchanging can take turns: what was there once ends it.
    let mut seen: Vec<Vec<(Physics, crate::arms::physics::At)>> = Vec::new();
    while rare(&best.structure) < most {
        let mut now: Vec<_> = best.structure.terms.iter().map(|t| (t.physics, t.at)).collect();
        now.sort();
        if seen.iter().filter(|s| **s == now).count() > 1 {
            return;
        }
        seen.push(now);
        let mut offers: Vec<Fit> = Vec::new();
        let promising = |structure: &Structure| ranked(data, pool, structure, weights).into_iter().filter(|(_, promise)| *promise > 0.0);
        let mut terms: Vec<Term> = promising(&best.structure).take(FITTED).map(|(term, _)| term).collect();
        if best.structure.tolerance > STATED {
            // The effects that bodies this free compensate are visible where the bodies are those of the file.
            let stated = Structure { tolerance: STATED, ..best.structure.clone() };
            let hidden = promising(&stated).map(|(term, _)| term).filter(|t| is_like_bodies(t.physics)).take(FITTED_BESIDE);
            terms.extend(hidden.filter(|t| !terms.contains(t)).collect::<Vec<_>>());
        }
        for term in terms {
            if limit.is_over() {
                return;
            }
            let Some(fit) = data.fit(&with(&best.structure, &term), weights) else { continue };
            let index = fit.structure.terms.len() - 1;
            // Beside some effects the file's inertial parameters are better, beside others worse than alone.
            let fit = tolerated(data, shaped(data, fit, index, weights), weights);
            let mut fit = tolerated(data, shaped(data, fit, index, weights), weights);
            if term.physics == Physics::Coulomb {
                // The displacement over which it turns is no effect of its own.
                fit = slipped(data, fit, weights);
            }
            if is_possible(data, &fit) && torque_share(data, &fit, index) >= LEAST_TORQUE {
                offers.push(fit);
            }
        }
        let freer = tolerated(data, best.clone(), weights);
        offers.sort_by(|a, b| a.score.total_cmp(&b.score));
        simplest_first(data, &mut offers, weights);
        let mut taken = false;
        for offer in offers {
            let worth = best.score - offer.score;
            let found = compare(data, best, &offer, weights);
            let shows = found.is_some_and(|g| g.is_sure()) && largest_share(data, best, &offer) >= LEAST_SHARE;
            let is_no_body = offer.structure.terms.last().is_some_and(|t| is_like_bodies(t.physics)) && offer.score < freer.score - WORTH;
            let sure = worth > WORTH && (shows || is_no_body);
            let better_than_freer = offer.score <= freer.score;
            let take = sure && better_than_freer && !taken;
            if let Some(term) = offer.structure.terms.last() {
                tried.push(Tried { term: term.clone(), worth, gain: found, taken: take });
            }
            if take {
                *best = slipped(data, offer, weights);
                taken = true;
                break;
            }
        }
        if !taken && freer.score < best.score - WORTH {
            *best = slipped(data, freer, weights);
            taken = true;
        }
        if !taken {
            return;
        }
        exchange(data, pool, best, weights);
    }
}

/// Of fits with one more term each, the best first: brings to the front the one with the fewest parameters that held-out segments do not surely
/// reject.
fn simplest_first(data: &Data, offers: &mut [Fit], weights: &Weights) {
    let Some(best) = offers.first().cloned() else { return };
    let numbers = |f: &Fit| f.structure.terms.last().map_or(0, |t| t.physics.facts().numbers);
    let mut order: Vec<usize> = (1..offers.len()).filter(|i| numbers(&offers[*i]) < numbers(&best)).collect();
    order.sort_by_key(|i| numbers(&offers[*i]));
    if let Some(at) = order.into_iter().find(|i| is_as_good(data, &offers[*i], &best, weights)) {
        offers[..=at].rotate_right(1);
    }
}

/// Whether a fit with fewer parameters predicts held-out segments as well as another one, within their uncertainty.
fn is_as_good(data: &Data, simple: &Fit, other: &Fit, weights: &Weights) -> bool {
    let sure = compare(data, simple, other, weights).is_some_and(|g| g.is_sure());
    largest_share(data, simple, other) < LEAST_SHARE || (!sure && simple.score < other.score + WORTH)
}

/// Replaces an added effect by another, where that is better.
fn exchange(data: &Data, pool: &[Term], best: &mut Fit, weights: &Weights) {
    for _ in 0..2 {
        let mut changed = false;
        let mut index = 0;
        while index < best.structure.terms.len() {
            if best.structure.terms[index].given.is_some() {
                index += 1;
                continue;
            }
            let less = without(&best.structure, index);
            let mut better: Option<Fit> = None;
            let there = best.structure.tolerance;
            for tolerance in there.saturating_sub(1)..(there + 2).min(data.most_tolerance + 1) {
                let less = Structure { tolerance, ..less.clone() };
                // Without it at all, where another tolerance makes it needless.
                let mut offers: Vec<Fit> = data.fit(&less, weights).into_iter().collect();
                for (term, _) in ranked(data, pool, &less, weights).into_iter().take(3) {
                    let Some(fit) = data.fit(&with(&less, &term), weights) else { continue };
                    let last = fit.structure.terms.len() - 1;
                    let fit = shaped(data, fit, last, weights);
                    offers.push(if term.physics == Physics::Coulomb { slipped(data, fit, weights) } else { fit });
                }
                offers.retain(|offer| is_possible(data, offer));
                offers.sort_by(|a, b| a.score.total_cmp(&b.score));
                for offer in offers {
                    let now = better.as_ref().unwrap_or(best);
                    let simpler = offer.numbers < now.numbers - 0.5 && is_as_good(data, &offer, now, weights);
                    let clearly =
                        offer.score < now.score - 2.0 && !(now.numbers < offer.numbers - 0.5 && is_as_good(data, now, &offer, weights));
                    if simpler || clearly {
                        better = Some(offer);
                    }
                }
            }
            if let Some(offer) = better {
                *best = offer;
                changed = true;
            }
            // One exchange a place and round: two that are equally good would alternate for ever.
            index += 1;
            if index >= best.structure.terms.len() {
                break;
            }
        }
        if !changed {
            return;
        }
    }
}

/// Whether released inertial parameters can compensate an effect.
fn is_like_bodies(physics: Physics) -> bool {
    matches!(physics, Physics::Payload | Physics::Inertia)
}

/// Whether the logs separate a wrong torque constant from other bodies: without it, released bodies predict left-out segments surely worse.
fn is_not_of_bodies(data: &Data, best: &Fit, index: usize, weights: &Weights) -> bool {
    let free = |structure: Structure| data.fit(&Structure { tolerance: data.most_tolerance, ..structure }, weights);
    let is_worse =
        |less: &Fit| largest_share(data, less, best) >= LEAST_SHARE && compare(data, less, best, weights).is_some_and(|g| g.is_sure());
    free(without(&best.structure, index)).as_ref().is_some_and(is_worse)
}

/// For a term that is mass or inertia: by how much the structure without it scores above the best one where its bodies are released to compensate it. They
/// predict the same, and only what is known of bodies speaks for the term.
fn freed(data: &Data, best: &Fit, index: usize, weights: &Weights) -> Option<f64> {
    best.structure.terms.get(index).filter(|t| is_like_bodies(t.physics))?;
    let less = without_term(data, best, index, weights)?;
    Some(tolerated(data, less, weights).score - best.score)
}

/// Whether other joints than the one that it acts at show a law.
fn shows_elsewhere(term: &Term) -> bool {
    matches!(term.physics, Physics::Compliance | Physics::Backlash)
}

/// Takes off again what is not worth it, except for terms that stay.
fn shrink(data: &Data, best: &mut Fit, weights: &Weights, stays: &dyn Fn(&Term) -> bool) {
    loop {
        let mut worst: Option<(f64, Fit)> = None;
        for index in added(&best.structure) {
            if stays(&best.structure.terms[index]) {
                continue;
            }
            let Some(less) = data.fit(&without(&best.structure, index), weights) else { continue };
            let worth = less.score - best.score;
            let sure = compare(data, &less, best, weights).is_some_and(|g| g.is_sure());
            let interval = best.places.get(index).is_some_and(|place| place.clone().any(|i| best.values[i].abs() > 1.96 * best.errors[i]));
            let shows = sure && largest_share(data, &less, best) >= LEAST_SHARE;
            let keep = worth > WORTH
                && interval
                && torque_share(data, best, index) >= LEAST_TORQUE
                && (shows || freed(data, best, index, weights).is_some_and(|above| above > WORTH));
            if !keep && worst.as_ref().is_none_or(|(w, _)| worth < *w) {
                worst = Some((worth, less));
            }
        }
        match worst {
            Some((_, less)) => *best = tolerated(data, less, weights),
            None => return,
        }
    }
}

/// The nominal structure with its parameters refitted, inertial parameters as free as is worth it.
fn refitted(data: &Data, nominal: &Structure, slip: &[f64], weights: &Weights) -> Option<Fit> {
    let fit = data.fit(&Structure { slip: slip.to_vec(), ..nominal.clone() }, weights)?;
    Some(tolerated(data, fit, weights))
}

/// What could replace an added term, with the score above the best one's.
fn rivals(data: &Data, pool: &[Term], best: &Fit, index: usize, weights: &Weights) -> Vec<Rival> {
    let less = without(&best.structure, index);
    let pool: Vec<Term> = pool.iter().filter(|t| !t.is_like(&best.structure.terms[index])).cloned().collect();
    let mut out = Vec::new();
    for (term, _) in ranked(data, &pool, &less, weights).into_iter().take(5) {
        let Some(fit) = data.fit(&with(&less, &term), weights) else { continue };
        let last = fit.structure.terms.len() - 1;
        let fit = shaped(data, fit, last, weights);
        if is_possible(data, &fit) {
            out.push(Rival { term, above: fit.score - best.score, structure: fit.structure });
        }
    }
    out.sort_by(|a, b| a.above.total_cmp(&b.above));
    out
}
