//! Where model and recording part: the unknown force at every place that would make the nominal model reproduce the recordings.
//!
//! For each place the deviation of the device from the simulated nominal model obeys linear equations driven by a latent force there
//! (after Rogers & Friis 2022); a smoother finds the force, its standard deviation and the likelihood of the recordings. What is not linear in
//! the nominal model enters as known forces along the path that the device really took, found by iteration. Sign jumps survive because the
//! force may jump where the place's motion reverses (after Marino & Cicirello 2023). Each force is then tabulated against what moves
//! at its place (`law`); the place whose force follows the simplest law explains the recordings best.

mod channel;
mod character;
mod classes;
mod law;
mod nonlinear;
mod period;
mod smoother;
#[cfg(test)]
mod tests;
mod trajectory;

pub use character::Character;
pub use law::{Form, Law, Point, Variable};
pub use period::{Ripple, scan};

use crate::hypothesis::Place;
use backdrive_plant::model::{InputKind, Model};
use backdrive_plant::stepper::CompileError;
use channel::{Channel, Split, channels};
use law::{Reversals, Samples};
pub(crate) use nonlinear::force_along;
use nonlinear::{extra_forces, rms, sizes};
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use smoother::{Data, Smoothed, System};
use trajectory::Trajectory;

/// A recording, as columns.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    /// For messages and reports.
    pub name: &'a str,
    /// Sample time, s.
    pub period: f64,
    /// Samples of each input of the model.
    pub inputs: &'a [Vec<f64>],
    /// Samples of each output of the model; `None` where it was not recorded.
    pub outputs: Vec<Option<&'a [f64]>>,
    /// The model with the numbers that differ in this run; `None` where none do.
    pub model: Option<&'a Model>,
}

impl<'a> From<&'a crate::problem::Record> for Run<'a> {
    fn from(record: &'a crate::problem::Record) -> Run<'a> {
        let outputs = record.outputs.iter().map(|column| column.as_deref()).collect();
        Run { name: &record.name, period: record.period, inputs: &record.inputs, outputs, model: None }
    }
}

/// How to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Laws of each form and place that are put to the test of the recordings.
    pub laws_of_a_form: usize,
    /// Places, best first, at which the force may jump at reversals.
    pub jumps_at: usize,
    /// Iterations for nonlinear elements of the nominal model.
    pub iterations: usize,
    /// Samples of all runs together, at most: of longer ones every second, third, ... is taken.
    pub most_samples: usize,
    /// The only place to look at; all places where there is none.
    pub only: Option<Place>,
    /// Whether filters are tuned on the run with the largest mismatch alone.
    pub tuned_on_one: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options { laws_of_a_form: 2, jumps_at: 4, iterations: 2, most_samples: usize::MAX, only: None, tuned_on_one: false }
    }
}

impl Options {
    /// Fast rather than fine: for a set of any length in a second or two.
    pub fn quick() -> Options {
        Options { laws_of_a_form: 1, jumps_at: 0, iterations: 1, most_samples: 30_000, only: None, tuned_on_one: true }
    }
}

/// Why nothing can be located.
#[derive(Debug, thiserror::Error)]
pub enum LocateError {
    /// The model cannot be simulated.
    #[error("the model cannot be simulated: {0}")]
    Model(#[from] CompileError),
    /// Columns are missing.
    #[error("{run}: has columns for {inputs} inputs and {outputs} outputs, fewer than the model")]
    Columns {
        /// The recording.
        run: String,
        /// Input columns.
        inputs: usize,
        /// Output columns.
        outputs: usize,
    },
    /// No smoother has anything to do.
    #[error("{run}: has {samples} samples; at least 16 are needed to locate a force")]
    TooShort {
        /// The recording.
        run: String,
        /// Samples.
        samples: usize,
    },
    /// The model left all bounds.
    #[error("{run}: the model's motion grows beyond all bounds; refit it first")]
    Diverged {
        /// The recording.
        run: String,
    },
    /// None of the outputs was recorded.
    #[error("{run}: none of the model's outputs was recorded")]
    NothingMeasured {
        /// The recording.
        run: String,
    },
    /// There is nothing to look at.
    #[error("there are no recordings to locate anything in")]
    NoRuns,
    /// A noise level is wrong.
    #[error("there are {found} noise levels, the model has {expected} outputs; each must be a finite number, at least 0")]
    Noise {
        /// Levels.
        found: usize,
        /// Outputs.
        expected: usize,
    },
    /// The linear part of the model has no finite equations.
    #[error("the equations of the model's linear part are singular; a body has no inertia, or numbers are too far apart")]
    Singular,
}

/// The force at a place over one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Course {
    /// The run.
    pub run: String,
    /// Sample time, s.
    pub period: f64,
    /// Force as that of an element there, N or N m; the error in the signal's unit at a motion input or an output.
    pub force: Vec<f64>,
    /// Its standard deviation.
    pub deviation: Vec<f64>,
    /// Displacement and velocity across the place, deviation included; empty at an output.
    pub displacement: Vec<f64>,
    /// m/s.
    pub velocity: Vec<f64>,
}

/// What a place would have to do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Where.
    #[serde(serialize_with = "shown")]
    pub place: Place,
    /// Log-likelihood of the recordings with any force here.
    pub log_likelihood: f64,
    /// What a jump of the force at reversals adds to it; `None` where that was not tried.
    pub jump_gain: Option<f64>,
    /// Log-likelihood with the force that follows the best law, its numbers paid for: what places compete by.
    pub evidence: f64,
    /// Root of the force's mean square.
    pub rms: f64,
    /// Root of its mean variance.
    pub deviation: f64,
    /// Laws, best first: by evidence where it was computed, then by what they explain on other parts of the recordings.
    pub laws: Vec<Law>,
    /// The strongest ripples over displacement, strongest first.
    pub ripples: Vec<Ripple>,
    /// Odd or even, memory, rate, energy; `None` at an output.
    pub character: Option<Character>,
    /// The force itself, one course for each run.
    pub courses: Vec<Course>,
}

/// Places that no sensor tells apart: a force of the same course at one or the other gives the same readings within the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Class {
    /// Indices into [`Location::ranking`], best first.
    pub members: Vec<usize>,
}

/// When, at which frequencies and in which state the mismatch shows, as `where` of a verdict has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Where {
    /// Spans with most of the mismatch, s; empty where it is everywhere.
    pub time: Vec<[f64; 2]>,
    /// Band with nine tenths of its power, Hz.
    pub band_hz: [f64; 2],
    /// In words.
    pub state: String,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Location {
    /// Log-likelihood of the recordings where nothing is missing.
    pub log_likelihood_without: f64,
    /// Mismatch of the nominal model over the noise, root of the mean square over samples and outputs.
    pub mismatch: f64,
    /// Places, best first.
    pub ranking: Vec<Candidate>,
    /// Classes of places that cannot be told apart; every place is in one.
    pub classes: Vec<Class>,
    /// When and in which state.
    pub shows: Where,
}

fn shown<S: Serializer>(place: &Place, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(place)
}

/// Everything that all places share.
struct Scene<'a> {
    model: &'a Model,
    runs: &'a [Run<'a>],
    split: Split<'a>,
    trajectories: Vec<Trajectory>,
    /// Forces of the nonlinear elements beyond their linear part, N, in each run.
    sizes: Vec<Vec<f64>>,
    noise: Vec<f64>,
    options: &'a Options,
}

/// A place under investigation.
struct Trial {
    channel: Channel,
    chain: usize,
    intensity: f64,
    /// Share of their forces that nonlinear elements may be wrong by.
    loose: f64,
    /// Log-likelihood with the steady filter.
    log_likelihood: f64,
    /// Forces of nonlinear elements, for each run.
    forces: Vec<Vec<Vec<f64>>>,
    smoothed: Vec<Smoothed>,
    size: f64,
}

/// The filter that suits a channel best.
struct Best {
    chain: usize,
    loose: f64,
    intensity: f64,
    log_likelihood: f64,
    systems: Vec<System>,
}

/// Finds the latent force at every place of a model. `noise` is the standard deviation of the measuring error of each output, in its unit.
///
/// # Errors
/// When the model cannot be simulated or linearised, or the recordings do not fit it.
pub fn locate(model: &Model, runs: &[Run], noise: &[f64], options: &Options) -> Result<Location, LocateError> {
    if runs.is_empty() {
        return Err(LocateError::NoRuns);
    }
    if noise.len() != model.outputs.len() || noise.iter().any(|n| !n.is_finite() || *n < 0.0) {
        return Err(LocateError::Noise { found: noise.len(), expected: model.outputs.len() });
    }
    let mut trajectories = runs.par_iter().map(|run| Trajectory::of(run.model.unwrap_or(model), run)).collect::<Result<Vec<_>, _>>()?;
    let samples: usize = trajectories.iter().map(|t| t.len).sum();
    let stride = samples.div_ceil(options.most_samples.max(1)).max(1);
    if stride > 1 {
        trajectories.iter_mut().for_each(|t| t.thin(stride));
    }
    let amplitude = {
        let nonlinear = model.elements.iter().map(|e| e.between);
        let across = nonlinear.flat_map(|ends| trajectories.iter().map(move |t| rms(&t.across(ends).0)));
        across.fold(0.0, f64::max) * std::f64::consts::SQRT_2
    };
    let split = Split::of(model, amplitude).ok_or(LocateError::Singular)?;
    let noise = (0..noise.len()).map(|output| floor_of(output, noise[output], &trajectories)).collect();
    let sizes = trajectories.iter().map(|t| sizes(&split, t)).collect();
    let scene = Scene { model, runs, split, trajectories, sizes, noise, options };
    let wanted = |channel: &Channel| options.only.as_ref().is_none_or(|place| scene.stands_for(*channel, place));
    let mut trials: Vec<Trial> = channels(model).into_par_iter().filter(wanted).filter_map(|channel| scene.trial(channel)).collect();
    if trials.is_empty() {
        return Err(LocateError::Singular);
    }
    trials.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    let mut ranking: Vec<(Candidate, usize)> =
        trials.par_iter().enumerate().flat_map_iter(|(i, trial)| scene.candidates(trial).into_iter().map(move |c| (c, i))).collect();
    ranking.sort_by(|a, b| b.0.evidence.total_cmp(&a.0.evidence));
    let leading: Vec<usize> = ranking.iter().take(options.jumps_at).map(|r| r.1).collect();
    ranking
        .par_iter_mut()
        .take(options.jumps_at)
        .zip(leading)
        .for_each(|((candidate, _), trial)| scene.let_jump(candidate, &trials[trial]));
    let channels: Vec<(Channel, usize)> = ranking.iter().map(|r| (trials[r.1].channel, trials[r.1].chain)).collect();
    let ranking: Vec<Candidate> = ranking.into_iter().map(|r| r.0).collect();
    let classes = scene.classes(&ranking, &channels);
    Ok(Location {
        log_likelihood_without: scene.log_likelihood_without(),
        mismatch: scene.mismatch(),
        shows: scene.shows(&ranking),
        ranking,
        classes,
    })
}

/// A noise that is not smaller than what numbers can say of the signal.
fn floor_of(output: usize, given: f64, trajectories: &[Trajectory]) -> f64 {
    let columns = trajectories.iter().filter_map(|t| t.rows.iter().position(|r| *r == output).map(|row| (t, row)));
    let largest = columns.map(|(t, row)| rms(&t.predicted[row]).max(rms(&t.residual[row]))).fold(0.0, f64::max);
    given.max(SMALLEST_NOISE * largest).max(f64::MIN_POSITIVE.sqrt())
}

impl Scene<'_> {
    /// Whether a channel is that of a place.
    fn stands_for(&self, channel: Channel, place: &Place) -> bool {
        let named = |end: Option<usize>| self.model.place_name(end).to_string();
        match (channel, place) {
            (Channel::Force(ends), Place::Between(..)) => Place::Between(named(ends[0]), named(ends[1])).same(place),
            (Channel::Force([Some(body), None] | [None, Some(body)]), Place::Signal(name)) => {
                self.model.inputs.iter().any(|i| i.kind == InputKind::Force && i.on == body && i.name == *name)
            }
            (Channel::Motion(input), Place::Signal(name)) => self.model.inputs[input].name == *name,
            (Channel::Sensor(output), Place::Signal(name)) => self.model.outputs[output].name == *name,
            _ => false,
        }
    }

    /// The filter of a channel; `loose` is the share of their forces that nonlinear elements may be wrong by.
    fn system(&self, channel: Channel, chain: usize, run: usize, scales: [f64; 3], loose: f64) -> Option<System> {
        let trajectory = &self.trajectories[run];
        let mut equations = self.split.equations(channel, chain, &trajectory.rows);
        if loose > 0.0 && !self.split.nonlinear.is_empty() {
            // An error at the very place in question is the unknown itself.
            let here = |ends: [Option<usize>; 2]| matches!(channel, Channel::Force([a, b]) if ends == [a, b] || ends == [b, a]);
            let share = |element: &usize| if here(self.model.elements[*element].between) { 1e-3 * loose } else { loose };
            let sizes: Vec<f64> = self.split.nonlinear.iter().zip(&self.sizes[run]).map(|(e, s)| share(e) * s).collect();
            equations = self.split.loosened(&equations, &sizes, 1.0 / (FORGOTTEN * trajectory.period));
        }
        let noise: Vec<f64> = trajectory.rows.iter().map(|r| self.noise[*r]).collect();
        System::of(&equations, trajectory.period, scales, &noise)
    }

    /// Typical displacement and speed of the deviation, and size of the unknown.
    fn scales(&self, channel: Channel) -> [f64; 3] {
        let of_bodies = |columns: fn(&Trajectory) -> &Vec<Vec<f64>>| {
            self.trajectories.iter().flat_map(|t| columns(t).iter().map(|c| rms(c))).fold(0.0, f64::max).max(1e-12)
        };
        let (x, v) = (of_bodies(|t| &t.position), of_bodies(|t| &t.velocity));
        let size = match channel {
            Channel::Force(ends) => {
                let of_inputs = self.model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Force);
                let driven = of_inputs.flat_map(|(i, _)| self.trajectories.iter().map(move |t| rms(&t.drive[i]))).fold(0.0, f64::max);
                let stiff: f64 = ends.iter().flatten().map(|b| self.split.linear.stiffness[(*b, *b)].abs()).fold(0.0, f64::max);
                let damped: f64 = ends.iter().flatten().map(|b| self.split.linear.damping[(*b, *b)].abs()).fold(0.0, f64::max);
                if driven > 0.0 { driven } else { (stiff * x).max(damped * v) }
            }
            Channel::Motion(_) => x,
            Channel::Sensor(output) => self.largest_reading(output),
        };
        [x, v, 0.1 * if size > 0.0 { size } else { 1.0 }]
    }

    fn largest_reading(&self, output: usize) -> f64 {
        let columns = self.trajectories.iter().filter_map(|t| t.rows.iter().position(|r| *r == output).map(|row| &t.predicted[row]));
        columns.map(|c| rms(c)).fold(0.0, f64::max)
    }

    fn data<'b>(&'b self, forces: &'b [Vec<Vec<f64>>], run: usize, known: &'b [f64]) -> Data<'b> {
        Data { residual: &self.trajectories[run].residual, forces: forces.get(run).map_or(&[], Vec::as_slice), known }
    }

    /// The run with the largest mismatch for its length.
    fn loudest(&self) -> usize {
        let size = |t: &Trajectory| {
            let square = |(row, r): (&usize, &Vec<f64>)| (rms(r) / self.noise[*row]).powi(2);
            t.rows.iter().zip(&t.residual).map(square).sum::<f64>()
        };
        let all = self.trajectories.iter().enumerate();
        all.max_by(|a, b| size(a.1).total_cmp(&size(b.1))).map_or(0, |(run, _)| run)
    }

    fn log_likelihood(&self, systems: &[System], intensity: f64, forces: &[Vec<Vec<f64>>], known: &[&[f64]]) -> f64 {
        let of = |(run, system): (usize, &System)| {
            system.log_likelihood(intensity, self.data(forces, run, known.get(run).copied().unwrap_or(&[])))
        };
        systems.iter().enumerate().map(|s| of(s).unwrap_or(f64::NEG_INFINITY)).sum()
    }

    /// The intensity of greatest likelihood: decades first, then between them.
    fn best_intensity(&self, systems: &[System], forces: &[Vec<Vec<f64>>], known: &[&[f64]], around: Option<f64>) -> (f64, f64) {
        let one = self.options.tuned_on_one.then(|| self.loudest());
        let at = |exponent: f64| {
            let intensity = 10f64.powf(exponent);
            let value = match one.and_then(|run| systems.get(run).map(|system| (run, system))) {
                Some((run, system)) => {
                    let data = self.data(forces, run, known.get(run).copied().unwrap_or(&[]));
                    system.log_likelihood(intensity, data).unwrap_or(f64::NEG_INFINITY)
                }
                None => self.log_likelihood(systems, intensity, forces, known),
            };
            (intensity, value)
        };
        let grid: Vec<f64> = match around {
            // A law takes force away from the latent rest, never adds to it.
            Some(intensity) => [-4.5, -3.0, -1.5, 0.0].map(|d| intensity.log10() + d).to_vec(),
            None => (-4..=4).map(|d| 2.0 * f64::from(d)).collect(),
        };
        let step = if around.is_some() { 0.75 } else { 1.0 };
        let better = |a: (f64, f64), b: (f64, f64)| if b.1 > a.1 { b } else { a };
        let mut best = grid.into_iter().map(&at).fold((1.0, f64::NEG_INFINITY), better);
        for width in [step, 0.5 * step] {
            let centre = best.0.log10();
            best = [at(centre - width), at(centre + width)].into_iter().fold(best, better);
        }
        if one.is_some() {
            best.1 = self.log_likelihood(systems, best.0, forces, known);
        }
        best
    }

    /// Finds the force at a channel.
    fn trial(&self, channel: Channel) -> Option<Trial> {
        let scales = self.scales(channel);
        let chains: &[usize] = match channel {
            Channel::Force(_) => &[1, 2],
            Channel::Motion(_) => &[3],
            Channel::Sensor(_) => &[1],
        };
        let runs = self.trajectories.len();
        let best = |forces: &[Vec<Vec<f64>>], chains: &[usize], loose: &[f64]| {
            let options = chains.iter().flat_map(|chain| loose.iter().map(|loose| (*chain, *loose)));
            let of = |(chain, loose): (usize, f64)| {
                let systems = (0..runs).map(|run| self.system(channel, chain, run, scales, loose)).collect::<Option<Vec<_>>>()?;
                let (intensity, log_likelihood) = self.best_intensity(&systems, forces, &[], None);
                log_likelihood.is_finite().then_some(Best { chain, loose, intensity, log_likelihood, systems })
            };
            options.filter_map(of).max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
        };
        let smooth = |best: &Best, forces: &[Vec<Vec<f64>>]| {
            let one = |(run, s): (usize, &System)| s.smooth(best.intensity, self.data(forces, run, &[]), &[], 0.0);
            best.systems.iter().enumerate().map(one).collect::<Option<Vec<_>>>()
        };
        let with_path = !self.split.nonlinear.is_empty() && !matches!(channel, Channel::Sensor(_));
        // Nonlinear elements push along the path that was really taken: first what the sensors say of it whatever these elements do, then
        // what follows with them as they are.
        let mut found = best(&[], if with_path { &chains[..1] } else { chains }, &[if with_path { LOOSE } else { 0.0 }])?;
        let mut smoothed = smooth(&found, &[])?;
        let mut forces: Vec<Vec<Vec<f64>>> = Vec::new();
        for _ in 0..if with_path { self.options.iterations } else { 0 } {
            let next: Vec<_> = (0..runs).map(|run| self.forces_along(channel, found.chain, run, &smoothed[run])).collect();
            let Some(tighter) = best(&next, chains, &TIGHT) else { break };
            if !forces.is_empty() && tighter.log_likelihood <= found.log_likelihood {
                break;
            }
            let Some(path) = smooth(&tighter, &next) else { break };
            (found, forces, smoothed) = (tighter, next, path);
        }
        let Best { chain, loose, intensity, log_likelihood, .. } = found;
        Some(Trial { channel, chain, intensity, loose, log_likelihood, forces, smoothed, size: scales[2] })
    }

    fn motions(&self, channel: Channel, chain: usize, run: usize, smoothed: &Smoothed) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let equations = self.split.equations(channel, chain, &self.trajectories[run].rows);
        let of = |rows: &[nalgebra::DVector<f64>]| rows.iter().map(|row| smoothed.reading(row)).collect::<Vec<_>>();
        (of(&equations.position), of(&equations.velocity))
    }

    fn forces_along(&self, channel: Channel, chain: usize, run: usize, smoothed: &Smoothed) -> Vec<Vec<f64>> {
        let (position, velocity) = self.motions(channel, chain, run, smoothed);
        extra_forces(&self.split, &self.trajectories[run], &position, &velocity)
    }

    /// The places that a channel stands for: a force on a driven body against ground is an error of the input as well.
    fn candidates(&self, trial: &Trial) -> Vec<Candidate> {
        let named = |end: Option<usize>| self.model.place_name(end).to_string();
        let signal = |name: &str| Place::Signal(name.to_string());
        let mut places: Vec<(Place, Vec<Vec<f64>>)> = Vec::new();
        match trial.channel {
            Channel::Force(ends) => {
                places.push((Place::Between(named(ends[0]), named(ends[1])), Vec::new()));
                if let [Some(body), None] | [None, Some(body)] = ends {
                    let driven = self.model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Force && i.on == body);
                    places.extend(
                        driven.map(|(index, i)| (signal(&i.name), self.trajectories.iter().map(|t| t.drive[index].clone()).collect())),
                    );
                }
            }
            Channel::Motion(input) => {
                places.push((signal(&self.model.inputs[input].name), self.trajectories.iter().map(|t| t.drive[input].clone()).collect()));
            }
            Channel::Sensor(output) => {
                let readings = self.trajectories.iter().map(|t| {
                    let row = t.rows.iter().position(|r| *r == output);
                    row.map_or_else(|| vec![0.0; t.len], |row| t.predicted[row].clone())
                });
                places.push((signal(&self.model.outputs[output].name), readings.collect()));
            }
        }
        places.into_iter().filter_map(|(place, signals)| self.candidate(trial, place, signals)).collect()
    }

    fn courses(&self, trial: &Trial, smoothed: &[Smoothed]) -> Vec<Course> {
        let ends = match trial.channel {
            Channel::Force(ends) => Some(ends),
            Channel::Motion(input) => Some([Some(self.model.inputs[input].on), None]),
            Channel::Sensor(_) => None,
        };
        let one = |(run, smoothed): (usize, &Smoothed)| {
            let trajectory = &self.trajectories[run];
            let (displacement, velocity) = ends.map_or_else(Default::default, |ends| {
                let (x, v) = trajectory.across(ends);
                let (dx, dv) = self.motions(trial.channel, trial.chain, run, smoothed);
                let add = |of: Vec<f64>, columns: &[Vec<f64>]| {
                    let at = |end: Option<usize>, k: usize| end.map_or(0.0, |b| columns[b][k]);
                    of.iter().enumerate().map(|(k, x)| x + at(ends[0], k) - at(ends[1], k)).collect::<Vec<f64>>()
                };
                (add(x, &dx), add(v, &dv))
            });
            Course {
                run: self.runs[run].name.to_string(),
                period: trajectory.period,
                force: smoothed.value.clone(),
                deviation: smoothed.deviation.clone(),
                displacement,
                velocity,
            }
        };
        smoothed.iter().enumerate().map(one).collect()
    }

    fn samples(&self, courses: &[Course], signals: &[Vec<f64>]) -> Samples {
        let joined = |of: fn(&Course) -> &Vec<f64>| courses.iter().flat_map(|c| of(c).iter().copied()).collect::<Vec<f64>>();
        let rates =
            |columns: &mut dyn Iterator<Item = (&Vec<f64>, f64)>| columns.flat_map(|(c, period)| rate(c, period)).collect::<Vec<f64>>();
        let (mut x, mut v) = (joined(|c| &c.displacement), joined(|c| &c.velocity));
        let mut acceleration = rates(&mut courses.iter().map(|c| (&c.velocity, c.period)));
        if !signals.is_empty() {
            // At a signal only what the signal does counts: what moves there is the body's.
            (x, v, acceleration) = (Vec::new(), Vec::new(), Vec::new());
        }
        let mut starts = Vec::new();
        let (mut time, mut run) = (Vec::new(), Vec::new());
        for (index, course) in courses.iter().enumerate() {
            starts.push(time.len());
            time.extend((0..course.force.len()).map(|k| k as f64 * course.period));
            run.extend(std::iter::repeat_n(index, course.force.len()));
        }
        let period = courses.first().map_or(1.0, |c| c.period);
        let reversals = Reversals::of(&x, &starts, period, TURN * rms(&x));
        Samples {
            force: joined(|c| &c.force),
            x,
            v,
            acceleration,
            signal: signals.iter().flatten().copied().collect(),
            signal_rate: rates(&mut signals.iter().zip(courses).map(|(s, c)| (s, c.period))),
            time,
            run,
            reversals,
        }
    }

    fn candidate(&self, trial: &Trial, place: Place, signals: Vec<Vec<f64>>) -> Option<Candidate> {
        let courses = self.courses(trial, &trial.smoothed);
        let samples = self.samples(&courses, &signals);
        let ripples = scan(&samples.x, &samples.v, &samples.force);
        let mut laws = samples.laws(ripples.first());
        let scales = [self.scales(trial.channel)[0], self.scales(trial.channel)[1], trial.size];
        let runs = self.trajectories.len();
        let systems = (0..runs).map(|run| self.system(trial.channel, trial.chain, run, scales, trial.loose)).collect::<Option<Vec<_>>>()?;
        let mut of_forms = [0usize; 3];
        for law in &mut laws {
            // The best of few numbers and the best of many.
            let form = &mut of_forms[law.form as usize];
            if law.held_out_share <= 0.02 || *form >= self.options.laws_of_a_form || law.variable == Variable::Time {
                continue;
            }
            *form += 1;
            let known: Vec<&[f64]> = pieces(&law.fitted, &courses);
            let (_, likelihood) = self.best_intensity(&systems, &trial.forces, &known, Some(trial.intensity));
            let remainder: Vec<f64> = samples.force.iter().zip(&law.fitted).map(|(f, g)| f - g).collect();
            let price = 0.5 * law.numbers as f64 * samples.independent(&remainder).max(2.0).ln();
            law.evidence = Some(likelihood - trial.log_likelihood - price);
        }
        laws.sort_by(|a, b| match (a.evidence, b.evidence) {
            (Some(a), Some(b)) => b.total_cmp(&a),
            (Some(_), None) => std::cmp::Ordering::Less,
            (None, Some(_)) => std::cmp::Ordering::Greater,
            (None, None) => b.held_out_share.total_cmp(&a.held_out_share),
        });
        let gain = laws.first().and_then(|l| l.evidence).unwrap_or(0.0).max(0.0);
        let all: Vec<f64> = courses.iter().flat_map(|c| c.deviation.iter().copied()).collect();
        Some(Candidate {
            place,
            log_likelihood: trial.log_likelihood,
            jump_gain: None,
            evidence: trial.log_likelihood + gain,
            rms: rms(&samples.force),
            deviation: rms(&all),
            character: Character::of(&samples, &laws, courses.first().map_or(1.0, |c| c.period)),
            ripples,
            laws,
            courses,
        })
    }

    /// Lets the force of a leading place jump where its motion reverses, and keeps that where the recordings like it better.
    fn let_jump(&self, candidate: &mut Candidate, trial: &Trial) {
        let Channel::Force(_) = trial.channel else { return };
        if matches!(candidate.place, Place::Signal(_)) {
            return;
        }
        let scales = self.scales(trial.channel);
        let samples = self.samples(&candidate.courses, &[]);
        let mut offset = 0;
        let mut smoothed = Vec::new();
        let mut before = 0.0;
        for (run, course) in candidate.courses.iter().enumerate() {
            let len = course.force.len();
            let at = samples.reversals.at.iter().filter(|k| (offset..offset + len).contains(*k)).map(|k| k - offset);
            // The turning point is known to a sample or two.
            let jumps: Vec<usize> = at.flat_map(|k| k.saturating_sub(1)..(k + 3).min(len)).collect();
            offset += len;
            let Some(system) = self.system(trial.channel, trial.chain, run, scales, trial.loose) else { return };
            let data = self.data(&trial.forces, run, &[]);
            let Some(state) = system.smooth(trial.intensity, data, &jumps, 2.0 * candidate.rms) else { return };
            before += trial.smoothed[run].log_likelihood;
            smoothed.push(state);
        }
        let gain = smoothed.iter().map(|s| s.log_likelihood).sum::<f64>() - before;
        candidate.jump_gain = Some(gain);
        if gain > 0.0 {
            candidate.courses = self.courses(trial, &smoothed);
            let all: Vec<f64> = candidate.courses.iter().flat_map(|c| c.deviation.iter().copied()).collect();
            candidate.deviation = rms(&all);
        }
    }

    fn log_likelihood_without(&self) -> f64 {
        let of = |t: &Trajectory| {
            let column = |(row, r): (&usize, &Vec<f64>)| {
                let noise = self.noise[*row];
                r.iter().map(|r| -0.5 * (r / noise).powi(2) - noise.ln() - 0.5 * std::f64::consts::TAU.ln()).sum::<f64>()
            };
            t.rows.iter().zip(&t.residual).map(column).sum::<f64>()
        };
        self.trajectories.iter().map(of).sum()
    }

    fn mismatch(&self) -> f64 {
        let squares = self.trajectories.iter().flat_map(|t| t.rows.iter().zip(&t.residual)).map(|(row, r)| {
            let noise = self.noise[*row];
            (r.iter().map(|r| (r / noise).powi(2)).sum::<f64>(), r.len())
        });
        let (sum, count) = squares.fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        (sum / count.max(1) as f64).sqrt()
    }

    /// Groups places, best first, with those that give the same readings within the noise.
    fn classes(&self, ranking: &[Candidate], channels: &[(Channel, usize)]) -> Vec<Class> {
        let Some(trajectory) = self.trajectories.first() else { return Vec::new() };
        let noise: Vec<f64> = trajectory.rows.iter().map(|r| self.noise[*r]).collect();
        let responses = |spectrum: &classes::Spectrum, (channel, chain): (Channel, usize)| {
            let equations = self.split.equations(channel, chain, &trajectory.rows);
            spectrum.iter().map(|(f, _)| classes::response(&equations, *f)).collect::<Option<Vec<_>>>()
        };
        let mut classes: Vec<Class> = Vec::new();
        // Of each class's first place: the spectrum of its force, and what the outputs make of it.
        let mut firsts = Vec::new();
        for index in 0..ranking.len() {
            let alike = classes.iter().zip(&firsts).position(|(class, (spectrum, own)): (&Class, &(classes::Spectrum, Option<Vec<_>>))| {
                let Some(first) = class.members.first() else { return false };
                if channels[*first].0 == channels[index].0 {
                    return true;
                }
                let (Some(own), Some(other)) = (own, responses(spectrum, channels[index])) else { return false };
                classes::distance(spectrum, own, &other, &noise) < INDISTINCT
            });
            match alike {
                Some(class) => classes[class].members.push(index),
                None => {
                    let columns: Vec<(&[f64], f64)> = ranking[index].courses.iter().map(|c| (c.force.as_slice(), c.period)).collect();
                    let spectrum = classes::spectrum(&columns);
                    let own = responses(&spectrum, channels[index]);
                    firsts.push((spectrum, own));
                    classes.push(Class { members: vec![index] });
                }
            }
        }
        classes
    }

    fn shows(&self, ranking: &[Candidate]) -> Where {
        let mut columns: Vec<(Vec<f64>, f64)> = Vec::new();
        for t in &self.trajectories {
            columns.extend(t.rows.iter().zip(&t.residual).map(|(row, r)| (r.iter().map(|r| r / self.noise[*row]).collect(), t.period)));
        }
        let borrowed: Vec<(&[f64], f64)> = columns.iter().map(|(c, p)| (c.as_slice(), *p)).collect();
        let mut bands = classes::spectrum(&borrowed);
        bands.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = bands.iter().map(|b| b.1).sum();
        let at_share = |share: f64| {
            let mut sum = 0.0;
            bands.iter().find(|b| {
                sum += b.1;
                sum >= share * all
            })
        };
        let band_hz = [at_share(0.05).map_or(0.0, |b| b.0), at_share(0.95).map_or(0.0, |b| b.0)];
        let state = ranking.first().map_or_else(String::new, describe);
        Where { time: self.spans(), band_hz, state }
    }

    /// Blocks that hold four fifths of the mismatch, where they are at most a third of the time.
    fn spans(&self) -> Vec<[f64; 2]> {
        let Some(longest) = self.trajectories.iter().map(|t| t.len).max() else { return Vec::new() };
        let block = (longest / 100).max(4);
        let mut blocks: Vec<(f64, f64, f64)> = Vec::new();
        for t in &self.trajectories {
            for start in (0..t.len).step_by(block) {
                let end = (start + block).min(t.len);
                let power = |(row, r): (&usize, &Vec<f64>)| r[start..end].iter().map(|r| (r / self.noise[*row]).powi(2)).sum::<f64>();
                let sum = t.rows.iter().zip(&t.residual).map(power).sum::<f64>();
                blocks.push((sum, start as f64 * t.period, end as f64 * t.period));
            }
        }
        let all: f64 = blocks.iter().map(|b| b.0).sum();
        let count = blocks.len();
        blocks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut sum = 0.0;
        let mut chosen: Vec<[f64; 2]> = Vec::new();
        for (power, from, to) in blocks {
            if sum >= 0.8 * all {
                break;
            }
            sum += power;
            chosen.push([from, to]);
        }
        if chosen.len() * 3 > count {
            return Vec::new();
        }
        chosen.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut merged: Vec<[f64; 2]> = Vec::new();
        for span in chosen {
            match merged.last_mut() {
                Some(last) if span[0] <= last[1] => last[1] = last[1].max(span[1]),
                _ => merged.push(span),
            }
        }
        merged
    }
}

/// The parts of a column that belong to each run.
fn pieces<'a>(column: &'a [f64], courses: &[Course]) -> Vec<&'a [f64]> {
    let mut rest = column;
    courses
        .iter()
        .map(|course| {
            let (own, after) = rest.split_at(course.force.len().min(rest.len()));
            rest = after;
            own
        })
        .collect()
}

/// Central differences.
fn rate(column: &[f64], period: f64) -> Vec<f64> {
    let last = column.len().saturating_sub(1);
    let at = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
        if b > a { (column[b] - column[a]) / ((b - a) as f64 * period) } else { 0.0 }
    };
    (0..column.len()).map(at).collect()
}

/// In which state the mismatch shows, in words, such as `reversals of drum-ground`; `None` where there is no mismatch to speak of.
pub fn state(location: &Location) -> Option<String> {
    let best = location.ranking.first()?;
    let telling = location.mismatch > QUIET && best.log_likelihood > location.log_likelihood_without;
    (telling && !location.shows.state.is_empty()).then(|| location.shows.state.clone())
}

/// Where a force shows, in words.
fn describe(candidate: &Candidate) -> String {
    let place = &candidate.place;
    let Some(law) = candidate.laws.first() else { return format!("a force at {place}") };
    let what = match law.variable {
        Variable::Constant => "constantly",
        Variable::Direction => "with the direction of motion, so at its reversals",
        Variable::Velocity => "with velocity",
        Variable::Displacement => "with displacement",
        Variable::Acceleration => "with acceleration",
        Variable::DisplacementByDirection => "with displacement, differently in each direction",
        Variable::SinceReversal => "after reversals, over a distance",
        Variable::TimeSinceReversal => "after reversals, over a time",
        Variable::Ripple => "periodically in position",
        Variable::Signal => "with the signal",
        Variable::SignalRate => "with the signal's rate of change",
        Variable::Time => "in time",
    };
    format!("{what}, at {place}")
}

/// Mismatch, in noises, below which nothing shows.
const QUIET: f64 = 1.02;
/// Noise at least, as a share of a signal: below that the simulation itself is not exact.
const SMALLEST_NOISE: f64 = 1e-5;
/// Share of their forces that nonlinear elements may be wrong by while nothing is known of their path, and once it is.
const LOOSE: f64 = 2.0;
const TIGHT: [f64; 3] = [0.01, 0.1, 0.5];
/// Samples after which an error of a nonlinear element is forgotten.
const FORGOTTEN: f64 = 20.0;
/// Displacement that makes a turning point, in rms displacements.
const TURN: f64 = 0.05;
/// Places whose readings differ by less than this many noises are one.
const INDISTINCT: f64 = 0.3;
