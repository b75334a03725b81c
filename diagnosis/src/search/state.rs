//! What a search has to go by, and what it has found so far.

use super::journal::{Entry, Outcome};
use super::result::Tried;
use super::share::Work;
use super::view::View;
use crate::hypothesis::Hypothesis;
use crate::output_error::candidate::{Candidate, advantage_over, done, key_of, sort};
use crate::output_error::structure::Structure;
use crate::search::race::{Course, Seed, distinct};
use crate::tuning::tuning;
use std::collections::HashSet;

/// What is tried, and what was found.
pub(super) struct State<'s, 'a> {
    /// What structures are fitted against, and from where.
    pub course: Course<'s>,
    /// What screening sees: from the base coupled to the measured motion, then from others.
    pub views: &'s [View<'a>],
    /// What screening promised.
    pub tried: &'s [Tried],
    /// Ripples that stand alone, and where they start.
    pub ripples: &'s [(usize, Vec<f64>)],
    /// Whether the nominal model stays far from the noise.
    pub far: bool,
    /// How much time there is.
    pub work: &'s Work<'s>,
    /// What was found, best first.
    pub found: Vec<Candidate>,
    /// Single effects, what promises most first.
    pub singles: std::vec::IntoIter<Seed>,
    /// Laws that have one parameter more than the nominal model.
    pub one_parameter: std::vec::IntoIter<Seed>,
    /// Effects at once.
    pub effects: usize,
    /// Substeps that blur less than the residual.
    pub fine: usize,
    /// The best whose relatives were tried.
    pub related: String,
    /// The law that other places were tried for.
    pub moved_about: String,
    /// Whether the work did not suffice for something that was wanted.
    pub left_out: bool,
    /// What was done.
    pub journal: Vec<Entry>,
}

impl<'s, 'a> State<'s, 'a> {
    /// Nothing tried yet.
    pub fn new(
        course: Course<'s>,
        views: &'s [View<'a>],
        tried: &'s [Tried],
        ripples: &'s [(usize, Vec<f64>)],
        far: bool,
        work: &'s Work<'s>,
    ) -> State<'s, 'a> {
        let none = || Vec::new().into_iter();
        let (singles, one_parameter) = (none(), none());
        let (related, moved_about) = (String::new(), String::new());
        let mut all = State {
            course,
            views,
            tried,
            ripples,
            far,
            work,
            found: Vec::new(),
            singles,
            one_parameter,
            effects: 1,
            fine: course.coarse,
            related,
            moved_about,
            left_out: false,
            journal: Vec::new(),
        };
        all.singles = all.promising().into_iter();
        all.one_parameter = all.of_one_number().into_iter();
        all
    }

    /// At the noise only what promises more than chance is worth a fit.
    pub fn is_quiet(&self) -> bool {
        self.course.nominal.is_white() || self.course.nominal.levels.iter().all(|l| *l < tuning().noise.at_noise)
    }

    /// Share of the misfit that the best of many hypotheses promises by chance.
    pub fn chance(&self) -> f64 {
        tuning().screening.chance * self.course.nominal.correlation_time / self.samples() as f64
    }

    /// Number of residuals.
    pub fn samples(&self) -> usize {
        self.course.nominal.fit.residuals.len()
    }

    /// Whether fits begin coupled to the measured motion.
    pub fn is_coupled(&self) -> bool {
        self.course.along.is_some()
    }

    /// Whether the best leaves nothing that another effect could explain.
    pub fn is_done(&self) -> bool {
        done(&self.found, self.course.nominal, self.samples())
    }

    /// Whether the best leaves as much as the noise and more, so that another effect may be what is missing.
    pub fn leaves_much(&self) -> bool {
        self.found.first().is_none_or(|c| c.fit.cost > tuning().noise.near * self.samples() as f64)
    }

    /// Whether the best could be claimed at all: only then rivals have to be beaten.
    pub fn may_be_claimed(&self) -> bool {
        let (nominal, claim) = (self.course.nominal, &tuning().claim);
        let beats = |c: &Candidate| {
            c.fit.cost < (1.0 - claim.least_share) * nominal.fit.cost && advantage_over(nominal, c, self.samples()) > claim.least_advantage
        };
        self.found.first().is_some_and(beats)
    }

    /// What the best adds.
    pub fn best(&self) -> String {
        self.found.first().map_or_else(String::new, |c| key_of(&c.structure.added))
    }

    /// Single effects, what promises most first.
    fn promising(&self) -> Vec<Seed> {
        let (quiet, chance) = (self.is_quiet(), self.chance());
        let mut singles: Vec<Seed> = Vec::new();
        for rank in 0..tuning().search.ranks_coupled.max(tuning().search.ranks_uncoupled) {
            for view in self.views {
                let mut used = HashSet::new();
                let Some(promise) = view.simple.iter().filter(|p| used.insert(p.hypothesis)).nth(rank) else { continue };
                // Those that promise little beside the best wait.
                let top = view.simple.first().map_or(0.0, |p| p.share);
                let wanted = if quiet {
                    rank < tuning().search.ranks_uncoupled && promise.share > chance
                } else {
                    rank < tuning().search.ranks_always
                        || rank < if self.is_coupled() { tuning().search.ranks_coupled } else { tuning().search.ranks_uncoupled }
                            && promise.share > tuning().search.promise * top
                };
                if wanted {
                    singles.push(view.seed(vec![(promise.hypothesis, promise.values.clone())]));
                }
            }
        }
        distinct(&mut singles);
        singles
    }

    /// To first order a law may do no more than the nominal model's parameters do together, so that screening does not detect it. It may still be the
    /// missing effect. So, where the residual is small, all laws that add one parameter are fitted, whatever their screening value.
    fn of_one_number(&self) -> Vec<Seed> {
        let Some(view) = self.views.first().filter(|_| !self.far) else { return Vec::new() };
        let (problem, known) = (self.course.evaluator.problem, self.course.nominal.structure.free.len());
        let one = |(index, h): (usize, &Hypothesis)| {
            let more = Structure::new(problem, &problem.fit, vec![h.clone()]).free.len().saturating_sub(known);
            Some(view.seed(vec![(index, h.starts.first().filter(|_| more == 1)?.clone())]))
        };
        self.course.hypotheses.iter().enumerate().filter_map(one).collect()
    }

    /// Notes what became of a step.
    pub fn note(&mut self, step: &'static str, outcome: Outcome) {
        let best = self.found.first().unwrap_or(self.course.nominal);
        let residual = (best.fit.cost / self.samples().max(1) as f64).sqrt();
        self.journal.push(Entry { step, outcome, best: key_of(&best.structure.added), residual });
    }

    /// Takes fitted structures in, best first.
    pub fn take(&mut self, fitted: Vec<Candidate>) {
        let samples = self.samples();
        self.found.extend(fitted);
        sort(&mut self.found, samples);
    }
}
