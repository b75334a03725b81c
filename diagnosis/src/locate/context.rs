//! What all channels share: model, runs, their simulated trajectories, and the filters that follow from them.

use super::channel::Channel;
use super::equations::Linearisation;
use super::filter::{Data, System};
use super::nonlinear::forces_beyond_linear;
use super::smoother::Smoothed;
use super::trajectory::Trajectory;
use super::types::{Options, Run};
use crate::hypothesis::Place;
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model};
use backdrive_signal::statistics::rms;

/// What all channels share.
pub(super) struct Context<'a> {
    pub model: &'a Model,
    pub runs: &'a [Run<'a>],
    pub linearisation: Linearisation<'a>,
    pub trajectories: Vec<Trajectory>,
    /// Root mean square of the force of each nonlinear element beyond its linear part, N, in each run.
    pub nonlinear_sizes: Vec<Vec<f64>>,
    /// Noise standard deviation of each output, in its unit.
    pub noise: Vec<f64>,
    pub options: &'a Options,
}

/// Noise standard deviation of an output: as given, and at least what the simulation of it can resolve.
pub(super) fn noise_of(output: usize, given: f64, trajectories: &[Trajectory]) -> f64 {
    let columns = trajectories.iter().filter_map(|t| t.rows.iter().position(|r| *r == output).map(|row| (t, row)));
    let largest = columns.map(|(t, row)| rms(&t.predicted[row]).max(rms(&t.residual[row]))).fold(0.0, f64::max);
    given.max(tuning().locate.least_noise * largest).max(f64::MIN_POSITIVE.sqrt())
}

impl Context<'_> {
    /// Whether a channel is that of a place.
    pub(super) fn acts_at(&self, channel: Channel, place: &Place) -> bool {
        let named = |end: Option<usize>| self.model.place_name(end).to_string();
        match (channel, place) {
            (Channel::Force(ends), Place::Between(..)) => Place::Between(named(ends[0]), named(ends[1])).same(place),
            (Channel::Force([Some(body), None] | [None, Some(body)]), Place::Signal(name)) => {
                self.model.inputs.iter().any(|i| i.kind == InputKind::Force && i.on == body && i.name == *name)
            }
            (Channel::Motion(input), Place::Signal(name)) => self.model.inputs[input].name == *name,
            (Channel::Sensor(output), Place::Signal(name)) => self.model.outputs[output].name == *name,
            (Channel::Force(_), Place::Signal(_)) | (Channel::Motion(_) | Channel::Sensor(_), Place::Between(..)) => false,
        }
    }

    /// The filter of a channel for one run; `force_error` is the standard error of the forces of the nonlinear elements, as a share of them.
    pub(super) fn system(&self, channel: Channel, order: usize, run: usize, scales: [f64; 3], force_error: f64) -> Option<System> {
        let trajectory = &self.trajectories[run];
        let mut equations = self.linearisation.equations(channel, order, &trajectory.rows);
        if force_error > 0.0 && !self.linearisation.nonlinear.is_empty() {
            // An error at the very place in question is the unknown itself.
            let here = |ends: [Option<usize>; 2]| matches!(channel, Channel::Force([a, b]) if ends == [a, b] || ends == [b, a]);
            let share = |element: &usize| if here(self.model.elements[*element].between) { 1e-3 * force_error } else { force_error };
            let errors: Vec<f64> = self.linearisation.nonlinear.iter().zip(&self.nonlinear_sizes[run]).map(|(e, s)| share(e) * s).collect();
            equations = self.linearisation.with_force_errors(
                &equations,
                &errors,
                1.0 / (tuning().locate.force_error_correlation * trajectory.period),
            );
        }
        let noise: Vec<f64> = trajectory.rows.iter().map(|r| self.noise[*r]).collect();
        System::of(&equations, trajectory.period, scales, &noise)
    }

    /// Typical displacement and speed of the deviation, and size of the unknown.
    pub(super) fn scales(&self, channel: Channel) -> [f64; 3] {
        let of_bodies = |columns: fn(&Trajectory) -> &Vec<Vec<f64>>| {
            self.trajectories.iter().flat_map(|t| columns(t).iter().map(rms)).fold(0.0, f64::max).max(1e-12)
        };
        let (x, v) = (of_bodies(|t| &t.position), of_bodies(|t| &t.velocity));
        let size = match channel {
            Channel::Force(ends) => {
                let of_inputs = self.model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Force);
                let driven = of_inputs.flat_map(|(i, _)| self.trajectories.iter().map(move |t| rms(&t.drive[i]))).fold(0.0, f64::max);
                let stiff: f64 = ends.iter().flatten().map(|b| self.linearisation.linear.stiffness[(*b, *b)].abs()).fold(0.0, f64::max);
                let damped: f64 = ends.iter().flatten().map(|b| self.linearisation.linear.damping[(*b, *b)].abs()).fold(0.0, f64::max);
                if driven > 0.0 { driven } else { (stiff * x).max(damped * v) }
            }
            Channel::Motion(_) => x,
            Channel::Sensor(output) => self.largest_reading(output),
        };
        [x, v, 0.1 * if size > 0.0 { size } else { 1.0 }]
    }

    /// Largest root mean square of a predicted output over the runs, in its unit.
    pub(super) fn largest_reading(&self, output: usize) -> f64 {
        let columns = self.trajectories.iter().filter_map(|t| t.rows.iter().position(|r| *r == output).map(|row| &t.predicted[row]));
        columns.map(rms).fold(0.0, f64::max)
    }

    /// What the filter of a run is given; `known` is a known part of the unknown.
    pub(super) fn data<'b>(&'b self, forces: &'b [Vec<Vec<f64>>], run: usize, known: &'b [f64]) -> Data<'b> {
        Data { residual: &self.trajectories[run].residual, forces: forces.get(run).map_or(&[], Vec::as_slice), known }
    }

    /// The run with the largest normalised residual.
    pub(super) fn largest_residual(&self) -> usize {
        let size = |t: &Trajectory| {
            let square = |(row, r): (&usize, &Vec<f64>)| (rms(r) / self.noise[*row]).powi(2);
            t.rows.iter().zip(&t.residual).map(square).sum::<f64>()
        };
        let all = self.trajectories.iter().enumerate();
        all.max_by(|a, b| size(a.1).total_cmp(&size(b.1))).map_or(0, |(run, _)| run)
    }

    /// Log-likelihood of all runs; minus infinity where a filter fails.
    pub(super) fn log_likelihood(&self, systems: &[System], intensity: f64, forces: &[Vec<Vec<f64>>], known: &[&[f64]]) -> f64 {
        let of = |(run, system): (usize, &System)| {
            system.log_likelihood(intensity, self.data(forces, run, known.get(run).copied().unwrap_or(&[])))
        };
        systems.iter().enumerate().map(|s| of(s).unwrap_or(f64::NEG_INFINITY)).sum()
    }

    /// Displacement and velocity of each body, as deviations from the simulated motion of a run.
    pub(super) fn motions(&self, channel: Channel, order: usize, run: usize, smoothed: &Smoothed) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let equations = self.linearisation.equations(channel, order, &self.trajectories[run].rows);
        let of = |rows: &[nalgebra::DVector<f64>]| rows.iter().map(|row| smoothed.reading(row)).collect::<Vec<_>>();
        (of(&equations.position), of(&equations.velocity))
    }

    /// Forces of the nonlinear elements beyond their linear part along the estimated motion of a run.
    pub(super) fn forces_along(&self, channel: Channel, order: usize, run: usize, smoothed: &Smoothed) -> Vec<Vec<f64>> {
        let (position, velocity) = self.motions(channel, order, run, smoothed);
        forces_beyond_linear(&self.linearisation, &self.trajectories[run], &position, &velocity)
    }
}
