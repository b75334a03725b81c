//! A structure, fitted, and the measures of its quality: the data that fitting, proposals, schedule and verdict use.

use crate::belief::compare::{HeldOut, blocks};
use crate::belief::statistics::{advantage, correlation_time, levels, whiteness_statistic};
use crate::hypothesis::Hypothesis;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::Structure;
use crate::tuning::tuning;
use std::collections::HashSet;

/// A structure, fitted.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// What it is.
    pub structure: Structure,
    /// How it fits.
    pub fit: Fit,
    /// Correlation time of its residual, samples.
    pub correlation_time: f64,
    /// How far its residual is from white noise at longer spans, see [`whiteness_statistic`].
    pub whiteness_statistic: f64,
    /// Root mean square of its residual at each output, noise standard deviations.
    pub levels: Vec<f64>,
    /// Mean squares of its residual block by block, see [`blocks`].
    pub blocks: Vec<Vec<f64>>,
    /// Whether one of its effects may as well be nothing, as far as the recordings tell; only the best is looked at.
    pub may_be_nothing: bool,
    /// Its residual on the held-out recordings; `None` where it was not held against them.
    pub unseen: Option<HeldOut>,
    /// The same with its parameters released as far as the fitted recordings leave them open, see [`crate::belief::released_parameters`];
    /// `None` where no decision depends on it.
    pub released: Option<HeldOut>,
}

impl Candidate {
    /// Whether its residual is white noise, as far as chance can tell.
    pub fn is_white(&self) -> bool {
        white(self.correlation_time, self.whiteness_statistic)
    }
}

pub(crate) fn white(correlation_time: f64, whiteness_statistic: f64) -> bool {
    correlation_time < tuning().noise.white_correlation && whiteness_statistic < tuning().noise.white_statistic
}

/// How good a candidate is beside others of the same search: its cost with a price on each parameter, the lower the better.
pub fn price(candidate: &Candidate, samples: usize, correlation_time: f64) -> f64 {
    let effective = (samples as f64 / correlation_time).max(2.0);
    effective * (candidate.fit.cost.max(1e-300) / samples.max(1) as f64).ln() + candidate.structure.free.len() as f64 * effective.ln()
}

/// The ids of a structure's effects, whatever their order.
pub(crate) fn key_of<'h>(added: impl IntoIterator<Item = &'h Hypothesis>) -> String {
    let mut ids: Vec<&str> = added.into_iter().map(|h| h.id.as_str()).collect();
    ids.sort_unstable();
    ids.join("+")
}

/// The best candidates of so many effects, each structure once.
pub(crate) fn distinct_structures(found: &[Candidate], effects: usize) -> impl Iterator<Item = &Candidate> {
    let mut seen = HashSet::new();
    found.iter().filter(move |c| c.structure.added.len() == effects && seen.insert(key_of(&c.structure.added)))
}

pub(crate) fn candidate(evaluator: &Evaluator, structure: Structure, fit: Fit) -> Candidate {
    let correlation_time = correlation_time(evaluator, &fit.residuals);
    let (levels, whiteness_statistic) = (levels(evaluator, &fit.residuals), whiteness_statistic(evaluator, &fit.residuals));
    let blocks = blocks(evaluator, &fit.residuals);
    Candidate { structure, fit, correlation_time, whiteness_statistic, levels, blocks, may_be_nothing: false, unseen: None, released: None }
}

/// Sorts by price, with the correlation time of the one that costs least.
pub(crate) fn sort(found: &mut [Candidate], samples: usize) {
    let best = found.iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost)).map_or(1.0, |c| c.correlation_time);
    found.sort_by(|a, b| price(a, samples, best).total_cmp(&price(b, samples, best)));
}

/// Whether the best structure leaves nothing that another effect could explain.
pub(crate) fn done(found: &[Candidate], nominal: &Candidate, samples: usize) -> bool {
    let best = found.first().filter(|b| advantage_over(nominal, b, samples) > 0.0).unwrap_or(nominal);
    best.is_white()
}

/// How much better a candidate is than another one, with the correlation time of the better.
pub fn advantage_over(base: &Candidate, better: &Candidate, samples: usize) -> f64 {
    let (a, b) = (base.structure.free.len(), better.structure.free.len());
    advantage(base.fit.cost, a, better.fit.cost.max(1e-300), b, samples, better.correlation_time)
}

/// The best, or far from the noise, where the law is open as well as its place, what does nearly as well with the fewest parameters.
pub(crate) fn simplest(found: &[Candidate], samples: usize) -> Option<&Candidate> {
    let effects = found.first()?.structure.added.len();
    simplest_of(found.iter().filter(|c| c.structure.added.len() == effects), samples)
}

/// The same of some candidates, best first.
pub(crate) fn simplest_of<'c>(candidates: impl Iterator<Item = &'c Candidate>, samples: usize) -> Option<&'c Candidate> {
    let mut candidates = candidates.peekable();
    let best = candidates.peek().copied()?;
    if best.fit.cost < tuning().noise.near * samples as f64 {
        return Some(best);
    }
    candidates.filter(|c| c.fit.cost < tuning().search.behind_far * best.fit.cost).min_by_key(|c| c.structure.free.len())
}
