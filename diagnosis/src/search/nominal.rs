//! The nominal model: refitted, and coupled to the measured motion where it stays far from the noise.

use super::result::SearchError;
use super::share::Work;
use crate::belief::statistics::{correlation_time, deviation_by_median, levels, whiteness_statistic};
use crate::hypothesis::{Run, Scales};
use crate::output_error::candidate::{Candidate, candidate, white};
use crate::output_error::coupling::Coupling;
use crate::output_error::effort::Effort;
use crate::output_error::error_budget::of_driving_motion;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::Budget;
use crate::recordings::noise;
use crate::recordings::problem::{Problem, Record};
use crate::search::excerpts::Excerpts;
use crate::search::screen::worst_records;
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model};

/// The nominal model refitted, and what was learnt of the recordings by it.
pub(super) struct Nominal<'a> {
    /// Holds fits against the recordings, with the measuring error estimated from the residual of the refit.
    pub evaluator: Evaluator<'a>,
    /// The stated parameters as given.
    pub given: Vec<f64>,
    /// The same as a structure takes them.
    pub start: Vec<f64>,
    /// The refit.
    pub refitted: Candidate,
    /// Level of each output with the parameters as given, noise standard deviations.
    pub levels_given: Vec<f64>,
    /// The refitted model, before it was coupled.
    pub model: Model,
    /// How far it moves.
    pub scales: Scales,
    /// The recordings, with what was found of inputs that nobody measured.
    pub seen: Vec<Record>,
    /// Whether it stays so far from the noise that its end waits until the rest is known.
    pub is_far: bool,
    /// Whether it stays far enough for fits to start coupled to the measured motion.
    pub far: bool,
    /// Whether forces couple it to the measured motion.
    pub pulled: bool,
    /// Whether anything does: forces, or a motion that is prescribed.
    pub coupled_first: bool,
    /// The coupled model.
    pub coupled: CoupledNominal<'a>,
}

/// The nominal model coupled to the measured motion, or free where nothing couples it.
pub(super) struct CoupledNominal<'a> {
    /// What it is held against, whole.
    pub coarse: Evaluator<'a>,
    /// Excerpts of the recordings that are enough.
    pub parts: Option<Excerpts>,
    /// Its parameters there.
    pub fit: Fit,
}

/// How the nominal model is coupled to the measured motion.
struct Coupler<'p, 'a> {
    evaluator: &'p Evaluator<'a>,
    middle: &'p Evaluator<'a>,
    structure: &'p Structure,
    /// The coupling at its full strength.
    firm: &'p Coupling,
    far: bool,
    pulled: bool,
    coupled_first: bool,
}

impl<'a> Coupler<'_, 'a> {
    /// The nominal model coupled, from some values. The coupling gain is `strength` times the full one. Only excerpts of the recordings are used where
    /// those are enough.
    fn couple(&self, from: &[f64], strength: f64, in_parts: bool) -> Option<CoupledNominal<'a>> {
        let (evaluator, structure, fit) = (self.evaluator, self.structure, &tuning().fit);
        let coupling = self.pulled.then(|| self.firm.with(strength * self.firm.strength));
        let coarse = Evaluator { substeps: evaluator.problem.coarse_substeps(), widest: fit.widest_midway, coupling, ..evaluator.clone() };
        let view = if self.pulled { Effort { steps: 0, ..fit.nominal_view } } else { fit.nominal_view };
        let at = coarse.fit(structure, from, view)?;
        // The parts with the largest residuals are enough for screening; coupled, they begin as they were measured.
        let parts = if self.far && in_parts { Excerpts::of(&coarse, structure, &at, tuning().screening.samples) } else { None };
        let base = match &parts {
            _ if !self.coupled_first => None,
            Some(parts) => parts.evaluator(&coarse).fit(structure, &at.values, fit.nominal_coupled),
            None => coarse.fit(structure, &at.values, fit.nominal_coupled),
        };
        Some(CoupledNominal { coarse, parts, fit: base.unwrap_or(at) })
    }

    /// A refit from the parameters of the coupled fit; `None` where it is no better than the other.
    fn refit_from(&self, values: &[f64], other: &Fit, effort: Effort) -> Option<Fit> {
        let there = self.middle.residuals(self.structure, values)?;
        let again = worst_first(self.middle, self.structure, values, &there, tuning().fit.nominal_first)?;
        if again.cost >= tuning().claim.refit_gains * other.cost {
            return None;
        }
        self.evaluator.fit(self.structure, &again.values, effort).filter(|fit| fit.cost < other.cost)
    }

    /// Where the coupled nominal model explains the recordings, all effects look equally good. So other coupling gains are tried, until the residual is
    /// large enough.
    fn until_it_shows(&self, mut coupled: CoupledNominal<'a>, refitted: &Fit) -> CoupledNominal<'a> {
        let left = |fit: &Fit| fit.cost / fit.residuals.len().max(1) as f64;
        let enough = tuning().search.coupled_leaves_noise.min(tuning().search.coupled_leaves * left(refitted));
        // On parts the parameters may absorb the differences from one part to the next: the first time only.
        for (nth, strength) in tuning().search.couplings.iter().enumerate() {
            if left(&coupled.fit) > enough {
                break;
            }
            if let Some(other) = self.couple(&coupled.fit.values, *strength, nth == 0) {
                coupled = other;
            }
        }
        coupled
    }
}

impl<'a> Nominal<'a> {
    /// Refits the nominal model, and couples it to the measured motion where it stays far from the noise.
    pub fn refitted(problem: &'a Problem, work: &Work<'a>, report: &(dyn Fn(&str) + Sync)) -> Result<Nominal<'a>, SearchError> {
        report("refitting the nominal model");
        let structure = Structure::new(problem, &problem.fit, Vec::new());
        let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
        let start = structure.values(problem, &given, &[], &[]);
        let FirstFit { evaluator, fit, levels_given, is_far } =
            FirstFit::of(problem, work, &structure, &start).ok_or(SearchError::RunsAway)?;
        let middle = at_middle(&evaluator);
        let effort = if is_far { tuning().fit.nominal_far } else { tuning().fit.to_the_end };
        let mut refitted = evaluator.fit(&structure, &fit.values, effort).ok_or(SearchError::RunsAway)?;
        // Far from the noise the residuals coupled to the measured motion show better than those of a simulation what is missing, and coupled fits
        // leave wrong valleys.
        let model = structure.model(problem, &refitted.values).ok_or(SearchError::RunsAway)?;
        let seen = structure.with_unknown(problem, &problem.fit, &refitted.values);
        let scales = scales(problem, &model, &seen)?;
        let level = levels(&evaluator, &refitted.residuals).into_iter().fold(0.0, f64::max);
        let strength = if level > tuning().coupling.full_above * tuning().noise.far { 1.0 } else { tuning().coupling.weak };
        let firm = Coupling::new(problem, &problem.fit, &scales, &evaluator.noise_sd, strength);
        let far = level > tuning().noise.far;
        // An observer couples it by itself.
        let pulled = far && !firm.is_empty() && problem.inverse.is_none();
        // A prescribed motion couples the device by itself.
        let coupled_first = pulled || far && problem.model.inputs.iter().any(|i| i.kind == InputKind::Motion);
        let coupler = Coupler { evaluator: &evaluator, middle: &middle, structure: &structure, firm: &firm, far, pulled, coupled_first };
        let from = if pulled { &start } else { &refitted.values };
        let mut coupled = coupler.couple(from, 1.0, true).ok_or(SearchError::RunsAway)?;
        if pulled && let Some(other) = coupler.refit_from(&coupled.fit.values, &refitted, effort) {
            refitted = other;
        }
        refitted = to_its_end(&evaluator, &structure, refitted);
        let within = evaluator.within(work.budget.extended(work.budget.spent() + work.share(tuning().search.few_first)));
        if let Some(other) = few_first(&within, &structure, &start, &refitted) {
            refitted = other;
        }
        if pulled {
            coupled = coupler.until_it_shows(coupled, &refitted);
        }
        let refitted = candidate(&evaluator, structure.clone(), refitted);
        Ok(Nominal { evaluator, given, start, refitted, levels_given, model, scales, seen, is_far, far, pulled, coupled_first, coupled })
    }
}

/// The nominal model's first fit, and the noise estimated from its residuals.
struct FirstFit<'a> {
    evaluator: Evaluator<'a>,
    fit: Fit,
    /// Normalised residual (rms) of each output with the parameters as given.
    levels_given: Vec<f64>,
    is_far: bool,
}

impl<'a> FirstFit<'a> {
    fn of(problem: &'a Problem, work: &Work<'a>, structure: &Structure, start: &[f64]) -> Option<FirstFit<'a>> {
        let mut evaluator = Evaluator::new(problem);
        evaluator.budget = work.up_to(tuning().search.last_step);
        // Noise and rounding of a motion that drives the model are errors like noise of what is predicted from it; the residuals say how large they are.
        for (noise_sd, driven) in evaluator.noise_sd.iter_mut().zip(of_driving_motion(&problem.model, &problem.fit)) {
            *noise_sd = noise_sd.hypot(driven);
        }
        if friction_on_prescribed(problem) {
            evaluator.robust = tuning().fit.robust;
        }
        let first = evaluator.residuals(structure, start)?;
        let fit = worst_first(&at_middle(&evaluator), structure, start, &first, tuning().fit.nominal_first)?;
        // The residuals of a fit show the noise better than the signal does.
        let before = evaluator.noise_sd.clone();
        evaluator.noise_sd = floors(&evaluator, &fit.residuals);
        if evaluator.robust.is_finite() {
            // Large is what is large beside the rest, which far from the noise is far from the noise itself.
            evaluator.robust = tuning().fit.robust * bulk(&fit.residuals, &before, &evaluator).max(1.0);
        }
        let rescaled = |residuals: &[f64]| -> Vec<f64> {
            levels(&evaluator, residuals).iter().zip(before.iter().zip(&evaluator.noise_sd)).map(|(l, (b, f))| l * b / f).collect()
        };
        let levels_given = rescaled(&first);
        let is_far = rescaled(&fit.residuals).iter().any(|l| *l > tuning().noise.very_far);
        Some(FirstFit { evaluator, fit, levels_given, is_far })
    }
}

fn at_middle<'a>(evaluator: &Evaluator<'a>) -> Evaluator<'a> {
    Evaluator { substeps: evaluator.problem.middle_substeps(), ..evaluator.clone() }
}

/// How far a model moves on the recordings.
fn scales(problem: &Problem, model: &Model, seen: &[Record]) -> Result<Scales, SearchError> {
    let runs: Vec<Run> = seen.iter().map(Run::from).collect();
    let largest = |output: usize| {
        let samples = problem.fit.iter().filter_map(|r| r.outputs.get(output)?.as_deref()).flatten();
        samples.fold(0.0_f64, |most, y| most.max(y.abs()))
    };
    let measured: Vec<f64> = (0..model.outputs.len()).map(largest).collect();
    Ok(Scales::of(model, &runs)?.with_measured(model, &measured))
}

/// A fit on the recordings that are explained worst first, where there are many samples, then on all; so many steps on either. `there` are
/// the residuals at the start.
fn worst_first(evaluator: &Evaluator, structure: &Structure, start: &[f64], there: &[f64], steps: [usize; 2]) -> Option<Fit> {
    let problem = evaluator.problem;
    let own_numbers = structure.free.iter().any(|n| n.records.is_some());
    let worst = worst_records(evaluator, there, 2);
    let effort = |steps: usize| Effort { steps, ..tuning().fit.nominal_far };
    if own_numbers || there.len() < tuning().screening.samples || 2 * worst.len() > problem.fit.len() {
        return evaluator.fit(structure, start, effort(steps[0]));
    }
    let some: Vec<Record> = worst.iter().map(|r| problem.fit[*r].clone()).collect();
    let few = Evaluator { records: &some, ..evaluator.clone() };
    let first = few.fit(structure, start, effort(steps[0]))?;
    evaluator.fit(structure, &first.values, effort(steps[1]))
}

/// Standard deviation by the median of the residuals of a fit whose noise standard deviations were `before`, normalised by the present ones.
fn bulk(residuals: &[f64], before: &[f64], evaluator: &Evaluator) -> f64 {
    let mut sizes: Vec<f64> = Vec::with_capacity(residuals.len());
    for (_, output, range) in evaluator.layout() {
        let scale = before[output] / evaluator.noise_sd[output];
        sizes.extend(residuals.get(range).unwrap_or(&[]).iter().map(|r| scale * r.abs()));
    }
    if sizes.is_empty() { 1.0 } else { deviation_by_median(&mut sizes) }
}

/// Whether dry friction acts on a body whose motion is prescribed: its force then jumps with the sign of a measured motion.
fn friction_on_prescribed(problem: &Problem) -> bool {
    use backdrive_plant::model::{InputKind, OutputKind};
    problem
        .model
        .inputs
        .iter()
        .any(|i| i.kind == InputKind::Motion && problem.model.outputs.iter().any(|o| o.kind == OutputKind::Reaction(i.on)))
}

/// Noise standard deviations by the residual of a fit, never above what the signals showed.
fn floors(evaluator: &Evaluator, residuals: &[f64]) -> Vec<f64> {
    let problem = evaluator.problem;
    let layout = evaluator.layout();
    (0..problem.model.outputs.len())
        .map(|output| {
            let parts: Vec<&[f64]> = layout.iter().filter(|l| l.1 == output).filter_map(|l| residuals.get(l.2.clone())).collect();
            let signals: Vec<&[f64]> = problem.fit.iter().filter_map(|r| r.outputs.get(output)?.as_deref()).collect();
            let own = evaluator.noise_sd[output];
            let least = noise::stated(&problem.model, output, &signals);
            let spread = problem.fit.iter().filter_map(|r| r.spread.get(output)).fold(0.0f64, |a, b| a.max(*b));
            if parts.is_empty() {
                own
            } else {
                (own * noise::of_residuals(&parts, least / own, 0.0)).max(tuning().recordings.least_noise * spread).min(own)
            }
        })
        .collect()
}

/// Usually only a few parameters are wrong. So the one, and the two, that explain most while all others are as given are fitted first, and then all.
/// Strongly correlated parameters drive a full refit into a local minimum. `None` where the refit leaves white noise, or is no worse.
fn few_first(evaluator: &Evaluator, structure: &Structure, start: &[f64], refitted: &Fit) -> Option<Fit> {
    let white = |fit: &Fit| white(correlation_time(evaluator, &fit.residuals), whiteness_statistic(evaluator, &fit.residuals));
    let stated: Vec<&Role> = structure.free.iter().map(|n| &n.role).filter(|role| matches!(role, Role::Stated(_))).collect();
    if stated.len() < 2 || white(refitted) {
        return None;
    }
    let middle = at_middle(evaluator);
    let with = |budget: &Budget, (only, from): &(Vec<Role>, Vec<f64>)| {
        let some = Evaluator { only: Some(only.clone()), ..middle.within(budget.clone()) };
        Some((only.clone(), some.fit(structure, from, tuning().fit.middle)?))
    };
    let mut best: Option<(Vec<Role>, Fit)> = None;
    for _ in 0..2 {
        let (before, from) = best.as_ref().map_or((Vec::new(), start.to_vec()), |(only, fit)| (only.clone(), fit.values.clone()));
        let next = stated.iter().filter(|role| !before.contains(role));
        let tries: Vec<(Vec<Role>, Vec<f64>)> = next.map(|role| ([before.as_slice(), &[(*role).clone()]].concat(), from.clone())).collect();
        let fits = middle.budget.abreast(&tries, with);
        let found = fits.into_iter().flatten().flatten().min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))?;
        best = Some(found);
        // All from there: that is what counts.
        let all = best.as_ref().and_then(|(_, fit)| evaluator.fit(structure, &fit.values, tuning().fit.to_the_end));
        if let Some(fit) = all.filter(|fit| fit.cost < (1.0 - tuning().fit.relative_tolerance) * refitted.cost) {
            return Some(to_its_end(evaluator, structure, fit));
        }
    }
    None
}

/// Near the noise the end of a fit counts: the residual short of it looks like a missing effect.
pub(super) fn to_its_end(evaluator: &Evaluator, structure: &Structure, fit: Fit) -> Fit {
    let near = levels(evaluator, &fit.residuals).iter().all(|l| *l < tuning().noise.far);
    if !near || white(correlation_time(evaluator, &fit.residuals), whiteness_statistic(evaluator, &fit.residuals)) {
        return fit;
    }
    let ended = evaluator.fit_from_derivatives(structure, &fit.values, tuning().fit.to_the_end, Some((structure, &fit)));
    ended.filter(|e| e.cost < fit.cost).unwrap_or(fit)
}
