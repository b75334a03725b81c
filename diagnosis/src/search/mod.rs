//! Which physics was left out: from the nominal model, refitted, to the structures that explain the recordings best.

mod ending;
mod next;
mod nominal;
mod trials;
mod view;
mod wave;

use crate::compare::Unseen;
use crate::fit::{Effort, Evaluator, Fit};
use crate::hypothesis::{Hypothesis, Place};
use crate::parts::Parts;
use crate::physics;
use crate::problem::Problem;
use crate::race::Course;
use crate::statistics::{advantage, correlation_time, levels, slowness};
use crate::structure::Structure;
use crate::work::{Budget, Limit, PER_SECOND, Steps};
use ending::polished;
use nominal::{Nominal, SHOWN};
use std::collections::HashSet;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use trials::Trials;
use view::View;

/// How to search.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Physics that are withheld, and with them all that contain one.
    pub without: Vec<String>,
    /// Effects at once, at most.
    pub effects: usize,
    /// How much it may compute, as a multiple of what it does by default: the verdict depends on this, and not on how fast or busy a machine is.
    pub effort: f64,
    /// How long it may take on the clock, all in all. What that cuts off may differ from machine to machine, so a verdict says where it did.
    pub patience: Duration,
}

/// What a search computes with an effort of 1.
pub const EFFORT: Steps = 1_200_000_000;

/// How long a search may take on the clock where nothing else is said: far longer than the default effort takes on a slow machine.
pub const PATIENCE: Duration = Duration::from_secs(600);

impl Default for Settings {
    fn default() -> Settings {
        Settings { without: Vec::new(), effects: 3, effort: 1.0, patience: PATIENCE }
    }
}

impl Settings {
    /// Work that the search may do.
    pub fn work(&self) -> Steps {
        (self.effort.max(0.0) * EFFORT as f64) as Steps
    }

    /// What ends a search that begins now from outside.
    pub fn limit<'a>(&self, stop: Option<&'a AtomicBool>) -> Limit<'a> {
        Limit { stop, deadline: Instant::now().checked_add(self.patience) }
    }

    /// About how long that takes on two threads of a laptop, for progress bars.
    pub fn expected(&self) -> Duration {
        Duration::from_secs_f64((self.work() as f64 / PER_SECOND).min(self.patience.as_secs_f64()))
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
    pub simulations: u64,
    /// Steps of simulations, of the model with its elements taken together: what it computed.
    pub work: Steps,
    /// Whether its effort ended before everything was tried.
    pub exhausted: bool,
    /// Whether it was interrupted, or the time on the clock ended it.
    pub cut: bool,
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
/// Substeps per sample, at most: for screening and the first steps of fits, and for their middle.
pub(crate) const COARSE: usize = 2;
/// See [`COARSE`].
pub(crate) const MIDDLE: usize = 4;
/// Level above which the nominal model's refit is brought to its end after the search only, and vanished numbers of a law stay so until its end, floors.
const NOMINAL_END: f64 = 5.0;
/// A residual at its floor has this level, up to chance and rounding.
pub const AT_FLOOR: f64 = 1.04;

/// How much work a search may do.
struct Work<'a> {
    budget: Budget<'a>,
}

impl<'a> Work<'a> {
    /// So much of it.
    fn share(&self, share: f64) -> Steps {
        (share * self.budget.end() as f64) as Steps
    }

    /// A budget that ends when so much of it is gone.
    fn up_to(&self, share: f64) -> Budget<'a> {
        self.budget.extended(self.share(share))
    }

    /// Whether so much of it is gone, or the search is to stop.
    fn is_past(&self, share: f64) -> bool {
        self.up_to(share).is_over()
    }
}

/// Searches.
///
/// # Errors
/// When the nominal model cannot be simulated on the recordings.
pub fn search(problem: &Problem, settings: &Settings, limit: Limit, report: &(dyn Fn(&str) + Sync)) -> Result<Search, SearchError> {
    let work = Work { budget: Budget::new(settings.work(), limit) };
    let nominal = Nominal::refitted(problem, &work, report)?;
    let (evaluator, refitted) = (&nominal.evaluator, &nominal.refitted);
    let samples = refitted.fit.residuals.len();
    let mut hypotheses = hypotheses_for(&nominal, settings);
    report("looking for ripples");
    let ripples = view::ripples(&nominal.seen, &nominal.model, &evaluator.floor, &mut hypotheses);
    report("screening");
    let led = &nominal.led;
    let seeing = work.share(if nominal.far { 0.08 } else { 0.2 });
    let base = (&refitted.structure, led.fit.clone());
    let mut views = vec![View::of(&led.coarse, led.parts.as_ref(), base, &hypotheses, seeing, nominal.guided)];
    // Some effects show better on a free simulation; and the refit of a wrong structure may have carried the numbers off, so that
    // without a measured path the given ones are another base.
    let free = Evaluator { guide: None, ..led.coarse.clone() };
    let (from, steps) = if nominal.held { (&refitted.fit.values, 2) } else { (&nominal.start, 0) };
    let other = if nominal.far { free.fit(&refitted.structure, from, Effort { steps, tolerance: 1.0 }) } else { None };
    let free_parts = other.as_ref().and_then(|fit| Parts::of(&free, &refitted.structure, fit, SHOWN));
    if let Some(fit) = other {
        views.push(View::of(&free, free_parts.as_ref(), (&refitted.structure, fit), &hypotheses, seeing, false));
    }
    let view = &views[0];
    let course = Course {
        evaluator,
        along: nominal.guided.then_some((&view.evaluator, &view.base)),
        hypotheses: &hypotheses,
        nominal: refitted,
        given: &nominal.given,
        coarse: COARSE,
    };
    let mut tried = promised(&views, &hypotheses);
    let mut trials = Trials::new(course, &views, &tried, &ripples, nominal.far, &work);
    trials.run(settings, report);
    let exhausted = trials.left_out;
    let mut found = trials.found;
    report("fitting the best to the end");
    ending::make_simpler(&course, &mut found, &work);
    ending::bring_to_their_ends(evaluator, &mut found, samples, &work);
    let mut refitted = ending::nominal_at_its_end(&nominal, &found, &work);
    let mut seen = HashSet::new();
    found.retain(|c| seen.insert(key_of(&c.structure.added)));
    let unseen_samples = ending::hold_against_unseen(evaluator, &mut found, &mut refitted);
    for t in &mut tried {
        let single = found.iter().find(|c| c.structure.added.len() == 1 && c.structure.added[0].id == t.id);
        t.taken = single.map(|c| 1.0 - c.fit.cost / refitted.fit.cost);
    }
    Ok(Search {
        floor: evaluator.floor.clone(),
        levels_given: nominal.levels_given.clone(),
        found,
        tried,
        hypotheses: hypotheses.len(),
        samples,
        unseen_samples,
        detectable: view::detectable(view, samples, &hypotheses),
        simulations: work.budget.simulations(),
        work: work.budget.spent(),
        exhausted,
        cut: work.budget.was_cut(),
        nominal: refitted,
    })
}

/// What may be missing: everything that is no stated number, each class once.
fn hypotheses_for(nominal: &Nominal, settings: &Settings) -> Vec<Hypothesis> {
    let problem = nominal.evaluator.problem;
    let withheld: Vec<&str> = settings.without.iter().map(String::as_str).collect();
    let mut hypotheses = physics::without(physics::all(&nominal.model, &nominal.scales), &withheld);
    let mut classes = HashSet::new();
    hypotheses.retain(|h| {
        let is_number = h.same_as.as_ref().is_some_and(|path| problem.stated.iter().any(|s| s.path == *path));
        !is_number && classes.insert(h.class.clone())
    });
    hypotheses
}

/// What screening promised of each, the most first.
fn promised(views: &[View], hypotheses: &[Hypothesis]) -> Vec<Tried> {
    let mut tried: Vec<Tried> = Vec::new();
    for promise in views.iter().flat_map(|v| v.simple.iter().chain(&v.rich)) {
        let id = &hypotheses[promise.hypothesis].id;
        match tried.iter_mut().find(|t| t.id == *id) {
            Some(t) => t.promised = t.promised.max(promise.share),
            None => tried.push(Tried { id: id.clone(), promised: promise.share, taken: None }),
        }
    }
    tried.sort_by(|a, b| b.promised.total_cmp(&a.promised));
    tried
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

pub(crate) fn candidate(evaluator: &Evaluator, structure: Structure, fit: Fit) -> Candidate {
    let correlation_time = correlation_time(evaluator, &fit.residuals);
    let (levels, slowness) = (levels(evaluator, &fit.residuals), slowness(evaluator, &fit.residuals));
    Candidate { structure, fit, correlation_time, slowness, levels, unseen: None }
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
