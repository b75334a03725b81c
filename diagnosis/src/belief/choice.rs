//! Which of the structures is claimed, and which cannot be distinguished from it.

use super::plausible::{is_at_bound, is_plausible};
use crate::belief::compare::HeldOut;
use crate::belief::predictive::{Gain, gain};
use crate::belief::statistics::advantage;
use crate::hypothesis::{Hypothesis, Physics};
use crate::output_error::candidate::{Candidate, advantage_over, key_of};
use crate::output_error::error_budget::{beside_noise, of_sensors};
use crate::physics::{PHYSICS, withheld};
use crate::search::Search;
use crate::tuning::tuning;
use std::collections::HashSet;

/// Which of the structures is claimed.
pub fn chosen(search: &Search) -> &Candidate {
    if let Some(forces) = &search.forces {
        return search.found.iter().find(|c| key_of(&c.structure.added) == forces.claimed).unwrap_or(&search.nominal);
    }
    let mut best = &search.nominal;
    for effects in 1..=search.found.iter().map(|c| c.structure.added.len()).max().unwrap_or(0) {
        let so_many = || search.found.iter().filter(|c| c.structure.added.len() == effects && is_plausible(c));
        let Some(next) = so_many().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost)) else { continue };
        let next = so_many().fold(next, |best, c| if evidence(search, best, c) > 0.0 { c } else { best });
        // Ties go to the fewest parameters, then to the effect that is named first.
        let simplest = so_many()
            .filter(|c| evidence(search, c, next) < tuning().claim.alike || is_enough(search, c, next))
            .min_by_key(|c| (c.structure.free.len(), c.structure.added.iter().map(order).sum::<usize>()))
            .unwrap_or(next);
        if worth(search, best, simplest) {
            best = simplest;
        }
    }
    best
}

/// Whether a law of fewer parameters is enough where one that contains it, at the same place, fits better. The richer law must predict better by more than
/// its own variation. It must also remove a good part of what the simpler one leaves beyond the noise. On a real device one more parameter always helps a
/// little.
fn is_enough(search: &Search, simple: &Candidate, rich: &Candidate) -> bool {
    if simple.structure.free.len() >= rich.structure.free.len() || !is_contained(simple, rich) {
        return false;
    }
    let (a, b) = (mean_square(search, simple), mean_square(search, rich));
    let removes = (a - b) / (a - b.min(1.0)).max(f64::MIN_POSITIVE);
    let surely = everywhere(simple, rich).is_none_or(|gain| gain.is_sure());
    !surely || removes < tuning().claim.richer_removes || (is_at_bound(rich) && !is_at_bound(simple) && removes < 0.5)
}

/// Whether two structures differ in one effect, and the one of the first is a special or limiting case of the other's at the same place.
fn is_contained(simple: &Candidate, rich: &Candidate) -> bool {
    let only = |c: &Candidate, other: &Candidate| -> Vec<Hypothesis> {
        c.structure.added.iter().filter(|h| other.structure.added.iter().all(|o| o.id != h.id)).cloned().collect()
    };
    match (only(simple, rich).as_slice(), only(rich, simple).as_slice()) {
        ([own], [more]) => more.place.same(&own.place) && contains(more.physics, own),
        _ => false,
    }
}

/// Mean square of the residual over the fitted and the held-out recordings, noise variances.
fn mean_square(search: &Search, c: &Candidate) -> f64 {
    let unseen = c.unseen.as_ref().map_or(0.0, |u| u.mean_square * search.unseen_samples as f64);
    let unseen_samples = if c.unseen.is_some() { search.unseen_samples } else { 0 };
    (c.fit.cost + unseen) / (search.samples + unseen_samples).max(1) as f64
}

/// The same, with its parameters released where those of the other were, too.
fn mean_square_let_go(search: &Search, c: &Candidate, beside: &Candidate) -> f64 {
    let (Some(own), Some(_)) = on_unseen(c, beside) else { return mean_square(search, c) };
    (c.fit.cost + own.mean_square * search.unseen_samples as f64) / (search.samples + search.unseen_samples).max(1) as f64
}

/// How much better one candidate predicts than another, over all blocks of all recordings.
pub(crate) fn everywhere(base: &Candidate, better: &Candidate) -> Option<Gain> {
    match on_unseen(base, better) {
        (Some(a), Some(b)) => {
            let all = |own: &[Vec<f64>], unseen: &[Vec<f64>]| [own, unseen].concat();
            gain(&all(&base.blocks, &a.blocks), &all(&better.blocks, &b.blocks))
        }
        _ => gain(&base.blocks, &better.blocks),
    }
}

/// Whether an effect predicts held-out data better: by more than the gain varies from block to block, and by enough to be of use. Where the nominal model
/// already predicts them down to the noise, or where there are none, the fitted recordings decide. An improvement within the errors of the integration and
/// of the clock does not count.
fn predicts(search: &Search, base: &Candidate, better: &Candidate) -> bool {
    let no_physics = beside_noise(&search.errors);
    let of_use = |a: f64, b: f64| a.sqrt() - b.sqrt() > tuning().claim.useful * b.sqrt().max(1.0) && a - b > no_physics;
    let fitted = || {
        let removed = (base.fit.cost - better.fit.cost) / search.samples.max(1) as f64;
        removed > no_physics && gain(&base.blocks, &better.blocks).is_none_or(|gain| gain.is_sure())
    };
    match (&base.unseen, &better.unseen) {
        (Some(a), Some(b)) if of_use(a.mean_square, b.mean_square) => {
            // A device that drifts freely may end in another place after the least difference. Where the fits explain all there is, it is enough that the
            // unseen recordings are no evidence against it.
            let at_floor = |c: &Candidate| c.levels.iter().all(|level| *level < tuning().noise.unexplained);
            let explained = at_floor(better) && !at_floor(base);
            a.gain_over(b).is_none_or(|gain| gain.is_sure() || explained && gain.mean > 0.0)
        }
        (Some(a), Some(b)) => {
            let silent = a.mean_square.sqrt() < tuning().noise.at_noise && !of_use(b.mean_square, a.mean_square);
            base.structure.added.is_empty() && silent && fitted()
        }
        _ => fitted(),
    }
}

fn order(h: &Hypothesis) -> usize {
    PHYSICS.iter().position(|p| *p == h.physics).unwrap_or(usize::MAX)
}

/// What the fits and the held-out recordings say for a candidate against another one, as a difference of information
/// criteria with effective samples.
pub(crate) fn evidence(search: &Search, base: &Candidate, better: &Candidate) -> f64 {
    let evidence = advantage_over(base, better, search.samples) + unseen_evidence(search, base, better);
    // An error of the size of that of irregular clocks and sensors separates no two structures.
    let least = of_sensors(&search.errors);
    let apart = mean_square_let_go(search, base, better) - mean_square_let_go(search, better, base);
    if apart.abs() < least { evidence.clamp(-0.5 * tuning().claim.alike, 0.5 * tuning().claim.alike) } else { evidence }
}

/// Residuals of two candidates on the held-out recordings, with released parameters where both have them.
fn on_unseen<'c>(base: &'c Candidate, better: &'c Candidate) -> (Option<&'c HeldOut>, Option<&'c HeldOut>) {
    match (&base.released, &better.released) {
        (Some(a), Some(b)) => (Some(a), Some(b)),
        _ => (base.unseen.as_ref(), better.unseen.as_ref()),
    }
}

/// Whether a candidate of as many effects as the best fits nearly as well, and the held-out recordings decide between the two.
pub(crate) fn decided_by_unseen(search: &Search, c: &Candidate, best: &Candidate) -> bool {
    let alike = tuning().claim.alike;
    c.structure.added.len() == best.structure.added.len()
        && !c.structure.added.is_empty()
        && c.unseen.is_some()
        && advantage_over(c, best, search.samples) < alike
        && (c.released.is_some() || unseen_evidence(search, c, best) > alike)
}

/// What the held-out recordings say alone; 0 where there are none.
pub(crate) fn unseen_evidence(search: &Search, base: &Candidate, better: &Candidate) -> f64 {
    match on_unseen(base, better) {
        (Some(a), Some(b)) if a.mean_square > 0.0 && b.mean_square > 0.0 => {
            (search.unseen_samples as f64 / a.correlation_time.max(b.correlation_time)) * (a.mean_square / b.mean_square).ln()
        }
        _ => 0.0,
    }
}

/// Whether a structure with one effect more is worth it.
fn worth(search: &Search, base: &Candidate, better: &Candidate) -> bool {
    evidence(search, base, better) > tuning().claim.least_advantage
        && better.fit.cost < (1.0 - tuning().claim.least_share) * base.fit.cost
        && predicts(search, base, better)
}

/// Structures of as many effects that cannot be distinguished from the best: another place, or a law that does not contain its own.
pub(crate) fn alike<'s>(search: &'s Search, best: &Candidate) -> Vec<&'s Candidate> {
    let differs = |c: &Candidate| match exchanged(best, c) {
        (own, other) if own.len() == 1 && other.len() == 1 => {
            !(other[0].place.same(&own[0].place) && has_as_limit(other[0].physics, own[0].physics)) && other[0].class != own[0].class
        }
        (_, other) => !other.is_empty(),
    };
    if let Some(forces) = &search.forces {
        let is_alike = |c: &&Candidate| forces.alike.contains(&key_of(&c.structure.added));
        return search.found.iter().filter(is_alike).take(tuning().claim.rivals).collect();
    }
    let mut seen = HashSet::new();
    let close = |c: &&Candidate| {
        c.structure.added.len() == best.structure.added.len()
            && behind(search, c, best) < tuning().claim.alike
            && is_plausible(c)
            && differs(c)
    };
    let all: Vec<&Candidate> = search.found.iter().filter(close).filter(|c| seen.insert(c.structure.name())).collect();
    let is_finer = |c: &Candidate| all.iter().any(|other| c.structure.free.len() > other.structure.free.len() && is_finer_than(other, c));
    all.iter().copied().filter(|c| !is_finer(c)).take(tuning().claim.rivals).collect()
}

/// How far a structure is behind the best. A fit that is not at its end may still come nearer.
pub(crate) fn behind(search: &Search, c: &Candidate, best: &Candidate) -> f64 {
    let effective = search.samples as f64 / best.correlation_time.max(1.0);
    evidence(search, c, best) - effective * (2.0 * c.fit.predicted_decrease / c.fit.cost).min(0.5)
}

/// Whether two structures differ in one effect, and the first has a special or limiting case of the other's there: what that one explains is no other explanation.
fn is_finer_than(simple: &Candidate, rich: &Candidate) -> bool {
    match exchanged(simple, rich) {
        (own, other) if own.len() == 1 && other.len() == 1 => {
            other[0].place.same(&own[0].place) && own[0].physics != other[0].physics && has_as_limit(other[0].physics, own[0].physics)
        }
        _ => false,
    }
}

/// A law with more parameters that fits as well as the one that is claimed.
pub(crate) struct Richer<'s> {
    pub candidate: &'s Candidate,
    /// Whether the one that is claimed is a special or limiting case of it, in the same place.
    pub contains: bool,
}

/// Structures that lose only because of their number of parameters: one effect is exchanged for a law with more of them, which fits as well. The preference
/// for a simpler law is no evidence on the device outside the recorded range. The simplest first. None where the best leaves more than noise, for there a
/// richer law fits what is not its own.
pub(crate) fn richer<'s>(search: &'s Search, best: &Candidate) -> Vec<Richer<'s>> {
    if best.levels.iter().any(|level| *level > tuning().noise.unexplained) {
        return Vec::new();
    }
    let mut all: Vec<Richer> = Vec::new();
    for c in search.found.iter().filter(|c| c.structure.added.len() == best.structure.added.len() && is_plausible(c)) {
        let (own, other) = exchanged(best, c);
        let ([own], [other]) = (own.as_slice(), other.as_slice()) else { continue };
        let fits = advantage(c.fit.cost, 0, best.fit.cost, 0, search.samples, best.correlation_time) + unseen_evidence(search, c, best);
        if c.structure.free.len() > best.structure.free.len() && other.class != own.class && fits < tuning().claim.alike {
            let contains = other.place.same(&own.place) && has_as_limit(other.physics, own.physics);
            all.push(Richer { candidate: c, contains });
        }
    }
    all.sort_by(|a, b| {
        let of = |r: &Richer| (r.candidate.structure.free.len(), r.candidate.fit.cost);
        of(a).0.cmp(&of(b).0).then(of(a).1.total_cmp(&of(b).1))
    });
    all.truncate(tuning().claim.rivals);
    all
}

/// The effects in which two structures differ: of the first, and of the second.
pub(crate) fn exchanged<'c>(best: &'c Candidate, other: &'c Candidate) -> (Vec<&'c Hypothesis>, Vec<&'c Hypothesis>) {
    let only = |c: &'c Candidate, o: &Candidate| -> Vec<&'c Hypothesis> {
        c.structure.added.iter().filter(|h| o.structure.added.iter().all(|q| q.id != h.id)).collect()
    };
    (only(best, other), only(other, best))
}

/// The structures of as many effects that come nearest to the best, at most two.
pub(crate) fn nearest<'s>(search: &'s Search, best: &Candidate) -> Vec<&'s Candidate> {
    let name = best.structure.name();
    let mut rivals: Vec<&Candidate> =
        search.found.iter().filter(|c| c.structure.added.len() == best.structure.added.len() && c.structure.name() != name).collect();
    rivals.sort_by(|a, b| evidence(search, a, best).total_cmp(&evidence(search, b, best)));
    rivals.truncate(2);
    rivals
}

/// Whether an effect has another one as a special or limiting case, or is the same.
fn has_as_limit(rich: &Physics, own: &Physics) -> bool {
    withheld(&[own.name]).contains(&rich.name)
}

/// Whether an effect has another one, or one of its family at the same place, as a special or limiting case.
pub(crate) fn contains(rich: &Physics, own: &Hypothesis) -> bool {
    withheld(&[own.physics.name]).contains(&rich.name) || rich.family == own.physics.family
}
