//! The next experiment: which excitation would tell explanations apart that the recordings do not, and how well.
//!
//! Two structures that fit alike are rivals. An experiment separates them by what is left of the difference of their predictions
//! when each may move its own numbers to imitate the other, as far as the recordings let them (T-optimality, Hunter and Reiner
//! 1965, Technometrics 7, 307-323; with the recordings' information as it stands in a sequential design). Of the excitations
//! within what the device was shown to stand (`menu.rs`) the one is taken that gives most for the worst pair per second. What is
//! left counts in standard deviations: the root of the cost that the wrong rival would have above the right one.
//!
//! Where no excitation separates them, the sensor is named that would.

mod extra_output;
mod menu;
mod rivals;
mod sensor;
#[cfg(test)]
mod tests;
mod words;

use crate::candidate::Candidate;
use crate::fit::{Evaluator, Fit};
use crate::problem::Problem;
use crate::signal::rms;
use crate::structure::{Role, Structure};
use crate::work::{Budget, Steps};
use backdrive_plant::model::Model;
use backdrive_plant::write::round_significant;
use menu::{Stand, plays};
use rayon::prelude::*;
use rivals::{Rival, Scene, Sensors, Trial};
use words::short;

/// An experiment that was not made yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// The input that it drives.
    pub input: String,
    /// What to play, and what would be seen.
    pub sentence: String,
    /// The excitation file.
    pub text: String,
    /// The excitation on one line, as command lines and graphs have it.
    pub excitation: String,
    /// What it tells apart, or the numbers that it determines.
    pub between: Vec<String>,
    /// Standard deviations between the two of them that it separates least, each refitted to it.
    pub separation: f64,
    /// Root mean square of that difference over all samples, floors. For [`excite`] that of one standard deviation of the number.
    pub level: f64,
    /// The output in which most of it shows.
    pub output: String,
    /// How often it has to be played for [`WANTED`] standard deviations.
    pub repeats: u32,
    /// Length of one playing, s.
    pub duration: f64,
    /// Sampling rate that it was planned for, Hz.
    pub rate_hz: f64,
}

/// Why there is no experiment, in one sentence that says what would help.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Reason(pub String);

/// Standard deviations at which explanations count as told apart.
pub const WANTED: f64 = 5.0;
/// An experiment that would have to be played more often is none.
const MOST_REPEATS: u32 = 10;
/// Rivals, at most: those that come first are the likely ones.
const MOST_RIVALS: usize = 4;
/// What it takes to set an experiment up, s: without it the shortest would always win.
const SETTING_UP: f64 = 2.0;
/// How far beyond the recorded peaks positions and speeds may go.
const REACH: f64 = 1.3;
/// Standard deviation over the number itself from which on [`excite`] takes it as open.
const KNOWN: f64 = 0.05;
/// Share of the work for simulating everything, and for simulating and evaluating it.
const SHARES: (f64, f64) = (0.4, 0.75);
/// Substeps per sample for choosing, and for the figures of the best.
const SUBSTEPS: (usize, usize) = (4, 16);
/// Experiments that are compared by a true refit.
const FINALISTS: usize = 3;

/// The excitation that tells fitted structures apart, the likeliest first. `floor` is the standard deviation of each output's
/// measuring error; what the budget does not suffice for is left out.
///
/// # Errors
/// Says why when no excitation would: fewer than two structures, none that can be simulated, or a difference too small; then also which sensor would help.
pub fn separate<'a>(problem: &'a Problem, candidates: &[&Candidate], floor: &[f64], budget: &Budget<'a>) -> Result<Experiment, Reason> {
    let fitted: Vec<(&Structure, &Fit)> = candidates.iter().map(|c| (&c.structure, &c.fit)).collect();
    separate_fitted(problem, &fitted, floor, budget)
}

fn separate_fitted<'a>(
    problem: &'a Problem,
    fitted: &[(&Structure, &Fit)],
    floor: &[f64],
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let mut names = std::collections::HashSet::new();
    let others = fitted.iter().filter(|(structure, _)| names.insert(ids(structure)));
    let rivals: Vec<Rival> = others.take(MOST_RIVALS).map(|(structure, fit)| Rival::of(problem, structure, fit)).collect();
    let all: Vec<(usize, usize)> = (0..rivals.len()).flat_map(|b| (0..b).map(move |a| (a, b))).collect();
    let Some(first) = all.first() else { return Err(Reason("there is only one explanation".to_string())) };
    let stage = Stage::new(problem, floor, budget)?;
    let apart: Vec<(usize, usize)> = all.iter().copied().filter(|(a, b)| !same(rivals[*a].structure, rivals[*b].structure)).collect();
    let mut shows = stage.shows(&rivals);
    if shows.is_empty() {
        return Err(Reason("no excitation could be simulated with all of the explanations".to_string()));
    }
    let least = WANTED / f64::from(MOST_REPEATS).sqrt();
    let evaluated = stage.evaluate(&rivals, &mut shows, &apart, least);
    let reached = |p: &(usize, usize)| evaluated.iter().any(|e| e.of(*p) >= least);
    let open: Vec<(usize, usize)> = apart.iter().copied().filter(reached).collect();
    if open.is_empty() {
        let pair = apart.first().unwrap_or(first);
        return Err(stage.no_experiment(&rivals, &shows, *pair, evaluated.iter().map(|e| e.of(*pair)).fold(0.0, f64::max)));
    }
    let mut ranked: Vec<&Evaluated> = evaluated.iter().collect();
    ranked.sort_by(|a, b| b.score(&open, &shows).total_cmp(&a.score(&open, &shows)));
    let fine = Scene { substeps: SUBSTEPS.1, ..stage.scene.clone() };
    let refitted = |e: &&Evaluated| {
        let trial = &shows[e.show].trial;
        let left = |p: &(usize, usize)| {
            let left = refitted(&fine, &rivals, trial, *p);
            // A refit that was cut short leaves too much.
            (*p, if budget.is_over() { left.min(e.of(*p)) } else { left })
        };
        let worst = open.iter().map(left).min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((e.show, worst.0, worst.1))
    };
    let finalists: Vec<(usize, (usize, usize), f64)> = ranked.iter().take(FINALISTS).filter_map(refitted).collect();
    let rate = |f: &(usize, (usize, usize), f64)| f.2 * f.2 / (shows[f.0].trial.seconds() + SETTING_UP);
    let best = finalists.iter().max_by(|a, b| rate(a).total_cmp(&rate(b)));
    let Some((show, pair, separation)) = best.copied().filter(|f| f.2 >= least) else {
        let pair = open[0];
        return Err(stage.no_experiment(&rivals, &shows, pair, best.map_or(0.0, |f| f.2)));
    };
    let shut = all.iter().copied().find(|p| !open.contains(p));
    Ok(stage.separating(&rivals, &shows[show], pair, separation, shut))
}

/// The excitation that determines numbers of a structure which the recordings do not: `numbers` are places among
/// [`Structure::numbers`], `model` the structure's model with `values`. What the budget does not suffice for is left out.
///
/// # Errors
/// Says why when no excitation would determine them.
pub fn excite<'a>(
    problem: &'a Problem,
    model: &Model,
    structure: &Structure,
    values: &[f64],
    numbers: &[usize],
    floor: &[f64],
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let numbers: Vec<usize> = numbers.iter().copied().filter(|j| structure.numbers.get(*j).is_some_and(|n| n.records.is_none())).collect();
    if numbers.is_empty() || values.len() != structure.numbers.len() {
        return Err(Reason("there is no number to determine".to_string()));
    }
    let stage = Stage::new(problem, floor, budget)?;
    let mut evaluator = Evaluator::new(problem);
    (evaluator.floor, evaluator.substeps) = (stage.scene.sensors.floor.clone(), SUBSTEPS.0);
    let own: Vec<f64> = structure.numbers.iter().zip(values).map(|(n, v)| n.inward(*v)).collect();
    let residuals = evaluator.residuals(structure, values).ok_or_else(|| Reason("the model runs away on the recordings".to_string()))?;
    let known = Rival::with(structure, values, &evaluator.jacobian(structure, &own, &residuals), 1.0);
    let before = known.deviations(None);
    let whole = |j: usize| if structure.numbers[j].log { 1.0 } else { own[j].abs() };
    let numbers: Vec<usize> = numbers.into_iter().filter(|j| before[*j] > KNOWN * whole(*j)).collect();
    if numbers.is_empty() {
        return Err(Reason(format!("the recordings determine all of these numbers to {} % or better", short(100.0 * KNOWN))));
    }
    let shows = stage.shows(std::slice::from_ref(&known));
    // The size that a number must be seen with: all of it, or what the recordings leave open.
    let size = |j: usize| if whole(j) > 0.0 { whole(j).min(before[j]) } else { before[j] };
    let places: Vec<usize> = (0..shows.len()).collect();
    let determined = stage.scene.budget.abreast(&places, |budget, s| {
        let show = &shows[*s];
        let jacobian = known.jacobian(&stage.scene.within(budget), &show.trial, &known.own, &show.seen[0]);
        let after = known.deviations(Some(&jacobian));
        let worst = numbers.iter().map(|j| size(*j) / after[*j]).fold(f64::INFINITY, f64::min);
        (*s, worst, after)
    });
    let gains: Vec<(usize, f64, Vec<f64>)> = determined.into_iter().flatten().filter(|g| g.1.is_finite()).collect();
    let rate = |g: &(usize, f64, Vec<f64>)| g.1 * g.1 / (shows[g.0].trial.seconds() + SETTING_UP);
    let best = gains.iter().max_by(|a, b| rate(a).total_cmp(&rate(b)));
    let names: Vec<String> = numbers.iter().map(|j| name_of(problem, structure, *j)).collect();
    let least = WANTED / f64::from(MOST_REPEATS).sqrt();
    let Some((show, separation, after)) = best.filter(|g| g.1 >= least) else {
        let list = names.join(", ");
        return Err(Reason(format!(
            "no excitation within what the recordings show the device to stand determines {list}: it takes larger amplitudes, another sensor or another input"
        )));
    };
    let show = &shows[*show];
    let accuracy = numbers.iter().map(|j| {
        let number = &structure.numbers[*j];
        let percent = 100.0 * if number.log { after[*j] } else { after[*j] / values[*j].abs().max(f64::MIN_POSITIVE) };
        if values[*j] == 0.0 {
            format!("{} to {}", name_of(problem, structure, *j), short(after[*j]))
        } else {
            format!("{} to {} %", name_of(problem, structure, *j), short(percent))
        }
    });
    let sentence = format!(
        "Play {}: it determines {}, which the recordings leave open.",
        words::described(model, &show.trial),
        accuracy.collect::<Vec<_>>().join(", ")
    );
    let jacobian = known.jacobian(&stage.scene, &show.trial, &known.own, &show.seen[0]);
    let change: Vec<f64> = jacobian.get(numbers[0]).map(|c| c.iter().map(|x| x * after[numbers[0]]).collect()).unwrap_or_default();
    Ok(stage.experiment(show, sentence, names, *separation, &change, rms(&change)))
}

/// What a number is called.
fn name_of(problem: &Problem, structure: &Structure, number: usize) -> String {
    match structure.numbers.get(number).map(|n| &n.role) {
        Some(Role::Stated(i)) => problem.stated.get(*i).map_or_else(String::new, |s| s.path.clone()),
        Some(Role::Added(h, p)) => {
            let hypothesis = structure.added.get(*h);
            let key = hypothesis.and_then(|h| h.parameters.get(*p)).map_or("", |p| p.key.as_str());
            format!("{key} of {}", hypothesis.map_or("", |h| h.id.as_str()))
        }
        _ => String::new(),
    }
}

/// What a structure adds, in an order of its own.
fn ids(structure: &Structure) -> Vec<&str> {
    let mut all: Vec<&str> = structure.added.iter().map(|h| h.id.as_str()).collect();
    all.sort_unstable();
    all
}

/// Whether no recording can tell two structures apart.
fn same(a: &Structure, b: &Structure) -> bool {
    let classes = |s: &Structure| {
        let mut all: Vec<String> = s.added.iter().map(|h| h.class.clone()).collect();
        all.sort();
        all
    };
    classes(a) == classes(b)
}

/// What is left between two rivals when either is refitted to the other, standard deviations; infinite where there is no time to say.
fn refitted(scene: &Scene, rivals: &[Rival], trial: &Trial, (a, b): (usize, usize)) -> f64 {
    if scene.budget.is_over() {
        return f64::INFINITY;
    }
    let unit = rivals[a].unit.max(rivals[b].unit);
    let left = [(a, b), (b, a)].into_par_iter().map(|(one, other)| rivals[one].refit(scene, trial, &rivals[other]).unwrap_or(0.0));
    (left.reduce(|| f64::INFINITY, f64::min) / unit).sqrt()
}

/// An experiment with what each rival predicts for it.
struct Show {
    trial: Trial,
    seen: Vec<Vec<f64>>,
}

/// How well an experiment separates each pair, standard deviations.
struct Evaluated {
    show: usize,
    pairs: Vec<((usize, usize), f64)>,
}

impl Evaluated {
    fn of(&self, pair: (usize, usize)) -> f64 {
        self.pairs.iter().find(|p| p.0 == pair).map_or(0.0, |p| p.1)
    }

    /// What it gives for the worst of some pairs per second. More than enough in twice the time is no gain, less is.
    fn score(&self, pairs: &[(usize, usize)], shows: &[Show]) -> f64 {
        let worst = pairs.iter().map(|p| self.of(*p)).fold(f64::INFINITY, f64::min);
        worst * worst / (shows[self.show].trial.seconds() + SETTING_UP)
    }
}

impl Trial {
    /// Its length, s.
    fn seconds(&self) -> f64 {
        self.record.len as f64 * self.record.period
    }
}

/// A problem with what its inputs were shown to stand.
struct Stage<'a> {
    scene: Scene<'a>,
    stands: Vec<Option<Stand>>,
    rate_hz: f64,
    longest: f64,
    /// Counts at which simulating, and evaluating, come to an end.
    ends: (Steps, Steps),
}

impl<'a> Stage<'a> {
    fn new(problem: &'a Problem, floor: &[f64], budget: &Budget<'a>) -> Result<Stage<'a>, Reason> {
        let stands: Vec<Option<Stand>> = (0..problem.model.inputs.len()).map(|i| Stand::of(problem, i)).collect();
        let lengths = problem.fit.iter().map(|r| (r.len as f64 * r.period, r.period));
        let longest = lengths.max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((longest, period)) = longest.filter(|_| stands.iter().any(Option::is_some)) else {
            return Err(Reason("no input moves in any recording, so nothing says what the device stands".to_string()));
        };
        let end = |share: f64| budget.spent() + (share * budget.left() as f64) as Steps;
        let ends = (end(SHARES.0), end(SHARES.1));
        let scene =
            Scene { problem, sensors: Sensors::of(problem, floor), extra: Vec::new(), substeps: SUBSTEPS.0, budget: budget.clone() };
        Ok(Stage { scene, stands, rate_hz: round_significant(1.0 / period, 6), longest, ends })
    }

    /// Every excitation that all rivals can be simulated on, within what the device was shown to stand.
    fn shows(&self, rivals: &[Rival]) -> Vec<Show> {
        let plays = plays(self.scene.problem, &self.stands, 1.0 / self.rate_hz, self.longest);
        let one = |budget: &Budget<'a>, play: &menu::Play| {
            let scene = self.scene.within(budget);
            let mut trial = scene.trial(play, &self.stands, self.rate_hz)?;
            let far = |trial: &Trial| rivals.first().and_then(|rival| scene.excursion(rival, trial));
            let reached = far(&trial)?;
            if reached > REACH {
                trial = scene.smaller(&trial, 0.9 * REACH / reached, &self.stands, self.rate_hz)?;
                far(&trial).filter(|reached| *reached <= 1.1 * REACH)?;
            }
            let seen = rivals.iter().map(|r| r.prediction(&scene, &trial)).collect::<Option<Vec<_>>>()?;
            Some(Show { trial, seen })
        };
        self.scene.budget.until(self.ends.0).abreast(&plays, one).into_iter().flatten().flatten().collect()
    }

    /// How well experiments separate the rivals by first order. Those whose whole difference is no better than what others have left
    /// need no evaluation. Sorts `shows` by what they promise.
    fn evaluate(&self, rivals: &[Rival], shows: &mut [Show], pairs: &[(usize, usize)], least: f64) -> Vec<Evaluated> {
        let promised = |show: &Show| {
            let one = |(a, b): &(usize, usize)| {
                let apart: f64 = show.seen[*a].iter().zip(&show.seen[*b]).map(|(x, y)| (x - y).powi(2)).sum();
                apart / rivals[*a].unit.max(rivals[*b].unit)
            };
            pairs.iter().map(one).fold(f64::INFINITY, f64::min) / (show.trial.seconds() + SETTING_UP)
        };
        shows.sort_by(|a, b| promised(b).total_cmp(&promised(a)));
        let mut all: Vec<Evaluated> = Vec::new();
        let mut at = 0;
        while at < shows.len() && (at == 0 || self.scene.budget.spent() < self.ends.1) {
            let best = all.iter().filter(|e| e.pairs.iter().all(|p| p.1 >= least)).map(|e| e.score(pairs, shows)).fold(0.0, f64::max);
            if pairs.is_empty() || promised(&shows[at]) < best {
                break;
            }
            let next: Vec<usize> = (at..shows.len().min(at + 4)).collect();
            at += next.len();
            all.par_extend(next.par_iter().map(|s| {
                let show = &shows[*s];
                let one = |(r, rival): (usize, &Rival)| rival.jacobian(&self.scene, &show.trial, &rival.own, &show.seen[r]);
                let jacobians: Vec<Vec<Vec<f64>>> = rivals.par_iter().enumerate().map(one).collect();
                let left = |a: usize, b: usize| {
                    let apart: Vec<f64> = show.seen[b].iter().zip(&show.seen[a]).map(|(x, y)| x - y).collect();
                    rivals[a].remainder(&jacobians[a], &apart).min(rivals[b].remainder(&jacobians[b], &apart))
                };
                let sd = |p: &(usize, usize)| (*p, (left(p.0, p.1) / rivals[p.0].unit.max(rivals[p.1].unit)).sqrt());
                Evaluated { show: *s, pairs: pairs.iter().map(sd).collect() }
            }));
        }
        all
    }

    /// Why two rivals cannot be separated, and by which sensor they could.
    fn no_experiment(&self, rivals: &[Rival], shows: &[Show], (a, b): (usize, usize), reached: f64) -> Reason {
        let (a, b) = (&rivals[a], &rivals[b]);
        let [one, other] = words::names(a.structure, b.structure);
        let mut said = format!("No excitation tells {one} and {other} apart with the sensors there are");
        if same(a.structure, b.structure) {
            said.push_str(&format!(": {}", words::same_force(a.structure, b.structure)));
        } else {
            said.push_str(&format!(" (at most {} standard deviations)", short(reached)));
        }
        // Of the excitations with most in them: the loud and the long ones.
        let mut trials: Vec<&Trial> = shows.iter().map(|s| &s.trial).collect();
        trials.sort_by(|x, y| y.seconds().total_cmp(&x.seconds()));
        let spread: Vec<&Trial> = trials.iter().step_by((trials.len() / 4).max(1)).take(4).copied().collect();
        let found = sensor::best(&self.scene, &spread, [a, b]).filter(|s| s.separation >= WANTED);
        match found {
            Some(sensor) => said.push_str(&format!(
                "; measuring {} as well would ({} standard deviations with {}).",
                sensor.words,
                short(sensor.separation),
                spread.get(sensor.trial).map_or(String::new(), |t| words::described(&self.scene.problem.model, t))
            )),
            None => said.push_str("; nor does any further sensor of position, velocity or element force."),
        }
        Reason(said)
    }

    fn separating(
        &self,
        rivals: &[Rival],
        show: &Show,
        (a, b): (usize, usize),
        separation: f64,
        shut: Option<(usize, usize)>,
    ) -> Experiment {
        let apart: Vec<f64> = show.seen[a].iter().zip(&show.seen[b]).map(|(x, y)| x - y).collect();
        let unit = rivals[a].unit.max(rivals[b].unit);
        let level = separation * (unit / apart.len().max(1) as f64).sqrt();
        let [one, other] = words::names(rivals[a].structure, rivals[b].structure);
        let output = self.most(show, &apart);
        let repeats = repeats(separation);
        let again = if repeats > 1 { format!(", {repeats} times") } else { String::new() };
        let mut sentence = format!(
            "Play {}{again}: {one} and {other} then part by {} standard deviations ({} floors rms, most of it in {output}), each refitted to it",
            words::described(&self.scene.problem.model, &show.trial),
            short(separation * f64::from(repeats).sqrt()),
            short(level)
        );
        if let Some(why) = words::separator(rivals[a].structure, rivals[b].structure) {
            sentence.push_str(&format!("; {why}"));
        }
        sentence.push('.');
        if let Some((c, d)) = shut {
            let [one, other] = words::names(rivals[c].structure, rivals[d].structure);
            sentence.push_str(&format!(" It does not tell {one} and {other} apart."));
        }
        let between = rivals.iter().map(|r| r.structure.name()).collect();
        self.experiment(show, sentence, between, separation, &apart, level)
    }

    /// The output in which most of a change in floors shows.
    fn most(&self, show: &Show, change: &[f64]) -> String {
        let size = |column: &[f64]| column.iter().map(|x| x * x).sum::<f64>();
        let columns = change.chunks_exact(show.trial.record.len.max(1)).zip(self.scene.outputs(&show.trial.record));
        let most = columns.max_by(|a, b| size(a.0).total_cmp(&size(b.0)));
        most.and_then(|(_, o)| self.scene.problem.model.outputs.get(o)).map_or_else(String::new, |o| o.name.clone())
    }

    fn experiment(&self, show: &Show, sentence: String, between: Vec<String>, separation: f64, change: &[f64], level: f64) -> Experiment {
        let model = &self.scene.problem.model;
        Experiment {
            input: model.inputs.get(show.trial.play.input).map_or_else(String::new, |i| i.name.clone()),
            text: words::file(model, &show.trial, "next", &sentence, self.rate_hz),
            excitation: show.trial.play.excitation.to_string(),
            sentence,
            between,
            separation,
            level,
            output: self.most(show, change),
            repeats: repeats(separation),
            duration: show.trial.seconds(),
            rate_hz: self.rate_hz,
        }
    }
}

/// How often an experiment is played for [`WANTED`] standard deviations.
fn repeats(separation: f64) -> u32 {
    ((WANTED / separation).powi(2).ceil() as u32).clamp(1, MOST_REPEATS)
}
