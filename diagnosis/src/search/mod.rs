//! Which physics was left out: from the nominal model, refitted, to the structures that explain the recordings best.

mod next;
mod view;
mod wave;

use crate::clock::Moment;
use crate::compare::{Unseen, unseen};
use crate::fit::{Effort, Evaluator, Fit};
use crate::floor;
use crate::guide::Guide;
use crate::hypothesis::{self, Hypothesis, Place, Scales};
use crate::parts::Parts;
use crate::problem::{Problem, Record};
use crate::race::{Course, NEAR, Seed, distinct};
use crate::screen::worst_records;
use crate::statistics::{advantage, correlation_time, levels, slowness};
use crate::structure::Structure;
use backdrive_plant::model::InputKind;
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use view::View;
use wave::Wave;

/// How to search.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Physics that are withheld, and with them all that contain one.
    pub without: Vec<String>,
    /// Effects at once, at most.
    pub effects: usize,
    /// When the search has to come to an end, from its start: computing time, see [`crate::clock`].
    pub patience: Duration,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { without: Vec::new(), effects: 3, patience: Duration::from_secs(26) }
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
    /// How far what it leaves over is from white noise at longer spans, see [`slowness`].
    pub slowness: f64,
    /// Root mean square of what it leaves over at each output, floors.
    pub levels: Vec<f64>,
    /// What it leaves over of the recordings that no fit has seen; `None` where it was not held against them.
    pub unseen: Option<Unseen>,
}

impl Candidate {
    /// Whether what it leaves over is white noise, as far as chance can tell.
    pub fn is_white(&self) -> bool {
        white(self.correlation_time, self.slowness)
    }
}

fn white(correlation_time: f64, slowness: f64) -> bool {
    correlation_time < WHITE.0 && slowness < WHITE.1
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

/// The smallest size of a physics that the recordings would have shown.
#[derive(Debug, Clone)]
pub struct Detectable {
    /// Its name.
    pub physics: &'static str,
    /// Where.
    pub place: Place,
    /// The parameter that says how large it is.
    pub key: String,
    /// Its size.
    pub size: f64,
    /// Unit of that.
    pub unit: String,
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
    /// Number of residuals of the recordings that no fit has seen.
    pub unseen_samples: usize,
    /// What would have been seen beside the refitted nominal model, each physics at the place where it shows best.
    pub detectable: Vec<Detectable>,
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

/// Correlation time of residuals that nothing could explain, samples, and their distance from white noise, in standard deviations of chance:
/// whatever their size, they are measuring error.
const WHITE: (f64, f64) = (1.5, 4.0);
/// What the best of many hypotheses takes from a cost of white noise by chance, squares of the noise.
const CHANCE: f64 = 25.0;
/// Substeps per sample, at most: for screening and the first steps of fits, and for their middle.
pub(crate) const COARSE: usize = 2;
/// See [`COARSE`].
pub(crate) const MIDDLE: usize = 4;
/// Residuals beyond this many times the size of most of them count by their size, not their square, where dry friction acts on a prescribed body.
const FAR_OFF: f64 = 6.0;
/// Substeps per sample, at most, whatever the model asks for.
const FINEST: usize = 64;
/// Share of what is left over, in squares, that too few substeps may make up.
const BLUR: f64 = 0.02;
/// Share of the time for screening beside a structure that was found.
const ANEW: f64 = 0.06;
/// Times the cost of the best up to which a law leaves less than twice as much over.
const TWICE: f64 = 4.0;
/// Steps from the best to something simpler, at most.
const SIMPLER: usize = 3;
/// Share of the time for numbers that come back.
const REVIVING: f64 = 0.2;
/// Level above which the nominal model's refit is brought to its end after the search only, and vanished numbers of a law stay so until its end, floors.
const NOMINAL_END: f64 = 5.0;
/// Level above which fits start along the measured path, floors.
const FAR: f64 = 2.0;
/// Mean squared residual that the nominal model has to leave along the measured path, squares of the floor, or this share of what it leaves
/// over without it.
const SHOWS: f64 = 3.0;
/// See [`SHOWS`].
const SHARE: f64 = 0.3;
/// Other ways to be led, until enough is left over: how much looser than at first, and whether parts of the recordings are enough. On parts the
/// numbers of the nominal model may take on what differs from one part to the next.
const LOOSER: [(f64, bool); 5] = [(0.2, true), (1.0, false), (0.2, false), (0.04, false), (0.008, false)];
/// Samples that screening is shown far from the noise, about.
const SHOWN: usize = 5_000;
/// Ripples that stand alone in the spectrum of their force which are fitted without the path that leads the others.
const RIPPLES: usize = 4;
/// The last steps of those that could still win.
const POLISH: Effort = Effort { steps: 15, tolerance: 0.3 };
/// Structures of so many effects that are held against recordings that no fit has seen.
const FINALISTS: usize = 8;
/// A residual at its floor has this level, up to chance and rounding.
pub const AT_FLOOR: f64 = 1.04;

/// A fit on the recordings that are explained worst first, where there are many samples, then on all; so many steps on either. `there` are
/// the residuals at the start.
fn worst_first(evaluator: &Evaluator, structure: &Structure, start: &[f64], there: &[f64], steps: [usize; 2]) -> Option<Fit> {
    let problem = evaluator.problem;
    let own_numbers = structure.numbers.iter().any(|n| n.records.is_some());
    let worst = worst_records(evaluator, there, 2);
    let effort = |steps: usize| Effort { steps, tolerance: 3.0 };
    if own_numbers || there.len() < SHOWN || 2 * worst.len() > problem.fit.len() {
        return evaluator.fit(structure, start, effort(steps[0]));
    }
    let some: Vec<Record> = worst.iter().map(|r| problem.fit[*r].clone()).collect();
    let few = Evaluator { records: &some, ..evaluator.clone() };
    let first = few.fit(structure, start, effort(steps[0]))?;
    evaluator.fit(structure, &first.values, effort(steps[1]))
}

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
    let began = Moment::now();
    let late = |share: f64| began.elapsed() > settings.patience.mul_f64(share) || stop.is_some_and(|s| s.load(Ordering::Relaxed));
    let mut evaluator = Evaluator::new(problem);
    evaluator.stop = stop;
    evaluator.until = Some(began + settings.patience.mul_f64(0.75));
    if friction_on_prescribed(problem) {
        evaluator.robust = FAR_OFF;
    }
    report("refitting the nominal model");
    let structure = Structure::new(problem, &problem.fit, Vec::new());
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let start = structure.values(problem, &given, &[], &[]);
    let first = evaluator.residuals(&structure, &start).ok_or(SearchError::RunsAway)?;
    let middle = Evaluator { substeps: MIDDLE, ..evaluator.clone() };
    let quick = worst_first(&middle, &structure, &start, &first, [12, 3]).ok_or(SearchError::RunsAway)?;
    // What a fit leaves over shows the measuring error better than the signal does.
    let before = evaluator.floor.clone();
    evaluator.floor = floors(&evaluator, &quick.residuals);
    if evaluator.robust.is_finite() {
        // Large is what is large beside the rest, which far from the noise is far from the noise itself.
        evaluator.robust = FAR_OFF * bulk(&quick.residuals, &before, &evaluator).max(1.0);
    }
    let rescaled = |residuals: &[f64]| -> Vec<f64> {
        levels(&evaluator, residuals).iter().zip(before.iter().zip(&evaluator.floor)).map(|(l, (b, f))| l * b / f).collect()
    };
    let levels_given = rescaled(&first);
    let samples = quick.residuals.len();
    // Far from the noise its end waits until the rest is known.
    let is_far = rescaled(&quick.residuals).iter().any(|l| *l > NOMINAL_END);
    let effort = if is_far { Effort { steps: 4, tolerance: 3.0 } } else { Effort::FULL };
    let mut nominal = evaluator.fit(&structure, &quick.values, effort).ok_or(SearchError::RunsAway)?;
    // Far from the noise the measured path shows better than a simulation what is missing, and leads the numbers out of wrong basins.
    let model = structure.model(problem, &nominal.values).ok_or(SearchError::RunsAway)?;
    let seen = structure.with_unknown(problem, &problem.fit, &nominal.values);
    let runs: Vec<(Vec<Vec<f64>>, f64)> = seen.iter().map(|r| (r.inputs.clone(), r.period)).collect();
    let largest = |output: usize| {
        let samples = problem.fit.iter().filter_map(|r| r.outputs.get(output)?.as_deref()).flatten();
        samples.fold(0.0_f64, |most, y| most.max(y.abs()))
    };
    let measured: Vec<f64> = (0..model.outputs.len()).map(largest).collect();
    let scales = Scales::of(&model, &runs)?.with_measured(&model, &measured);
    let level = levels(&evaluator, &nominal.residuals).into_iter().fold(0.0, f64::max);
    let strength = if level > 3.0 * FAR { 1.0 } else { 0.3 };
    let far = level > FAR;
    let firm = Guide::new(problem, &problem.fit, &scales, &evaluator.floor, strength);
    let held = far && !firm.is_empty();
    // A motion that is prescribed leads the device by itself.
    let moved = problem.model.inputs.iter().any(|i| i.kind == InputKind::Motion);
    let guided = held || far && moved;
    let led = |from: &[f64], looser: f64, in_parts: bool| {
        let guide = held.then(|| firm.with(looser * firm.strength));
        let coarse = Evaluator { substeps: COARSE, widest: 8.0, guide, ..evaluator.clone() };
        let at = coarse.fit(&structure, from, Effort { steps: if held { 0 } else { 2 }, tolerance: 1.0 })?;
        // The parts where most is left over are enough for screening; along the measured path they begin as they were measured.
        let parts = if far && in_parts { Parts::of(&coarse, &structure, &at, SHOWN) } else { None };
        let on_parts = parts.as_ref().map_or_else(|| coarse.clone(), |p| p.evaluator(&coarse));
        let base = if guided { on_parts.fit(&structure, &at.values, Effort { steps: 12, tolerance: 1.0 }) } else { None };
        Some((coarse, parts, base.unwrap_or(at)))
    };
    let from = if held { &start } else { &nominal.values };
    let (mut coarse, mut parts, mut base) = led(from, 1.0, true).ok_or(SearchError::RunsAway)?;
    if held
        && let Some(there) = middle.residuals(&structure, &base.values)
        && let Some(other) = worst_first(&middle, &structure, &base.values, &there, [8, 2])
        && other.cost < 0.99 * nominal.cost
        && let Some(other) = evaluator.fit(&structure, &other.values, effort)
        && other.cost < nominal.cost
    {
        nominal = other;
    }
    nominal = to_its_end(&evaluator, &structure, nominal);
    // Where the nominal model explains the path as it is led there, every physics looks as good as any other.
    let left = |fit: &Fit| fit.cost / fit.residuals.len().max(1) as f64;
    let enough = SHOWS.min(SHARE * left(&nominal));
    for (looser, in_parts) in if held { LOOSER.as_slice() } else { &[] } {
        if left(&base) > enough {
            break;
        }
        if let Some(other) = led(&base.values, *looser, *in_parts) {
            (coarse, parts, base) = other;
        }
    }
    let nominal = candidate(&evaluator, structure.clone(), nominal);

    let withheld: Vec<&str> = settings.without.iter().map(String::as_str).collect();
    let mut hypotheses = hypothesis::without(hypothesis::all(&model, &scales), &withheld);
    let mut classes = HashSet::new();
    hypotheses.retain(|h| {
        let is_number = h.same_as.as_ref().is_some_and(|path| problem.stated.iter().any(|s| s.path == *path));
        !is_number && classes.insert(h.class.clone())
    });

    report("looking for ripples");
    let ripples = view::ripples(&seen, &model, &evaluator.floor, &mut hypotheses);
    report("screening");
    let share = if far { 0.08 } else { 0.2 };
    let mut views = vec![View::of(&coarse, parts.as_ref(), (&structure, base), &hypotheses, settings.patience.mul_f64(share), guided)];
    // Some effects show better on a free simulation; and the refit of a wrong structure may have carried the numbers off, so that
    // without a measured path the given ones are another base.
    let free = Evaluator { guide: None, ..coarse.clone() };
    let (from, steps) = if held { (&nominal.fit.values, 2) } else { (&start, 0) };
    let other = if far { free.fit(&structure, from, Effort { steps, tolerance: 1.0 }) } else { None };
    let free_parts = other.as_ref().and_then(|fit| Parts::of(&free, &structure, fit, SHOWN));
    if let Some(fit) = other {
        views.push(View::of(&free, free_parts.as_ref(), (&structure, fit), &hypotheses, settings.patience.mul_f64(share), false));
    }
    let view = &views[0];
    let course = Course {
        evaluator: &evaluator,
        along: guided.then_some((&view.evaluator, &view.base)),
        hypotheses: &hypotheses,
        nominal: &nominal,
        given: &given,
        coarse: COARSE,
    };
    // A simpler law that does as well is worth a little more than the time.
    let longer = Evaluator { until: Some(began + settings.patience.mul_f64(0.92)), ..evaluator.clone() };
    let mut tried: Vec<Tried> = Vec::new();
    for promise in views.iter().flat_map(|v| v.simple.iter().chain(&v.rich)) {
        let id = &hypotheses[promise.hypothesis].id;
        match tried.iter_mut().find(|t| t.id == *id) {
            Some(t) => t.promised = t.promised.max(promise.share),
            None => tried.push(Tried { id: id.clone(), promised: promise.share, taken: None }),
        }
    }
    tried.sort_by(|a, b| b.promised.total_cmp(&a.promised));

    let mut found: Vec<Candidate> = Vec::new();
    // At the floor only what promises more than chance is worth a fit.
    let quiet = nominal.is_white() || nominal.levels.iter().all(|l| *l < AT_FLOOR);
    let chance = CHANCE * nominal.correlation_time / samples as f64;
    let mut singles: Vec<Seed> = Vec::new();
    for rank in 0..16 {
        for view in &views {
            let mut used = HashSet::new();
            let Some(promise) = view.simple.iter().filter(|p| used.insert(p.hypothesis)).nth(rank) else { continue };
            // Those that promise little beside the best wait.
            let top = view.simple.first().map_or(0.0, |p| p.share);
            let wanted = if quiet {
                rank < 8 && promise.share > chance
            } else {
                rank < 3 || rank < if guided { 14 } else { 8 } && promise.share > 0.5 * top
            };
            if wanted {
                singles.push(view.seed(vec![(promise.hypothesis, promise.values.clone())]));
            }
        }
    }
    distinct(&mut singles);
    // To first order a law may do no more than the nominal model's numbers do together, so that screening sees nothing of it, and still be what is
    // missing: where little is left over those of one number are fitted whatever they promise.
    let plain: Vec<Seed> = if far {
        Vec::new()
    } else {
        let one = |(index, h): (usize, &Hypothesis)| {
            let start = h.starts.first().filter(|start| start.len() == 1)?;
            Some(view.seed(vec![(index, start.clone())]))
        };
        hypotheses.iter().enumerate().filter_map(one).collect()
    };
    use Wave::*;
    let mut waves = vec![Ripples, First, GivenBack, Laws, Singles, Plain, Relatives, Elsewhere, Relatives];
    if !quiet {
        waves.extend([Finer, Pairs, Laws, Exchanges, Richer, MoreSingles, MorePairs, Laws, Exchanges, Elsewhere]);
        for _ in 2..settings.effects {
            waves.extend([More, Anew, Exchanges]);
        }
        waves.extend([Elsewhere, Relatives]);
    }
    let (mut singles, mut plain) = (singles.into_iter(), plain.into_iter());
    let mut effects = 1;
    // Substeps that blur less than what is left over.
    let mut fine = COARSE;
    // The best whose relatives were tried, and the one that other places were tried for.
    let (mut related, mut moved_about) = (String::new(), String::new());
    for wave in waves {
        // They are rivals of the best however little it leaves over, and so are laws of one number where it took more.
        let takes_more = |c: &Candidate| c.structure.numbers.len() > nominal.structure.numbers.len() + 1;
        let of_the_best = matches!(wave, GivenBack | Relatives | Elsewhere) || wave == Plain && found.first().is_some_and(takes_more);
        if late(if of_the_best { 0.85 } else { 0.7 }) || (!of_the_best && done(&found, &nominal, samples)) {
            continue;
        }
        if wave == Elsewhere {
            let law = simplest(&found, samples).map_or_else(String::new, |c| key_of(&c.structure.added));
            if law == moved_about {
                continue;
            }
            moved_about = law;
        }
        let best = |found: &[Candidate]| found.first().map_or_else(String::new, |c| key_of(&c.structure.added));
        if wave == Relatives && related == best(&found) {
            continue;
        }
        report(wave.name());
        let mut seeds: Vec<Seed> = match wave {
            // Along the measured path a ripple slides out of phase.
            Ripples if guided => {
                let beside = (&nominal.structure, &nominal.fit.values[..]);
                ripples.iter().take(RIPPLES).map(|ripple| Seed::beside(problem, beside, vec![ripple.clone()], false)).collect()
            }
            Ripples => Vec::new(),
            // Those that promise most first: where one of them reaches the floor, the rest have nothing left to explain.
            First => singles.by_ref().take(if guided { 30 } else { 4 }).collect(),
            // Near the noise, where what numbers have taken on is all that a law does.
            GivenBack if far => Vec::new(),
            GivenBack => course.given_back(&view.simple, chance),
            // Where one law helps another one may be the right one: every law there, from every start.
            Laws => {
                // Along the measured path what is far off was tried already.
                let near = |c: &&Candidate| !guided || c.fit.cost < NEAR * samples as f64;
                let mut seeds = found.first().filter(near).map_or_else(Vec::new, |best| course.laws(&best.structure, &best.fit.values));
                if !guided {
                    // Without one each costs a fit: those that promise most.
                    let own = |s: &Seed| -> f64 {
                        let promised = |h: &usize| tried.iter().find(|t| t.id == hypotheses[*h].id).map_or(0.0, |t| t.promised);
                        s.effects.iter().map(|(h, _)| promised(h)).sum()
                    };
                    seeds.sort_by(|a, b| own(b).total_cmp(&own(a)));
                    distinct(&mut seeds);
                    seeds.truncate(6);
                }
                seeds
            }
            Singles => singles.by_ref().take(if guided { 30 } else { 5 }).collect(),
            Plain => plain.by_ref().collect(),
            MoreSingles => singles.by_ref().collect(),
            // The place that a law was found at first may be a neighbour of its own.
            Elsewhere => simplest(&found, samples).map_or_else(Vec::new, |law| course.elsewhere(law)),
            // How finely a law is drawn is no physics: that comes before another effect.
            Finer => course.finer(&found),
            // A law that wins with more numbers has to win over its simpler relatives, whatever these promised; and far from the noise, where fits were cut
            // short, the first that came near may not be the one.
            Relatives => course.relatives(&found, done(&found, &nominal, samples)),
            Richer => {
                // In the place of what is the best of its kind.
                let best = distinct_structures(&found, 1).next().map(|c| &c.structure.added[0]);
                let like = |h: &Hypothesis| best.is_some_and(|b| b.place.same(&h.place) && ["friction", "hysteresis"].contains(&b.family));
                let rich = views[0].rich.iter().find(|p| like(&hypotheses[p.hypothesis]));
                rich.map(|p| views[0].seed(vec![(p.hypothesis, p.values.clone())])).into_iter().collect()
            }
            Pairs => {
                effects = 2;
                let mut seeds: Vec<Seed> = views.iter().flat_map(|view| view.pairs(&hypotheses, 5)).collect();
                for base in distinct_structures(&found, 1).take(3) {
                    seeds.extend(course.extensions(view, base, 4));
                }
                seeds
            }
            MorePairs => distinct_structures(&found, 1).take(5).flat_map(|base| course.extensions(view, base, 7)).collect(),
            // A first step may have been the wrong one.
            Exchanges => {
                let best = found.iter().find(|c| c.structure.added.len() == effects);
                best.map_or_else(Vec::new, |best| course.exchanges(view, best, 4))
            }
            More => {
                effects += 1;
                distinct_structures(&found, effects - 1).take(3).flat_map(|base| course.extensions(view, base, 5)).collect()
            }
            Anew => {
                let best = distinct_structures(&found, effects - 1).next();
                // The first step to it may have been the wrong one: so from the best without that, too.
                let without = |first: &Hypothesis| {
                    distinct_structures(&found, effects - 1).find(|c| c.structure.added.iter().all(|h| h.physics != first.physics))
                };
                let other = best.and_then(|b| b.structure.added.first()).filter(|_| !late(0.5)).and_then(without);
                let mut seeds = Vec::new();
                fine = COARSE;
                for base in best.into_iter().chain(other) {
                    let substeps = substeps_for(&view.evaluator, base);
                    fine = fine.max(substeps);
                    seeds.extend(course.anew(&Evaluator { substeps, ..view.evaluator.clone() }, base, settings.patience.mul_f64(ANEW)));
                }
                seeds
            }
        };
        // Some start anew beside the numbers of the best, even those whose own race went wrong.
        let anew = matches!(wave, GivenBack | Relatives | Elsewhere | Finer);
        if !anew {
            distinct(&mut seeds);
        }
        let known: HashSet<String> = found.iter().map(|c| key_of(&c.structure.added)).collect();
        seeds.retain(|s| anew || !known.contains(&key_of(s.effects.iter().map(|(h, _)| &hypotheses[*h]))));
        // Where it leaves much over, another effect may be what is missing: other laws in its place have their share of the time, and no more.
        let more_to_come = found.first().is_none_or(|c| c.fit.cost > NEAR * samples as f64);
        let aside = Moment::now() + settings.patience.mul_f64(if more_to_come { wave.aside() } else { 1.0 });
        let held_against = if matches!(wave, Elsewhere | Relatives) { &longer } else { &evaluator };
        let held_against = Evaluator { until: held_against.until.map(|end| end.min(aside)), ..held_against.clone() };
        let course = Course { evaluator: &held_against, ..course };
        // What only shows beside a law that was found shows little along the path of the nominal model.
        let raced = match wave {
            Anew => Course { along: None, coarse: fine, ..course }.race(seeds, wave.keep()),
            Finer | Ripples | Elsewhere | Relatives => Course { along: None, ..course }.race(seeds, wave.keep()),
            _ => course.race(seeds, wave.keep()),
        };
        found.extend(raced);
        sort(&mut found, samples);
        let comes_near = found.first().is_some_and(|c| c.levels.iter().all(|l| *l < NOMINAL_END));
        if wave == Finer && comes_near && !late(0.6) {
            // Before others are tried from the numbers of the best; where it leaves much over, more is missing than a mass.
            let until = (began + settings.patience.mul_f64(0.75)).min(Moment::now() + settings.patience.mul_f64(REVIVING));
            let evaluator = Evaluator { until: Some(until), ..evaluator.clone() };
            found.extend(polished(&evaluator, course.revived(&found)));
            sort(&mut found, samples);
        }
        if wave == Relatives {
            related = best(&found);
        }
    }
    let stopped = late(1.0);
    report("fitting the best to the end");
    // An effect may only have led the rest out of a wrong valley: each of the best's is left out again, the others from where they are now; and a law of many
    // numbers has to win over those that it contains. One such step may open the next.
    let last = Evaluator { until: Some(began + settings.patience.mul_f64(0.95)), ..evaluator.clone() };
    for _ in 0..SIMPLER {
        let before = found.first().map(|c| key_of(&c.structure.added));
        let mut starts = course.fewer(&found);
        if !done(&found, &nominal, samples) {
            starts.extend(course.revived(&found));
        }
        found.extend(polished(&last, starts));
        sort(&mut found, samples);
        if found.first().map(|c| key_of(&c.structure.added)) == before {
            break;
        }
    }
    let best = found.first().map_or(f64::INFINITY, |c| c.fit.cost);
    // Those that could still win, or tie with the best.
    let unit = best / samples as f64;
    let open = |c: &Candidate| c.fit.foreseen > 0.5 * unit && c.fit.cost - 2.0 * c.fit.foreseen < best + 20.0 * unit * c.correlation_time;
    let ends: Vec<usize> = (0..found.len().min(6)).filter(|i| found[*i].fit.cost < 1.5 * best && open(&found[*i])).collect();
    let polished: Vec<(usize, Fit)> =
        ends.par_iter().filter_map(|i| Some((*i, last.fit(&found[*i].structure, &found[*i].fit.values, POLISH)?))).collect();
    for (i, fit) in polished {
        found[i] = candidate(&evaluator, found[i].structure.clone(), fit);
    }
    sort(&mut found, samples);
    // The numbers of what was found may lead the nominal model out of a wrong basin: then there was less to find.
    let mut better = None;
    let last = Evaluator { until: Some(began + settings.patience.mul_f64(0.97)), ..evaluator.clone() };
    let numbers = |c: &Candidate| (c.structure.stated_of(problem, &c.fit.values), c.structure.of_records(&c.fit.values));
    let own = numbers(&nominal);
    let others = found.iter().take(2).map(numbers);
    // Far from the noise its last thousandths say nothing.
    let effort = if is_far { Effort { steps: 8, tolerance: 3.0 } } else { Effort::FULL };
    let last = Evaluator { substeps: if is_far { MIDDLE } else { last.substeps }, ..last };
    for (stated, of_records) in others.chain(is_far.then_some(own)) {
        let start = nominal.structure.values(problem, &stated, &[], &of_records);
        let least = better.as_ref().map_or(nominal.fit.cost, |f: &Fit| f.cost);
        if let Some(fit) = last.fit(&nominal.structure, &start, effort)
            && fit.cost < 0.999 * least
        {
            better = Some(fit);
        }
    }
    let mut nominal = nominal;
    if let Some(fit) = better {
        let fit = to_its_end(&last, &nominal.structure, fit);
        nominal = candidate(&evaluator, nominal.structure, fit);
    }
    let mut seen = HashSet::new();
    found.retain(|c| seen.insert(key_of(&c.structure.added)));
    // The best with so many effects each are held against the recordings that no fit has seen: those may speak for fewer effects than fits do.
    let unseen_samples = Evaluator { records: &problem.held_out, ..Evaluator::new(problem) }.len();
    let mut so_many = vec![0; found.iter().map(|c| c.structure.added.len() + 1).max().unwrap_or(0)];
    let finalists = found.iter_mut().filter(|c| {
        let before = so_many.get_mut(c.structure.added.len());
        before.is_some_and(|n| std::mem::replace(n, *n + 1) < FINALISTS)
    });
    let mut finalists: Vec<&mut Candidate> = finalists.chain(std::iter::once(&mut nominal)).collect();
    finalists.par_iter_mut().for_each(|c| {
        c.unseen = unseen(problem, &problem.held_out, &c.structure, &c.fit.values, &evaluator.floor);
    });
    for t in &mut tried {
        let single = found.iter().find(|c| c.structure.added.len() == 1 && c.structure.added[0].id == t.id);
        t.taken = single.map(|c| 1.0 - c.fit.cost / nominal.fit.cost);
    }
    let simulations = evaluator.simulations.load(Ordering::Relaxed);
    let (floor, count) = (evaluator.floor.clone(), hypotheses.len());
    let detectable = view::detectable(view, samples, &hypotheses);
    Ok(Search { floor, levels_given, nominal, found, tried, hypotheses: count, samples, unseen_samples, detectable, simulations, stopped })
}

/// Each fitted from where it starts.
fn polished(evaluator: &Evaluator, structures: Vec<(Structure, Vec<f64>)>) -> Vec<Candidate> {
    let fits = structures.into_par_iter().filter_map(|(structure, start)| Some((evaluator.fit(&structure, &start, POLISH)?, structure)));
    fits.map(|(fit, structure)| candidate(evaluator, structure, fit)).collect()
}

/// Size of most of the residuals, floors, that a fit with the floors `before` left over; a few that are far off do not count.
fn bulk(residuals: &[f64], before: &[f64], evaluator: &Evaluator) -> f64 {
    let mut sizes: Vec<f64> = Vec::with_capacity(residuals.len());
    for (_, output, range) in evaluator.layout() {
        let scale = before[output] / evaluator.floor[output];
        sizes.extend(residuals.get(range).unwrap_or(&[]).iter().map(|r| scale * r.abs()));
    }
    let middle = sizes.len() / 2;
    // The median of white noise is 0.6745 of its standard deviation.
    if sizes.is_empty() { 1.0 } else { 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Fewest substeps per sample with which a simulation errs by less than a structure leaves over.
fn substeps_for(evaluator: &Evaluator, candidate: &Candidate) -> usize {
    let of = |substeps: usize| Evaluator { substeps, ..evaluator.clone() }.residuals(&candidate.structure, &candidate.fit.values);
    let Some(exact) = of(FINEST) else { return MIDDLE };
    let size: f64 = exact.iter().map(|x| x * x).sum();
    let errs = |substeps: &usize| {
        let off = of(*substeps).map_or(f64::INFINITY, |r| r.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b)).sum());
        off > BLUR * size
    };
    [COARSE, MIDDLE, 2 * MIDDLE, 4 * MIDDLE].into_iter().find(|s| !errs(s)).unwrap_or(FINEST)
}

/// The best, or far from the noise, where the law is open as well as its place, what does nearly as well with the fewest numbers.
fn simplest(found: &[Candidate], samples: usize) -> Option<&Candidate> {
    let best = found.first()?;
    if best.fit.cost < NEAR * samples as f64 {
        return Some(best);
    }
    let like = |c: &&Candidate| c.structure.added.len() == best.structure.added.len() && c.fit.cost < TWICE * best.fit.cost;
    found.iter().filter(like).min_by_key(|c| c.structure.numbers.len())
}

/// The ids of a structure's effects, whatever their order.
pub(crate) fn key_of<'h>(added: impl IntoIterator<Item = &'h Hypothesis>) -> String {
    let mut ids: Vec<&str> = added.into_iter().map(|h| h.id.as_str()).collect();
    ids.sort_unstable();
    ids.join("+")
}

/// The best candidates of so many effects, each structure once.
fn distinct_structures(found: &[Candidate], effects: usize) -> impl Iterator<Item = &Candidate> {
    let mut seen = HashSet::new();
    found.iter().filter(move |c| c.structure.added.len() == effects && seen.insert(key_of(&c.structure.added)))
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

pub(crate) fn candidate(evaluator: &Evaluator, structure: Structure, fit: Fit) -> Candidate {
    let correlation_time = correlation_time(evaluator, &fit.residuals);
    let (levels, slowness) = (levels(evaluator, &fit.residuals), slowness(evaluator, &fit.residuals));
    Candidate { structure, fit, correlation_time, slowness, levels, unseen: None }
}

/// Near the noise the end of a fit counts: what is left over short of it looks like missing physics.
fn to_its_end(evaluator: &Evaluator, structure: &Structure, fit: Fit) -> Fit {
    let near = levels(evaluator, &fit.residuals).iter().all(|l| *l < FAR);
    if !near || white(correlation_time(evaluator, &fit.residuals), slowness(evaluator, &fit.residuals)) {
        return fit;
    }
    let ended = evaluator.fit_knowing(structure, &fit.values, Effort::FULL, Some((structure, &fit)));
    ended.filter(|e| e.cost < fit.cost).unwrap_or(fit)
}

/// Sorts by price, with the correlation time of the one that costs least.
fn sort(found: &mut [Candidate], samples: usize) {
    let best = found.iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost)).map_or(1.0, |c| c.correlation_time);
    found.sort_by(|a, b| price(a, samples, best).total_cmp(&price(b, samples, best)));
}

/// Whether the best structure leaves nothing that another effect could explain.
fn done(found: &[Candidate], nominal: &Candidate, samples: usize) -> bool {
    let best = found.first().filter(|b| advantage_over(nominal, b, samples) > 0.0).unwrap_or(nominal);
    best.is_white()
}

/// How much better a candidate is than another one, with the correlation time of the better.
pub fn advantage_over(base: &Candidate, better: &Candidate, samples: usize) -> f64 {
    let (a, b) = (base.structure.numbers.len(), better.structure.numbers.len());
    advantage(base.fit.cost, a, better.fit.cost.max(1e-300), b, samples, better.correlation_time)
}
