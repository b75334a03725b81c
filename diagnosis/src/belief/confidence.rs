//! The confidence of a finding: the probability that effect and place are right, from the evidence of the recordings for it and against its rivals.
//!
//! A logistic regression over a few figures of each finding. Its coefficients were found on drawn cases with a sealed truth and judged on others
//! (docs/diagnosis.md describes how, and gives the reliability).

use super::choice::{contains, everywhere, evidence};
use crate::hypothesis::Hypothesis;
use crate::output_error::candidate::Candidate;
use crate::search::Search;
use crate::tuning::tuning;

/// What is known of a finding, each about 0 to 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figures {
    /// How surely the structure predicts better with it than without: logarithm of 1 and the standard errors, over all blocks of all recordings.
    pub with: f64,
    /// The same over its nearest rival of another place or family.
    pub over_rival: f64,
    /// The same over the nearest law of its family at its place, other than those that contain it.
    pub over_kin: f64,
    /// How far the fit is preferred to that of its nearest rival, of whatever kind: logarithm of 1 and the criterion over `claim.alike`.
    pub preferred: f64,
    /// Share of the mean square beyond the noise that it removes.
    pub removes: f64,
    /// What is left: logarithm of the root mean square in noise standard deviations.
    pub left: f64,
    /// Logarithm of the correlation time of what is left, samples.
    pub correlated: f64,
    /// 1 where its force depends on the path: laws with a memory are easily taken for one another.
    pub memory: f64,
    /// Effects that are claimed beside it.
    pub beside: f64,
    /// Whether one of its parameters is at the end of its range.
    pub at_bound: f64,
    /// As `preferred`, over its nearest rival of another place or family.
    pub over_other: f64,
}

impl Figures {
    /// In the order of [`NAMES`].
    pub fn list(&self) -> [f64; 11] {
        let Figures { with, over_rival, over_kin, preferred, removes, left, correlated, memory, beside, at_bound, over_other } = *self;
        [with, over_rival, over_kin, preferred, removes, left, correlated, memory, beside, at_bound, over_other]
    }
}

/// Names of the figures.
pub const NAMES: [&str; 11] =
    ["with", "over_rival", "over_kin", "preferred", "removes", "left", "correlated", "memory", "beside", "at_bound", "over_other"];

/// Standard errors beyond which more do not make it surer.
const MOST: f64 = 20.0;

/// The figures of one effect of a structure; `rivals` stand in its place in structures that are else the same.
pub(crate) fn figures(search: &Search, best: &Candidate, which: usize, rivals: &[(&Hypothesis, &Candidate)]) -> Figures {
    let own = &best.structure.added[which];
    let over = |other: &Candidate| everywhere(other, best).map_or(0.0, |gain| gain.in_errors()).clamp(-0.9, MOST).ln_1p();
    let behind = |other: &Candidate| (evidence(search, other, best).max(0.0) / tuning().claim.alike).min(1e4).ln_1p();
    let is_kin = |h: &Hypothesis| h.place.same(&own.place) && (contains(h.physics, own) || contains(own.physics, h));
    let least = |all: &mut dyn Iterator<Item = f64>, none: f64| all.fold(none, f64::min);
    let without = without(search, best, which);
    let excess = |c: &Candidate| (c.fit.cost / search.samples.max(1) as f64 - 1.0).max(0.0);
    let level = best.levels.iter().fold(1.0f64, |a, b| a.max(*b));
    Figures {
        with: over(without),
        over_rival: least(&mut rivals.iter().filter(|(h, _)| !is_kin(h)).map(|(_, c)| over(c)), MOST.ln_1p()),
        over_kin: least(&mut rivals.iter().filter(|(h, _)| is_kin(h)).map(|(_, c)| over(c)), MOST.ln_1p()),
        preferred: least(&mut rivals.iter().map(|(_, c)| behind(c)), 1e4f64.ln_1p()),
        removes: 1.0 - (excess(best) / excess(without).max(1e-3)).min(1.0),
        left: level.ln(),
        correlated: best.correlation_time.max(1.0).ln(),
        memory: f64::from(u8::from(own.physics.facts.memory)),
        beside: (best.structure.added.len() - 1) as f64,
        at_bound: f64::from(u8::from(super::plausible::is_at_bound_of(best, which))),
        over_other: least(&mut rivals.iter().filter(|(h, _)| !is_kin(h)).map(|(_, c)| behind(c)), 1e4f64.ln_1p()),
    }
}

/// The best structure that was fitted with all the other effects; the nominal one where none was.
pub(crate) fn without<'s>(search: &'s Search, best: &Candidate, which: usize) -> &'s Candidate {
    let (added, id) = (&best.structure.added, &best.structure.added[which].id);
    let is_rest = |c: &&Candidate| {
        c.structure.added.len() + 1 == added.len() && c.structure.added.iter().all(|o| o.id != *id && added.iter().any(|b| b.id == o.id))
    };
    search.found.iter().filter(is_rest).min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost)).unwrap_or(&search.nominal)
}

/// The probability that a finding with these figures is right in effect and place.
pub(crate) fn probability(figures: &Figures) -> f64 {
    logistic(&tuning().claim.confidence, figures)
}

/// The probability that some effect of its family is at its place, whichever.
pub(crate) fn probability_of_family(figures: &Figures) -> f64 {
    logistic(&tuning().claim.family_confidence, figures)
}

fn logistic([constant, coefficients @ ..]: &[f64; 12], figures: &Figures) -> f64 {
    let sum: f64 = coefficients.iter().zip(figures.list()).map(|(a, x)| a * x).sum();
    1.0 / (1.0 + (-(constant + sum)).exp())
}
