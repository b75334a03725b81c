//! Where the model deviates from the recordings: the unknown force at every place that would make the nominal model reproduce the recordings.
//!
//! For each place the deviation of the device from the simulated nominal model obeys linear equations driven by a latent force there
//! (after Rogers & Friis 2022); a smoother finds the force, its standard deviation and the likelihood of the recordings. What is not linear in
//! the nominal model enters as known forces along the motion that the device really made, found by iteration. Sign jumps survive because the
//! force may jump where the place's motion reverses (after Marino & Cicirello 2023). Each force is then tabulated against what moves
//! at its place (`law`); the place whose force follows the simplest law explains the recordings best.

mod candidate;
mod channel;
mod character;
mod classes;
mod context;
mod equations;
mod estimate;
mod filter;
mod law;
mod nonlinear;
mod period;
mod regression;
mod reversals;
mod shows;
mod smoother;
#[cfg(test)]
mod tests;
mod trajectory;
mod types;

use crate::tuning::tuning;
use backdrive_signal::statistics::rms;
pub use character::Character;
pub use law::{Form, Law, Point, Variable};
pub use period::{Ripple, scan};
pub use types::{Candidate, Class, Course, LocateError, Location, Options, Run, Where};

use backdrive_plant::model::Model;
use channel::{Channel, channels};
use context::{Context, noise_of};
use equations::Linearisation;
use estimate::Estimate;
pub(crate) use nonlinear::force_along;
use nonlinear::rms_beyond_linear;
use rayon::prelude::*;
use trajectory::Trajectory;

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
    let linearisation = Linearisation::of(model, amplitude).ok_or(LocateError::Singular)?;
    let noise = (0..noise.len()).map(|output| noise_of(output, noise[output], &trajectories)).collect();
    let nonlinear_sizes = trajectories.iter().map(|t| rms_beyond_linear(&linearisation, t)).collect();
    let context = Context { model, runs, linearisation, trajectories, nonlinear_sizes, noise, options };
    let wanted = |channel: &Channel| options.only.as_ref().is_none_or(|place| context.acts_at(*channel, place));
    let mut estimates: Vec<Estimate> =
        channels(model).into_par_iter().filter(wanted).filter_map(|channel| context.estimate(channel)).collect();
    if estimates.is_empty() {
        return Err(LocateError::Singular);
    }
    estimates.sort_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    let mut ranking: Vec<(Candidate, usize)> = estimates
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, estimate)| context.candidates(estimate).into_iter().map(move |c| (c, i)))
        .collect();
    ranking.sort_by(|a, b| b.0.evidence.total_cmp(&a.0.evidence));
    let leading: Vec<usize> = ranking.iter().take(options.jumps_at).map(|r| r.1).collect();
    ranking
        .par_iter_mut()
        .take(options.jumps_at)
        .zip(leading)
        .for_each(|((candidate, _), estimate)| context.allow_jumps(candidate, &estimates[estimate]));
    let channels: Vec<(Channel, usize)> = ranking.iter().map(|r| (estimates[r.1].channel, estimates[r.1].order)).collect();
    let ranking: Vec<Candidate> = ranking.into_iter().map(|r| r.0).collect();
    let classes = context.classes(&ranking, &channels);
    Ok(Location {
        log_likelihood_without: context.log_likelihood_without(),
        mismatch: context.mismatch(),
        shows: context.shows(&ranking),
        ranking,
        classes,
    })
}

/// In which state the residual shows, in words, such as `with velocity, at drum-ground`; `None` where it does not exceed the noise.
pub fn state(location: &Location) -> Option<String> {
    let best = location.ranking.first()?;
    let telling = location.mismatch > tuning().locate.quiet && best.log_likelihood > location.log_likelihood_without;
    (telling && !location.shows.state.is_empty()).then(|| location.shows.state.clone())
}
