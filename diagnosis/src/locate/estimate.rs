//! The force at one channel: the filter with the greatest likelihood, and the smoother along the motion that the device really made.

use super::channel::Channel;
use super::context::Context;
use super::filter::System;
use super::smoother::Smoothed;
use crate::tuning::tuning;

/// What was estimated at a channel.
pub(super) struct Estimate {
    pub channel: Channel,
    /// How often white noise is integrated to give the unknown.
    pub order: usize,
    /// Intensity of that noise.
    pub intensity: f64,
    /// Standard error of the forces of the nonlinear elements, as a share of them.
    pub force_error: f64,
    /// Log-likelihood of the recordings with the steady filter.
    pub log_likelihood: f64,
    /// Forces of the nonlinear elements beyond their linear part along the estimated motion, for each run.
    pub forces: Vec<Vec<Vec<f64>>>,
    pub smoothed: Vec<Smoothed>,
    /// Typical size of the unknown.
    pub size: f64,
}

/// The filter of a channel with the greatest likelihood.
struct TunedFilter {
    pub order: usize,
    pub force_error: f64,
    pub intensity: f64,
    pub log_likelihood: f64,
    pub systems: Vec<System>,
}

impl Context<'_> {
    /// The intensity of greatest likelihood, and that likelihood: decades first, then between them. `around` is the intensity without a law.
    pub(super) fn most_likely_intensity(
        &self,
        systems: &[System],
        forces: &[Vec<Vec<f64>>],
        known: &[&[f64]],
        around: Option<f64>,
    ) -> (f64, f64) {
        let one = self.options.tuned_on_one.then(|| self.largest_residual());
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
            // A known law explains a part of the force, so less is left to the noise.
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

    /// Estimates the unknown at a channel. `None` where its equations have no filter.
    pub(super) fn estimate(&self, channel: Channel) -> Option<Estimate> {
        let scales = self.scales(channel);
        let orders: &[usize] = match channel {
            Channel::Force(_) => &[1, 2],
            Channel::Motion(_) => &[3],
            Channel::Sensor(_) => &[1],
        };
        // Forces of nonlinear elements depend on the motion that the device really made. First it is estimated with a wide error of these forces,
        // then with the forces along the motion that was estimated.
        let nonlinear = !self.linearisation.nonlinear.is_empty() && !matches!(channel, Channel::Sensor(_));
        let (first_orders, first_error, iterations) =
            if nonlinear { (&orders[..1], tuning().locate.first_force_error, self.options.iterations) } else { (orders, 0.0, 0) };
        let mut found = self.tuned(channel, scales, &[], first_orders, &[first_error])?;
        let mut smoothed = self.smoothed(&found, &[])?;
        let mut forces: Vec<Vec<Vec<f64>>> = Vec::new();
        for _ in 0..iterations {
            let next: Vec<_> =
                smoothed.iter().enumerate().map(|(run, smoothed)| self.forces_along(channel, found.order, run, smoothed)).collect();
            let Some(tighter) = self.tuned(channel, scales, &next, orders, &tuning().locate.force_errors) else { break };
            if !forces.is_empty() && tighter.log_likelihood <= found.log_likelihood {
                break;
            }
            let Some(path) = self.smoothed(&tighter, &next) else { break };
            (found, forces, smoothed) = (tighter, next, path);
        }
        let TunedFilter { order, force_error, intensity, log_likelihood, .. } = found;
        Some(Estimate { channel, order, intensity, force_error, log_likelihood, forces, smoothed, size: scales[2] })
    }

    /// The filter with the greatest likelihood among these orders of the unknown and errors of the nonlinear forces.
    fn tuned(
        &self,
        channel: Channel,
        scales: [f64; 3],
        forces: &[Vec<Vec<f64>>],
        orders: &[usize],
        force_errors: &[f64],
    ) -> Option<TunedFilter> {
        let options = orders.iter().flat_map(|order| force_errors.iter().map(|error| (*order, *error)));
        let of = |(order, force_error): (usize, f64)| {
            let runs = 0..self.trajectories.len();
            let systems = runs.map(|run| self.system(channel, order, run, scales, force_error)).collect::<Option<Vec<_>>>()?;
            let (intensity, log_likelihood) = self.most_likely_intensity(&systems, forces, &[], None);
            log_likelihood.is_finite().then_some(TunedFilter { order, force_error, intensity, log_likelihood, systems })
        };
        options.filter_map(of).max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
    }

    /// The smoothed states of all runs.
    fn smoothed(&self, filter: &TunedFilter, forces: &[Vec<Vec<f64>>]) -> Option<Vec<Smoothed>> {
        let one = |(run, system): (usize, &System)| system.smooth(filter.intensity, self.data(forces, run, &[]), &[], 0.0);
        filter.systems.iter().enumerate().map(one).collect()
    }
}
