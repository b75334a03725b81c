//! What screening sees, and what would have been seen.

use super::result::Detectable;
use crate::hypothesis::{Family, Hypothesis};
use crate::locate::{self, Ripple};
use crate::output_error::candidate::{Candidate, candidate};
use crate::output_error::effort::Effort;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::Structure;
use crate::output_error::work::Steps;
use crate::recordings::problem::Record;
use crate::search::excerpts::Excerpts;
use crate::search::race::Seed;
use crate::search::screen::{Promise, Screen, pairs};
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use std::collections::HashSet;

/// What screening sees from one base.
pub(super) struct View<'a> {
    pub screen: Screen,
    /// What it looks at: the recordings, or parts of them.
    pub evaluator: Evaluator<'a>,
    /// The nominal model there.
    pub base: Candidate,
    /// Whether it is coupled to the measured motion.
    pub coupled_first: bool,
    /// Whether its residuals are those of the recordings, whole and without a coupling.
    pub whole: bool,
    pub simple: Vec<Promise>,
    /// Physics of many parameters come in where simpler relatives do not suffice.
    pub rich: Vec<Promise>,
}

impl<'a> View<'a> {
    pub fn of(
        evaluator: &Evaluator<'a>,
        parts: Option<&'a Excerpts>,
        (structure, fit): (&Structure, Fit),
        hypotheses: &[Hypothesis],
        work: Steps,
        coupled_first: bool,
    ) -> View<'a> {
        let on = parts.map_or_else(|| evaluator.clone(), |p| p.evaluator(evaluator));
        let there = parts.and_then(|_| on.fit(structure, &fit.values, Effort { steps: 0, tolerance: 1.0 }));
        // A part that cannot be simulated is none.
        let (on, whole, fit) = match (parts, there) {
            (Some(_), Some(there)) => (on, false, there),
            _ => (evaluator.clone(), evaluator.coupling.is_none(), fit),
        };
        let screen = Screen::new(&on, structure, &fit, hypotheses, work);
        let promises = screen.look(&fit, &|_| true);
        let (simple, rich) = promises.into_iter().partition(|p| hypotheses[p.hypothesis].parameters.len() <= tuning().screening.parameters);
        View { screen, base: candidate(&on, structure.clone(), fit), evaluator: on, coupled_first, whole, simple, rich }
    }

    /// Effects beside the parameters of its base.
    pub fn seed(&self, effects: Vec<(usize, Vec<f64>)>) -> Seed {
        Seed::beside(self.evaluator.problem, (&self.base.structure, &self.base.fit.values), effects, self.coupled_first)
    }

    /// The most promising pairs.
    pub fn pairs(&self, hypotheses: &[Hypothesis], count: usize) -> Vec<Seed> {
        let simple = &self.simple;
        let compatible = |a: usize, b: usize| hypotheses[a].compatible(&hypotheses[b]);
        let together = pairs(simple, &self.base.fit, &self.base.fit.jacobian, tuning().screening.pairs_among, compatible);
        let mut used = HashSet::new();
        let best = together.iter().filter(|(a, b, _)| used.insert((simple[*a].hypothesis, simple[*b].hypothesis)));
        let pair = |a: usize, b: usize| [a, b].map(|p| (simple[p].hypothesis, simple[p].values.clone())).to_vec();
        let seed = |(a, b, _): &(usize, usize, f64)| self.seed(pair(*a, *b));
        best.take(count).map(seed).collect()
    }
}

/// A ripple shows in a force over displacement, at whatever period, but fits only start from a few periods. Where locating finds one, a fit starts there.
/// Returns the ripples that stand alone in the spectrum of their force, with their start values, the largest share first: gaps and friction make many
/// lines.
pub(crate) fn ripples(records: &[Record], model: &Model, noise_sd: &[f64], hypotheses: &mut [Hypothesis]) -> Vec<(usize, Vec<f64>)> {
    let runs: Vec<locate::Run> = records.iter().map(locate::Run::from).collect();
    let options = locate::Options { most_samples: tuning().screening.ripple_samples, laws_of_a_form: 0, ..locate::Options::quick() };
    // Where the model cannot be located in, fits start from the usual periods.
    let Ok(location) = locate::locate(model, &runs, noise_sd, &options) else { return Vec::new() };
    let mut alone: Vec<(f64, usize, Vec<f64>)> = Vec::new();
    for place in &location.ranking {
        for (index, h) in
            hypotheses.iter_mut().enumerate().filter(|(_, h)| h.physics.family == Family::Ripple && h.place.same(&place.place))
        {
            let start = |r: &Ripple| vec![r.amplitude, r.period, r.phase];
            let inside = |start: &Vec<f64>| start.iter().zip(&h.parameters).all(|(x, p)| (p.range.0..=p.range.1).contains(x));
            let next = place.ripples.get(1).map_or(0.0, |r| r.share);
            let first = place
                .ripples
                .first()
                .filter(|r| r.prominence > tuning().screening.ripple_prominence && r.share > tuning().screening.ripple_alone * next);
            alone.extend(first.map(|r| (r.share, index, start(r))).filter(|(_, _, start)| inside(start)));
            let new: Vec<Vec<f64>> = place.ripples.iter().map(start).filter(inside).collect();
            h.starts.splice(0..0, new);
        }
    }
    alone.sort_by(|a, b| b.0.total_cmp(&a.0));
    alone.into_iter().map(|(_, index, start)| (index, start)).collect()
}

/// Physics whose effect grows in proportion to their first parameter: what an effect is worth claiming, at the place where the least is enough.
pub(super) fn detectable(view: &View, samples: usize, hypotheses: &[Hypothesis]) -> Vec<Detectable> {
    let base = &view.base;
    // All of the recordings show what their parts do, and more.
    let more = samples as f64 / base.fit.residuals.len().max(1) as f64;
    let effective = (samples as f64 / base.correlation_time).max(2.0);
    let needed =
        (tuning().claim.least_advantage + effective.ln()) * base.correlation_time * base.fit.cost / base.fit.residuals.len().max(1) as f64;
    let mut found: Vec<Detectable> = Vec::new();
    for (index, length) in view.screen.lengths(&base.fit) {
        let h = &hypotheses[index.0];
        let (Some(parameter), Some(value)) = (h.parameters.first(), index.1.first()) else { continue };
        let size = value.abs() * (needed / (more * length * length)).sqrt();
        if !h.physics.facts.proportional || !size.is_finite() || parameter.neutral != Some(0.0) {
            continue;
        }
        let new =
            Detectable { physics: h.physics.name, place: h.place.clone(), key: parameter.key.clone(), size, unit: parameter.unit.clone() };
        match found.iter_mut().find(|d| d.physics == h.physics.name) {
            Some(d) if d.size <= size => {}
            Some(d) => *d = new,
            None => found.push(new),
        }
    }
    found
}
