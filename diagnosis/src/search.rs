//! Which physics was left out: from the nominal model, refitted, to the structures that explain the recordings best.

use crate::fit::{Effort, Evaluator, Fit, measured};
use crate::floor;
use crate::hypothesis::{self, Hypothesis, Scales};
use crate::problem::{Problem, Record};
use crate::screen::{Promise, pairs, screen, worst_records};
use crate::statistics::{advantage, correlation_time, levels};
use crate::structure::Structure;
use backdrive_plant::set::Initial;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How to search.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Physics that are withheld, and with them all that contain one.
    pub without: Vec<String>,
    /// Effects at once, at most.
    pub effects: usize,
    /// When the search has to come to an end, from its start.
    pub patience: Duration,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { without: Vec::new(), effects: 3, patience: Duration::from_secs(24) }
    }
}

/// A structure, fitted.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// What it is.
    pub structure: Structure,
    /// How it fits.
    pub fit: Fit,
    /// Correlation time of what it leaves over, samples.
    pub correlation_time: f64,
    /// Root mean square of what it leaves over at each output, floors.
    pub levels: Vec<f64>,
}

/// A hypothesis that was tried alone.
#[derive(Debug, Clone)]
pub struct Tried {
    /// Its id.
    pub id: String,
    /// Share of the misfit that screening promised.
    pub promised: f64,
    /// Share that a refit took, where there was one.
    pub taken: Option<f64>,
}

/// What a search found.
#[derive(Debug)]
pub struct Search {
    /// Standard deviation of each output's measuring error, in its unit.
    pub floor: Vec<f64>,
    /// Level of each output with the numbers as given, floors.
    pub levels_given: Vec<f64>,
    /// The nominal model refitted.
    pub nominal: Candidate,
    /// Structures with something added, each fitted to its end, best first.
    pub found: Vec<Candidate>,
    /// Hypotheses tried alone.
    pub tried: Vec<Tried>,
    /// How many hypotheses there were.
    pub hypotheses: usize,
    /// Number of residuals.
    pub samples: usize,
    /// Simulations of a recording.
    pub simulations: usize,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// Why a search cannot start.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// The nominal model's motion leaves all bounds on the recordings.
    #[error("the nominal model runs away on the recordings: check units, signs and sample time of the inputs")]
    RunsAway,
    /// The refitted nominal model cannot be simulated.
    #[error("the refitted nominal model cannot be simulated: {0}")]
    Compile(#[from] backdrive_plant::stepper::CompileError),
}

/// How good a candidate is beside others of the same search: what it costs with a price on each number, the lower the better.
pub fn price(candidate: &Candidate, samples: usize, correlation_time: f64) -> f64 {
    let effective = (samples as f64 / correlation_time).max(2.0);
    effective * (candidate.fit.cost.max(1e-300) / samples.max(1) as f64).ln() + candidate.structure.numbers.len() as f64 * effective.ln()
}

/// Correlation time of residuals that nothing could explain, samples: whatever their size, they are measuring error.
const WHITE: f64 = 1.1;
/// What the best of many hypotheses takes from a cost of white noise by chance, squares of the noise.
const CHANCE: f64 = 25.0;
/// Numbers of a physics that is tried first, at most.
const SIMPLE: usize = 6;
/// A residual at its floor has this level, up to chance and rounding.
pub const AT_FLOOR: f64 = 1.04;

/// Searches.
///
/// # Errors
/// When the nominal model cannot be simulated on the recordings.
pub fn search(
    problem: &Problem,
    settings: &Settings,
    stop: Option<&AtomicBool>,
    report: &(dyn Fn(&str) + Sync),
) -> Result<Search, SearchError> {
    let began = Instant::now();
    let late = |share: f64| began.elapsed() > settings.patience.mul_f64(share) || stop.is_some_and(|s| s.load(Ordering::Relaxed));
    let mut evaluator = Evaluator::new(problem);
    evaluator.stop = stop;
    evaluator.until = Some(began + settings.patience);
    if friction_on_prescribed(problem) {
        evaluator.robust = 6.0;
    }
    report("refitting the nominal model");
    let structure = Structure::new(problem, &problem.fit, Vec::new());
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let start = structure.values(problem, &given, &[]);
    let first = evaluator.residuals(&structure, &start).ok_or(SearchError::RunsAway)?;
    let quick = evaluator.fit(&structure, &start, Effort { steps: 12, tolerance: 3.0 }).ok_or(SearchError::RunsAway)?;
    // What a fit leaves over shows the measuring error better than the signal does.
    let before = evaluator.floor.clone();
    evaluator.floor = floors(&evaluator, &quick.residuals);
    let rescaled: Vec<f64> =
        levels(&evaluator, &first).iter().zip(before.iter().zip(&evaluator.floor)).map(|(l, (b, f))| l * b / f).collect();
    let levels_given = rescaled;
    let mut nominal = evaluator.fit(&structure, &quick.values, Effort::FULL).ok_or(SearchError::RunsAway)?;
    let samples = nominal.residuals.len();
    if nominal.cost > AT_FLOOR * AT_FLOOR * samples as f64 {
        for shift in [0.35, -0.35] {
            // Inertias one way, the rest the other: what a wrong structure trades most easily.
            let moved: Vec<f64> = problem
                .stated
                .iter()
                .map(|s| if s.path.starts_with("bodies") { s.given * f64::exp(shift) } else { s.given * f64::exp(-shift) })
                .collect();
            let from = structure.values(problem, &moved, &[]);
            if let Some(other) = evaluator.fit(&structure, &from, Effort { steps: 15, tolerance: 3.0 })
                && other.cost < 0.999 * nominal.cost
                && let Some(other) = evaluator.fit(&structure, &other.values, Effort::FULL)
            {
                nominal = other;
            }
        }
    }
    let nominal = candidate(&evaluator, structure, nominal);

    let model = nominal.structure.model(problem, &nominal.fit.values).ok_or(SearchError::RunsAway)?;
    let runs: Vec<(Vec<Vec<f64>>, f64)> = problem.fit.iter().map(|r| (r.inputs.clone(), r.period)).collect();
    let scales = Scales::of(&model, &runs)?;
    let withheld: Vec<&str> = settings.without.iter().map(String::as_str).collect();
    let mut hypotheses = hypothesis::without(hypothesis::all(&model, &scales), &withheld);
    let mut classes = std::collections::HashSet::new();
    hypotheses.retain(|h| {
        let is_number = h.same_as.as_ref().is_some_and(|path| problem.stated.iter().any(|s| s.path == *path));
        !is_number && classes.insert(h.class.clone())
    });

    report("screening");
    let coarse = Evaluator { substeps: 3, ..evaluator.clone() };
    let promises = screen(&coarse, &nominal.structure, &nominal.fit, &hypotheses);
    // Physics of many numbers come in where simpler relatives do not suffice.
    let (simple, rich): (Vec<Promise>, Vec<Promise>) =
        promises.into_iter().partition(|p| hypotheses[p.hypothesis].parameters.len() <= SIMPLE);
    let promises = simple;
    let mut found: Vec<Candidate> = Vec::new();
    let mut tried: Vec<Tried> = Vec::new();
    for promise in promises.iter().chain(&rich) {
        let id = &hypotheses[promise.hypothesis].id;
        if !tried.iter().any(|t| t.id == *id) {
            tried.push(Tried { id: id.clone(), promised: promise.share, taken: None });
        }
    }
    report("fitting single effects");
    // At the floor only what promises more than chance is worth a fit.
    let quiet = nominal.correlation_time < WHITE || nominal.levels.iter().all(|l| *l < AT_FLOOR);
    let chance = CHANCE * nominal.correlation_time / samples as f64;
    let seeds = if quiet { promises.iter().filter(|p| p.share > chance).count().min(8) } else { 18 };
    // Those that promise most first: where one of them reaches the floor, the rest have nothing left to explain.
    let mut all = single_seeds(&promises, seeds);
    let first = all.len().min(6);
    for (wave, keep) in [(all.drain(..first).collect::<Vec<_>>(), [5, 4]), (all, [7, 4])] {
        if found.is_empty() || !done(&found, &nominal, samples) {
            found.extend(race(&evaluator, problem, &nominal, &hypotheses, wave, keep, &given));
            sort(&mut found, samples);
        }
    }
    // A law that wins with more numbers has to win over its simpler relatives, whatever these promised.
    if let Some(best) = found.first() {
        let own = &best.structure.added[0];
        let relative = |h: &Hypothesis| h.place.same(&own.place) && h.family == own.family && h.parameters.len() < own.parameters.len();
        let missing = |h: &Hypothesis| found.iter().all(|c| c.structure.added[0].id != h.id);
        let simpler: Vec<Seed> = hypotheses
            .iter()
            .enumerate()
            .filter(|(_, h)| relative(h) && missing(h))
            .filter_map(|(index, h)| Some(Seed { effects: vec![(index, h.starts.first()?.clone())], stated: None }))
            .collect();
        found.extend(race(&evaluator, problem, &nominal, &hypotheses, simpler, [3, 3], &given));
        sort(&mut found, samples);
    }
    if !late(0.4) && !quiet && !done(&found, &nominal, samples) {
        let richer = race(&evaluator, problem, &nominal, &hypotheses, single_seeds(&rich, 5), [3, 2], &given);
        found.extend(richer);
        sort(&mut found, samples);
    }

    let mut stopped = late(1.0);
    for effects in 2..=settings.effects {
        if late(0.6) || done(&found, &nominal, samples) {
            break;
        }
        report(if effects == 2 { "fitting pairs" } else { "fitting triples" });
        let mut seeds: Vec<Seed> = Vec::new();
        if effects == 2 {
            let compatible = |a: usize, b: usize| hypotheses[a].compatible(&hypotheses[b]);
            let together = pairs(&promises, &nominal.fit, &nominal.fit.jacobian, 90, compatible);
            seeds.extend(pair_seeds(&promises, &together, 12));
        }
        // From the best that have one effect less, and what each of them promises.
        let bases: Vec<&Candidate> =
            found.iter().filter(|c| c.structure.added.len() == effects - 1).take(if effects == 2 { 4 } else { 3 }).collect();
        for base in bases {
            if late(0.75) {
                break;
            }
            let next = screen(&coarse, &base.structure, &base.fit, &hypotheses);
            let mut used = std::collections::HashSet::new();
            for promise in next.iter().filter(|p| hypotheses[p.hypothesis].parameters.len() <= SIMPLE && used.insert(p.hypothesis)).take(6)
            {
                seeds.push(extended(base, base.structure.stated_of(problem, &base.fit.values), &hypotheses, promise));
            }
        }
        seeds.retain(|s| s.effects.len() == effects);
        let mut more = race(&evaluator, problem, &nominal, &hypotheses, seeds, [7, 4], &given);
        found.append(&mut more);
        sort(&mut found, samples);
        stopped = late(1.0);
    }
    // The numbers of what was found may lead the nominal model out of a wrong basin: then there was less to find.
    let mut nominal = nominal;
    let last = Evaluator { until: Some(Instant::now() + Duration::from_secs(3)), ..evaluator.clone() };
    for found in found.iter().take(2) {
        let stated = found.structure.stated_of(problem, &found.fit.values);
        let start = nominal.structure.values(problem, &stated, &[]);
        if let Some(fit) = last.fit(&nominal.structure, &start, Effort::FULL)
            && fit.cost < 0.999 * nominal.fit.cost
        {
            nominal = candidate(&evaluator, nominal.structure, fit);
        }
    }
    for t in &mut tried {
        let single = found.iter().find(|c| c.structure.added.len() == 1 && c.structure.added[0].id == t.id);
        t.taken = single.map(|c| 1.0 - c.fit.cost / nominal.fit.cost);
    }
    let simulations = evaluator.simulations.load(Ordering::Relaxed);
    let (floor, count) = (evaluator.floor.clone(), hypotheses.len());
    Ok(Search { floor, levels_given, nominal, found, tried, hypotheses: count, samples, simulations, stopped })
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

/// Measuring errors by what a fit leaves over, never above what the signals showed.
fn floors(evaluator: &Evaluator, residuals: &[f64]) -> Vec<f64> {
    let problem = evaluator.problem;
    let layout = evaluator.layout();
    (0..problem.model.outputs.len())
        .map(|output| {
            let parts: Vec<&[f64]> = layout.iter().filter(|l| l.1 == output).filter_map(|l| residuals.get(l.2.clone())).collect();
            let signals: Vec<&[f64]> = problem.fit.iter().filter_map(|r| r.outputs.get(output)?.as_deref()).collect();
            let own = evaluator.floor[output];
            let least = floor::stated(&problem.model, output, &signals);
            let spread = problem.fit.iter().filter_map(|r| r.spread.get(output)).fold(0.0f64, |a, b| a.max(*b));
            if parts.is_empty() { own } else { (own * floor::of_residuals(&parts, least / own, 0.0)).max(1e-6 * spread).min(own) }
        })
        .collect()
}

fn candidate(evaluator: &Evaluator, structure: Structure, fit: Fit) -> Candidate {
    let correlation_time = correlation_time(evaluator, &fit.residuals);
    let levels = levels(evaluator, &fit.residuals);
    Candidate { structure, fit, correlation_time, levels }
}

/// Sorts by price, with the correlation time of the one that costs least.
fn sort(found: &mut [Candidate], samples: usize) {
    let best = found.iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost)).map_or(1.0, |c| c.correlation_time);
    found.sort_by(|a, b| price(a, samples, best).total_cmp(&price(b, samples, best)));
}

/// Whether the best structure leaves nothing that another effect could explain.
fn done(found: &[Candidate], nominal: &Candidate, samples: usize) -> bool {
    let best = found.first().filter(|b| advantage_over(nominal, b, samples) > 0.0).unwrap_or(nominal);
    best.correlation_time < WHITE || best.levels.iter().all(|l| *l < AT_FLOOR) && best.correlation_time < 1.5
}

/// How much better a candidate is than another one, with the correlation time of the better.
pub fn advantage_over(base: &Candidate, better: &Candidate, samples: usize) -> f64 {
    let (a, b) = (base.structure.numbers.len(), better.structure.numbers.len());
    advantage(base.fit.cost, a, better.fit.cost.max(1e-300), b, samples, better.correlation_time)
}

/// A structure to be fitted: its hypotheses, where each starts, and the stated numbers to start from where they are known.
struct Seed {
    effects: Vec<(usize, Vec<f64>)>,
    stated: Option<Vec<f64>>,
}

fn single_seeds(promises: &[Promise], count: usize) -> Vec<Seed> {
    promises.iter().take(count).map(|p| Seed { effects: vec![(p.hypothesis, p.values.clone())], stated: None }).collect()
}

fn pair_seeds(promises: &[Promise], together: &[(usize, usize, f64)], count: usize) -> Vec<Seed> {
    let mut seen = std::collections::HashSet::new();
    together
        .iter()
        .filter(|(a, b, _)| seen.insert((promises[*a].hypothesis, promises[*b].hypothesis)))
        .take(count)
        .map(|(a, b, _)| Seed {
            effects: [a, b].iter().map(|p| (promises[**p].hypothesis, promises[**p].values.clone())).collect(),
            stated: None,
        })
        .collect()
}

fn extended(base: &Candidate, stated: Vec<f64>, hypotheses: &[Hypothesis], promise: &Promise) -> Seed {
    let values = base.structure.added_of(&base.fit.values);
    let place = |h: &Hypothesis| hypotheses.iter().position(|other| other.id == h.id);
    let mut effects: Vec<(usize, Vec<f64>)> = base.structure.added.iter().zip(values).filter_map(|(h, v)| Some((place(h)?, v))).collect();
    effects.push((promise.hypothesis, promise.values.clone()));
    Seed { effects, stated: Some(stated) }
}

/// Fits many structures a little, the better half more, the best to the end.
fn race(
    evaluator: &Evaluator,
    problem: &Problem,
    nominal: &Candidate,
    hypotheses: &[Hypothesis],
    seeds: Vec<Seed>,
    keep: [usize; 2],
    given: &[f64],
) -> Vec<Candidate> {
    let refitted = nominal.structure.stated_of(problem, &nominal.fit.values);
    // The first steps on the recordings that are explained worst, with few substeps.
    let few = worst_records(evaluator, &nominal.fit, 2);
    let whole =
        few.len() == evaluator.records.len() || problem.initial == Initial::Free || problem.fit.iter().any(|r| !r.conditions.is_empty());
    let some: Vec<Record> = if whole { problem.fit.clone() } else { few.iter().map(|r| problem.fit[*r].clone()).collect() };
    let coarse = Evaluator { substeps: 6, records: &some, ..evaluator.clone() };
    let nominal_there = if whole { nominal.fit.clone() } else { restricted(evaluator, &nominal.fit, &few) };
    let structure_of = |seed: &Seed| Structure::new(problem, &some, seed.effects.iter().map(|(h, _)| hypotheses[*h].clone()).collect());
    let mut running: Vec<(Structure, Fit)> = seeds
        .par_iter()
        .filter_map(|seed| {
            let values: Vec<Vec<f64>> = seed.effects.iter().map(|(_, v)| v.clone()).collect();
            let structure = structure_of(seed);
            let from_refit = structure.values(problem, seed.stated.as_deref().unwrap_or(&refitted), &values);
            let from_given = structure.values(problem, given, &values);
            let effort = Effort { steps: 2, tolerance: 3.0 };
            let known = Some((&nominal.structure, &nominal_there));
            let fits = [from_refit, from_given].into_iter().filter_map(|start| coarse.fit_knowing(&structure, &start, effort, known));
            let best = fits.min_by(|a, b| hopeful(a).total_cmp(&hopeful(b)))?;
            Some((structure, best))
        })
        .collect();
    let last = Evaluator { until: evaluator.until.map(|t| t + Duration::from_secs(2)), ..evaluator.clone() };
    let stages = [
        (keep[0] + 6, &coarse, Effort { steps: 3, tolerance: 2.0 }),
        (keep[0], evaluator, Effort { steps: 5, tolerance: 1.0 }),
        (keep[1], &last, Effort::FULL),
    ];
    for (count, held_against, effort) in stages {
        running.sort_by(|a, b| hopeful(&a.1).total_cmp(&hopeful(&b.1)));
        let mut names = std::collections::HashSet::new();
        running.retain(|(s, _)| {
            let mut ids: Vec<&str> = s.added.iter().map(|h| h.id.as_str()).collect();
            ids.sort_unstable();
            names.insert(ids.join("+"))
        });
        running.truncate(count);
        // Once one is near its end, those far behind have no chance.
        let best = running.first().map_or(0.0, |(_, f)| hopeful(f));
        let floor = running.first().map_or(0.0, |(_, f)| f.residuals.len() as f64);
        let margin = if best < 1.2 * floor { 1.3 } else { 4.0 };
        running.retain(|(_, f)| hopeful(f) < margin * best.max(floor) || best > 4.0 * floor);
        // Nor does a fit that runs out of time leave nothing.
        let enough = evaluator.is_late() && count > 3;
        running.truncate(if enough { 3 } else { count });
        running = running
            .into_par_iter()
            .map(|(structure, fit)| {
                let next = held_against.fit_knowing(&structure, &fit.values, effort, Some((&structure, &fit))).unwrap_or(fit);
                (structure, next)
            })
            .collect();
    }
    let size = evaluator.len();
    running.into_iter().filter(|(_, f)| f.residuals.len() == size && f.cost.is_finite()).map(|(s, f)| candidate(evaluator, s, f)).collect()
}

/// A fit's residuals and derivatives on some of its recordings.
fn restricted(evaluator: &Evaluator, fit: &Fit, records: &[usize]) -> Fit {
    let layout = evaluator.layout();
    let pick = |all: &Vec<f64>| -> Vec<f64> {
        layout.iter().filter(|l| records.contains(&l.0)).filter_map(|l| all.get(l.2.clone())).flatten().copied().collect()
    };
    Fit { residuals: pick(&fit.residuals), jacobian: fit.jacobian.iter().map(pick).collect(), ..fit.clone() }
}

/// What a fit would cost if most of what its next step foresees came true.
fn hopeful(fit: &Fit) -> f64 {
    fit.cost - fit.foreseen.min(0.6 * fit.cost)
}

/// Normalised root mean squared error of a structure with these values, averaged over the recordings and their outputs; each over the
/// output's own standard deviation. Where records start freely, or a number is free in a file, that is fitted first, and nothing else.
pub fn nrmse(problem: &Problem, records: &[Record], structure: &Structure, values: &[f64]) -> Option<f64> {
    let fixed = Problem { model: structure.model(problem, values)?, stated: Vec::new(), ..problem.clone() };
    let mut own = Structure::new(&fixed, records, Vec::new());
    own.numbers.retain(|n| n.record.is_some());
    let mut values = own.values(&fixed, &[], &[]);
    if !own.numbers.is_empty()
        && let Some(fit) = Evaluator::on(&fixed, records).fit(&own, &values, Effort { steps: 15, tolerance: 1.0 })
    {
        values = fit.values;
    }
    let (mut sum, mut count) = (0.0, 0usize);
    for (r, record) in records.iter().enumerate() {
        let columns = own.predict(&fixed.model, &values, record, r, 64)?;
        for (column, output) in columns.chunks_exact(record.len).zip(measured(record)) {
            let samples = record.outputs.get(output)?.as_deref()?;
            let error = column.iter().zip(samples).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / record.len as f64;
            sum += error.sqrt() / record.spread[output];
            count += 1;
        }
    }
    (count > 0).then(|| sum / count as f64)
}
