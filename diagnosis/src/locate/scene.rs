//! What all places share, and the force at one of them: the filter that suits it best, and the smoother along the path that the device took.

use super::channel::{Channel, Split};
use super::nonlinear::extra_forces;
use super::smoother::{Data, Smoothed, System};
use super::trajectory::Trajectory;
use super::types::{Options, Run};
use crate::hypothesis::Place;
use crate::signal::rms;
use backdrive_plant::model::{InputKind, Model};

/// Noise at least, as a share of a signal: below that the simulation itself is not exact.
const SMALLEST_NOISE: f64 = 1e-5;
/// Share of their forces that nonlinear elements may be wrong by while nothing is known of their path, and once it is.
const LOOSE: f64 = 2.0;
const TIGHT: [f64; 3] = [0.01, 0.1, 0.5];
/// Samples after which an error of a nonlinear element is forgotten.
const FORGOTTEN: f64 = 20.0;

/// Everything that all places share.
pub(super) struct Scene<'a> {
    pub model: &'a Model,
    pub runs: &'a [Run<'a>],
    pub split: Split<'a>,
    pub trajectories: Vec<Trajectory>,
    /// Forces of the nonlinear elements beyond their linear part, N, in each run.
    pub sizes: Vec<Vec<f64>>,
    pub noise: Vec<f64>,
    pub options: &'a Options,
}

/// A place under investigation.
pub(super) struct Trial {
    pub channel: Channel,
    pub chain: usize,
    pub intensity: f64,
    /// Share of their forces that nonlinear elements may be wrong by.
    pub loose: f64,
    /// Log-likelihood with the steady filter.
    pub log_likelihood: f64,
    /// Forces of nonlinear elements, for each run.
    pub forces: Vec<Vec<Vec<f64>>>,
    pub smoothed: Vec<Smoothed>,
    pub size: f64,
}

/// The filter that suits a channel best.
pub(super) struct Best {
    pub chain: usize,
    pub loose: f64,
    pub intensity: f64,
    pub log_likelihood: f64,
    pub systems: Vec<System>,
}

/// A noise that is not smaller than what numbers can say of the signal.
pub(super) fn floor_of(output: usize, given: f64, trajectories: &[Trajectory]) -> f64 {
    let columns = trajectories.iter().filter_map(|t| t.rows.iter().position(|r| *r == output).map(|row| (t, row)));
    let largest = columns.map(|(t, row)| rms(&t.predicted[row]).max(rms(&t.residual[row]))).fold(0.0, f64::max);
    given.max(SMALLEST_NOISE * largest).max(f64::MIN_POSITIVE.sqrt())
}

impl Scene<'_> {
    /// Whether a channel is that of a place.
    pub(super) fn stands_for(&self, channel: Channel, place: &Place) -> bool {
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
    pub(super) fn system(&self, channel: Channel, chain: usize, run: usize, scales: [f64; 3], loose: f64) -> Option<System> {
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
    pub(super) fn scales(&self, channel: Channel) -> [f64; 3] {
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

    pub(super) fn largest_reading(&self, output: usize) -> f64 {
        let columns = self.trajectories.iter().filter_map(|t| t.rows.iter().position(|r| *r == output).map(|row| &t.predicted[row]));
        columns.map(|c| rms(c)).fold(0.0, f64::max)
    }

    pub(super) fn data<'b>(&'b self, forces: &'b [Vec<Vec<f64>>], run: usize, known: &'b [f64]) -> Data<'b> {
        Data { residual: &self.trajectories[run].residual, forces: forces.get(run).map_or(&[], Vec::as_slice), known }
    }

    /// The run with the largest mismatch for its length.
    pub(super) fn loudest(&self) -> usize {
        let size = |t: &Trajectory| {
            let square = |(row, r): (&usize, &Vec<f64>)| (rms(r) / self.noise[*row]).powi(2);
            t.rows.iter().zip(&t.residual).map(square).sum::<f64>()
        };
        let all = self.trajectories.iter().enumerate();
        all.max_by(|a, b| size(a.1).total_cmp(&size(b.1))).map_or(0, |(run, _)| run)
    }

    pub(super) fn log_likelihood(&self, systems: &[System], intensity: f64, forces: &[Vec<Vec<f64>>], known: &[&[f64]]) -> f64 {
        let of = |(run, system): (usize, &System)| {
            system.log_likelihood(intensity, self.data(forces, run, known.get(run).copied().unwrap_or(&[])))
        };
        systems.iter().enumerate().map(|s| of(s).unwrap_or(f64::NEG_INFINITY)).sum()
    }

    /// The intensity of greatest likelihood: decades first, then between them.
    pub(super) fn best_intensity(&self, systems: &[System], forces: &[Vec<Vec<f64>>], known: &[&[f64]], around: Option<f64>) -> (f64, f64) {
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
    pub(super) fn trial(&self, channel: Channel) -> Option<Trial> {
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

    pub(super) fn motions(&self, channel: Channel, chain: usize, run: usize, smoothed: &Smoothed) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let equations = self.split.equations(channel, chain, &self.trajectories[run].rows);
        let of = |rows: &[nalgebra::DVector<f64>]| rows.iter().map(|row| smoothed.reading(row)).collect::<Vec<_>>();
        (of(&equations.position), of(&equations.velocity))
    }

    pub(super) fn forces_along(&self, channel: Channel, chain: usize, run: usize, smoothed: &Smoothed) -> Vec<Vec<f64>> {
        let (position, velocity) = self.motions(channel, chain, run, smoothed);
        extra_forces(&self.split, &self.trajectories[run], &position, &velocity)
    }
}
