//! What is claimed of a search, in one word, and what that rests on.

use super::choice::{alike, chosen, evidence};
use crate::belief::intervals::Uncertainty;
use crate::belief::statistics::advantage;
use crate::equation_error::OnForces;
use crate::output_error::candidate::Candidate;
use crate::output_error::error_budget::beside_noise;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::{FreeParameter, Role, Structure};
use crate::recordings::problem::Problem;
use crate::recordings::repeatability::floors;
use crate::search::Search;
use crate::tuning::tuning;
use crate::verdict::findings::{findings, is_timing_of};
use crate::verdict::signals::bursts;
use crate::verdict::types::{Finding, Word};

/// What is claimed.
pub(crate) struct Decision<'s> {
    /// The verdict.
    pub(crate) word: Word,
    /// The structure that explains best what it may.
    pub(crate) best: &'s Candidate,
    /// How sure its parameters are.
    pub(crate) spread: Uncertainty,
    /// What it adds, most important first.
    pub(crate) findings: Vec<Finding>,
    /// Structures that cannot be distinguished from it.
    pub(crate) alike: Vec<&'s Candidate>,
    /// Times at which a sensor is far off, s.
    pub(crate) bursts: Vec<[f64; 2]>,
    /// Whether what is left is as small as the sensors' noise, or as what the device does not repeat.
    pub(crate) at_floor: bool,
    /// Root mean square of what is left on the held-out recordings, noise standard deviations, where that is far more than on the fitted ones.
    pub(crate) unseen: Option<f64>,
    /// What the device does not repeat at each output, noise standard deviations; 1 where nothing was repeated.
    pub(crate) floors: Vec<f64>,
    /// Whether the model's text is to hold the fitted parameters.
    pub(crate) changes: bool,
    /// Why nothing is claimed as likelier than not, where something was found.
    pub(crate) doubt: Option<Doubt>,
    /// Share of the force that none of the laws explains, where they were looked at on forces: what counts as noise there.
    pub(crate) left_of_force: Option<f64>,
    /// Result of the search on forces, where there was one.
    pub(crate) forces: Option<&'s OnForces>,
}

/// Why what was found is as likely as not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Doubt {
    /// The model as given predicts held-out recordings better.
    WorseThanGiven,
    /// The refitted nominal model predicts them better.
    WorseThanRefit,
    /// The model as given simulates the motion of held-out recordings better.
    WorseSimulated,
    /// A parameter is at an end of what the fit may try.
    AtAnEnd,
}

/// Marks structures of which an effect, by its own interval, may be nothing, as long as one of those would be claimed: what is claimed then has none.
pub fn without_what_may_be_nothing(problem: &Problem, search: &mut Search) {
    let evaluator = Evaluator { noise_sd: search.noise_sd.clone(), ..Evaluator::new(problem) };
    for _ in 0..search.found.len() {
        let best = chosen(search);
        if best.structure.added.is_empty() {
            return;
        }
        let mut spread = Uncertainty::measured(&evaluator, best);
        spread.beside(best, &near(search, best));
        if !(0..best.structure.added.len()).any(|which| may_be_nothing(best, &spread, which)) {
            return;
        }
        let name = best.structure.name();
        for c in search.found.iter_mut().filter(|c| c.structure.name() == name) {
            c.may_be_nothing = true;
        }
    }
}

/// Whether an effect may be nothing. The interval of its size, and of each other parameter that can cancel the effect, then contains the neutral value.
fn may_be_nothing(best: &Candidate, spread: &Uncertainty, which: usize) -> bool {
    let Some(hypothesis) = best.structure.added.get(which) else { return false };
    let holds = |(number, n): (usize, &FreeParameter)| {
        let Role::Added(h, p) = n.role else { return None };
        let parameter = hypothesis.parameters.get(p).filter(|_| h == which)?;
        let neutral = parameter.neutral?;
        let [low, high] = spread.interval(best, number);
        Some((parameter.key == hypothesis.physics.size && parameter.index.is_none(), low <= neutral && neutral <= high))
    };
    let all: Vec<(bool, bool)> = best.structure.free.iter().enumerate().filter_map(holds).collect();
    all.iter().any(|(is_size, _)| *is_size) && all.iter().all(|(_, held)| *held)
}

/// Decides.
pub(crate) fn decide<'s>(problem: &Problem, search: &'s Search) -> Decision<'s> {
    let best = chosen(search);
    let evaluator = Evaluator { noise_sd: search.noise_sd.clone(), ..Evaluator::new(problem) };
    let mut spread = Uncertainty::measured(&evaluator, best);
    spread.beside(best, &near(search, best));
    let floors = floors(problem, &search.noise_sd);
    let no_physics = beside_noise(&search.errors);
    let beyond = |level: f64, limit: f64| level * level > limit * limit + no_physics;
    let at_floor = best.levels.iter().zip(&floors).all(|(level, floor)| !beyond(*level, tuning().noise.unexplained * floor));
    let unseen = far_on_unseen(best, &floors);
    let at_floor = at_floor && unseen.is_none();
    let added = !best.structure.added.is_empty();
    let claims = (0..best.structure.added.len()).any(|which| !is_timing_of(problem, best, which));
    let bursts = bursts(problem, best);
    let alike = alike(search, best);
    let nominal = &search.nominal;
    let off = given_is_off(problem, search) && (added || spread.is_far(nominal, &stated_in(problem, &nominal.structure)));
    let wanders =
        best.whiteness_statistic > tuning().claim.wanders && best.levels.iter().any(|level| beyond(*level, tuning().noise.at_noise));
    let findings = findings(problem, search, best, &spread);
    let is_outdone = findings.first().is_some_and(Finding::has_likelier_rival);
    let left_of_force = search.forces.as_ref().map(|_| left_of_force(problem, search) * best.levels.iter().fold(0.0f64, |a, b| a.max(*b)));
    let word = match () {
        () if claims && (!alike.is_empty() || is_outdone) => Word::Ambiguous,
        () if claims => Word::Missing,
        () if !bursts.is_empty() => Word::Unexplained,
        () if unseen.is_some() => Word::Unexplained,
        () if left_of_force.is_some_and(|share| share > tuning().equation_error.much_left) => Word::Unexplained,
        () if search.forces.is_none() && (!at_floor && best.correlation_time > tuning().claim.correlated || wanders) => Word::Unexplained,
        () if off => Word::Parameters,
        () if left_of_force.is_none() && !is_excited(problem, search) => Word::CannotTell,
        () => Word::NothingMissing,
    };
    Decision {
        word,
        best,
        spread,
        findings,
        alike,
        bursts,
        at_floor,
        unseen,
        floors,
        changes: off || added,
        doubt: None,
        left_of_force,
        forces: search.forces.as_ref(),
    }
}

/// Share of the force that counts as noise, of its standard deviation in the fitted recordings.
fn left_of_force(problem: &Problem, search: &Search) -> f64 {
    let one = |(output, noise_sd): (usize, &f64)| {
        let measured = problem.fit.iter().filter(|r| r.outputs.get(output).is_some_and(Option::is_some));
        let spread = measured.filter_map(|r| r.spread.get(output)).fold(0.0f64, |a, b| a.max(*b));
        (spread > 0.0).then(|| noise_sd / spread)
    };
    search.noise_sd.iter().enumerate().filter_map(one).fold(0.0, f64::max)
}

/// Root mean square of what a candidate leaves on the held-out recordings, where that is far beyond the noise and beyond what it leaves on the fitted ones.
/// Parameters may adapt to the recordings that they are fitted to, and the resulting error shows on other recordings.
fn far_on_unseen(best: &Candidate, floors: &[f64]) -> Option<f64> {
    let unseen = best.unseen.as_ref()?.mean_square.sqrt();
    let most = best.levels.iter().chain(floors).fold(1.0f64, |a, b| a.max(*b));
    (unseen > tuning().claim.far_on_unseen * most).then_some(unseen)
}

/// Structures of as many effects, and what each weighs beside the best, 0 to 1.
fn near<'s>(search: &'s Search, best: &Candidate) -> Vec<(&'s Candidate, f64)> {
    let weight = |c: &Candidate| (-evidence(search, c, best).max(0.0) / tuning().claim.softened).exp();
    let others = search
        .found
        .iter()
        .filter(|c| c.structure.added.len() == best.structure.added.len() && c.structure.name() != best.structure.name());
    others.map(|c| (c, weight(c))).filter(|(_, weight)| *weight > 1e-3).collect()
}

/// Whether the refitted parameters explain more than the given ones do.
fn given_is_off(problem: &Problem, search: &Search) -> bool {
    let each: Vec<f64> = search.levels_given.clone();
    let total: usize = problem.fit.iter().map(|r| crate::output_error::evaluator::measured(r).map(|_| r.len).sum::<usize>()).sum();
    let mut cost = 0.0;
    for record in &problem.fit {
        for output in crate::output_error::evaluator::measured(record) {
            cost += each.get(output).map_or(0.0, |l| l * l) * record.len as f64;
        }
    }
    let refit = &search.nominal;
    let numbers = refit.structure.free.len();
    advantage(cost, 0, refit.fit.cost, numbers, total, refit.correlation_time) > 0.0 && refit.fit.cost < tuning().claim.refit_gains * cost
}

/// Where the stated parameters are among a structure's, and their values in the nominal file.
fn stated_in(problem: &Problem, structure: &Structure) -> Vec<(usize, f64)> {
    let one = |(place, number): (usize, &FreeParameter)| match number.role {
        Role::Stated(i) => Some((place, problem.stated.get(i)?.given)),
        _ => None,
    };
    structure.free.iter().enumerate().filter_map(one).collect()
}

/// Whether the recordings move the device by more than the measuring error.
fn is_excited(problem: &Problem, search: &Search) -> bool {
    let moves = |(output, noise_sd): (usize, &f64)| {
        problem
            .fit
            .iter()
            .any(|r| r.outputs.get(output).is_some_and(Option::is_some) && r.spread[output] > tuning().claim.excited * noise_sd)
    };
    search.noise_sd.iter().enumerate().any(moves)
}
