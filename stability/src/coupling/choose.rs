//! Which law it is: all of them fitted, and compared on held-out time.

use super::fit::{Fit, Ready, mean_square};
use super::law::Term;
use super::prepared::{BLOCKS, Side};
use super::types::{Rival, SideLaw};
use backdrive_signal::statistics::deviation;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;

/// Folds of held-out time: every fourth block.
const FOLDS: usize = 4;
/// A law whose residual on held-out time is larger by this factor is worse, even if there are few blocks.
const SURELY_WORSE: f64 = 2.0;
/// A term is reported only where it explains at least this share of the residual: the effect of filters and rounding that a recording does not
/// determine is of that size.
const WORTH: f64 = 0.05;
/// What leaves less of the variance is exact: the rest is rounding of the computation.
const EXACT: f64 = 1e-10;
/// A term that adds less than this share of the force is none.
const VISIBLE: f64 = 1e-3;
/// Gauss-Newton steps of a first fit, of a whole one, and of one that starts at it and misses a quarter of the time.
const ROUGH_STEPS: usize = 5;
/// See [`ROUGH_STEPS`].
const FULL_STEPS: usize = 12;
/// See [`ROUGH_STEPS`].
const FOLD_STEPS: usize = 2;
/// A first fit whose residual is larger than the best by this factor is surely worse on held-out time too; the best few of these are reported as
/// rivals.
const HOPELESS: f64 = 8.0;
/// See [`HOPELESS`].
const HOPELESS_TOLD: usize = 3;
/// Number of rivals that are reported.
const RIVALS: usize = 5;

/// The laws that are tried, simplest first.
fn laws() -> Vec<Vec<Term>> {
    use Term::{Damping, Friction, OtherForce, OwnForce, Position, Rate};
    let motions: [&[Term]; 3] = [&[], &[Position], &[Position, Rate]];
    let own: [&[Term]; 4] = [&[], &[Damping], &[Friction], &[Damping, Friction]];
    let forces: [&[Term]; 4] = [&[], &[OtherForce], &[OwnForce], &[OtherForce, OwnForce]];
    let mut all = Vec::new();
    for motion in motions {
        for own in own {
            all.extend(forces.iter().map(|force| [motion, own, *force].concat()));
        }
    }
    all.retain(|terms| !terms.is_empty());
    all.sort_by_key(Vec::len);
    all
}

/// A law fitted to everything, and what it leaves of each block that its fit has not seen.
struct Tried {
    fit: Fit,
    /// Mean square by block.
    unseen: Vec<f64>,
    total: f64,
    /// Whether each of its terms stands out of the rounding of the position sensor.
    stands_out: bool,
}

/// The law of a side.
pub(super) fn choose(side: &Side) -> Option<SideLaw> {
    let ready = Ready::of(side);
    let possible: Vec<Vec<Term>> = laws().into_iter().filter(|terms| terms.iter().all(|t| side.has(*t))).collect();
    let mut roughly: Vec<Fit> = possible.par_iter().filter_map(|terms| ready.fit(terms, &side.blocks, ROUGH_STEPS)).collect();
    roughly.sort_by(|a, b| a.loss.total_cmp(&b.loss));
    let variance = deviation(&ready.force).powi(2).max(f64::MIN_POSITIVE);
    let least = roughly.first()?.loss.max(EXACT * variance);
    let near = roughly.iter().filter(|f| f.loss <= HOPELESS * least).count();
    roughly.truncate(near + HOPELESS_TOLD);
    let mut tried: Vec<Tried> = roughly.into_par_iter().filter_map(|fit| attempt(side, &ready, fit)).collect();
    tried.sort_by(|a, b| a.total.total_cmp(&b.total));
    // Where every law has an unnecessary term, the best of them all.
    let best = tried.iter().find(|t| t.stands_out).or(tried.first())?;
    let worse = |law: &Tried, best: &Tried| worse(law, best, EXACT * variance);
    let as_good = |t: &&Tried| (t.stands_out || std::ptr::eq(*t, best)) && !worse(t, best);
    let chosen = tried.iter().filter(as_good).min_by(|a, b| a.fit.terms.len().cmp(&b.fit.terms.len()).then(a.total.total_cmp(&b.total)))?;
    // The same law with an additional unnecessary term is no rival.
    let same = |t: &Tried| {
        chosen.fit.terms.iter().all(|term| t.fit.terms.contains(term)) && (t.fit.terms == chosen.fit.terms || !worse(chosen, t))
    };
    let rivals = tried.iter().filter(|t| !same(t)).take(RIVALS);
    let rivals = rivals.map(|t| Rival { terms: t.fit.terms.clone(), unexplained: t.total / variance }).collect();
    let told = ready.told(&chosen.fit);
    Some(SideLaw {
        gains: told.gains,
        offset: told.offset,
        filter_s: told.filter_s,
        delay_s: told.delay_s,
        force_delay_s: told.force_delay_s,
        limit: side.limit,
        unexplained: chosen.total / variance,
        left: chosen.total.sqrt(),
        band_hz: side.band_hz,
        rivals,
        law: ready.law(&chosen.fit),
    })
}

fn attempt(side: &Side, ready: &Ready, rough: Fit) -> Option<Tried> {
    let fit = ready.refined(rough, &side.blocks, FULL_STEPS)?;
    let mut unseen = vec![0.0; BLOCKS];
    for fold in 0..FOLDS {
        let of = |held_out: bool| side.blocks.iter().enumerate().filter(move |(b, _)| (b % FOLDS == fold) == held_out);
        let seen: Vec<Range<usize>> = of(false).map(|(_, r)| r.clone()).collect();
        let left = ready.residual(&ready.refined(fit.clone(), &seen, FOLD_STEPS)?);
        for (block, rows) in of(true) {
            if let Some(unseen) = unseen.get_mut(block) {
                *unseen = mean_square(&left, std::slice::from_ref(rows));
            }
        }
    }
    let total = unseen.iter().sum::<f64>() / BLOCKS as f64;
    let least = ready.rounding(&fit).max(VISIBLE * deviation(&ready.force));
    let stands_out = ready.contributions(&fit).iter().all(|c| *c > least);
    total.is_finite().then_some(Tried { fit, unseen, total, stands_out })
}

/// Whether a law predicts worse than another: by block, in pairs, surely and by a relevant amount; or by far in all.
fn worse(law: &Tried, best: &Tried, exact: f64) -> bool {
    if law.total <= exact {
        return false;
    }
    if law.total > SURELY_WORSE * best.total {
        return true;
    }
    let pairs: Vec<f64> = law.unseen.iter().zip(&best.unseen).map(|(a, b)| a - b).collect();
    let n = pairs.len() as f64;
    let mean = pairs.iter().sum::<f64>() / n;
    let deviation = (pairs.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
    let t = StudentsT::new(0.0, 1.0, n - 1.0).map_or(1.73, |t| t.inverse_cdf(0.95));
    mean > t * deviation && law.total > (1.0 + WORTH) * best.total
}
