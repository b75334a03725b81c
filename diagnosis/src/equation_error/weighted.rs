//! Force along a measured motion, weighted by what noise leaves of it: a wide band of the motion, and errors that are as large at every frequency.
//!
//! Noise of a position, differentiated twice, grows in the force with the square of the frequency; that of the force itself does not. Below the frequency
//! where both are alike the force is compared as it is, above it the motion that the force makes. So are the residuals of a good model white, and a ripple or an
//! impact far above that frequency counts for what it is.

use super::band::filtered;
use crate::recordings::noise::white;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_signal::derivative;
use backdrive_signal::low_pass::LowPass;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Samples in a period of the widest band.
const SAMPLES: f64 = 5.0;

/// Periods of the widest band that are left out at both ends of a recording.
const EDGE: f64 = 3.0;

/// Time that a load which nobody measured is given to swing in, s; at most a tenth of a recording.
const SETTLED: f64 = 0.5;

/// Share of the whole inertia that a driven body has at least.
const LEAST_SHARE: f64 = 0.3;

/// Lowest crossing, in the widest band: below it friction that is a little wrong hides impacts and resonances.
const LOWEST: f64 = 0.125;

/// Where the motion is cut off, and where the force is weighted from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weighting {
    /// Corner of the motion, Hz.
    pub widest: f64,
    /// Frequency from which on the noise of the motion is the larger one, Hz.
    pub crossing: f64,
    /// Noise standard deviation of the weighted force, in its unit.
    pub noise_sd: f64,
}

/// The weighting that a turned problem's noise asks for; `None` where the records are too short for it.
pub(crate) fn weighting(turned: &Problem) -> Option<Weighting> {
    let tuning = &tuning().equation_error;
    let records: Vec<(&[f64], &[f64], f64)> = turned.fit.iter().filter_map(signals).collect();
    let rate = records.iter().map(|(.., period)| 1.0 / period).fold(f64::INFINITY, f64::min);
    let widest = tuning.highest_corner * rate;
    // Of white noise so much is in each Hz.
    let density = |sd: f64, rate: f64| sd * sd / (0.5 * rate);
    // The smoothest recording shows the noise of the force best. A motor at rest shows none of its encoder's, which rounds all the same.
    let rounding = turned.inverse.as_ref().and_then(|i| Some(i.recorded.model.outputs.get(i.output)?.resolution)).unwrap_or(0.0) / 12.0f64.sqrt();
    let least = |own: &mut dyn Iterator<Item = Option<f64>>| own.flatten().fold(f64::INFINITY, f64::min);
    let of_motion = least(&mut records.iter().map(|(motion, _, period)| Some(density(white(motion)?.max(rounding), 1.0 / period))));
    let (mut of_force, mut sums) = (f64::INFINITY, [(0.0, 0.0); 2]);
    for (motion, force, period) in &records {
        for (share, (product, square)) in [0.25, 0.5].into_iter().zip(&mut sums) {
            let low_pass = LowPass::butterworth(tuning.order, share * widest, 1.0 / period);
            // Above the resonances of what hangs on a body its own inertia is left.
            let slow = LowPass::butterworth(tuning.order, 0.1 * widest, 1.0 / period);
            let band = |samples: &[f64]| -> Vec<f64> {
                let low = low_pass.both_ways(samples);
                if share < 0.5 { low } else { low.iter().zip(slow.both_ways(&low)).map(|(x, slow)| x - slow).collect() }
            };
            let acceleration = derivative(&derivative(&band(motion), *period), *period);
            *product += acceleration.iter().zip(band(force)).map(|(a, f)| a * f).sum::<f64>();
            *square += acceleration.iter().map(|a| a * a).sum::<f64>();
        }
        let spread = (force.iter().map(|f| f * f).sum::<f64>() / force.len() as f64).sqrt();
        of_force = of_force.min(density(white(force)?.max(tuning.least_noise_of_force * spread), 1.0 / period));
    }
    let [whole, own] = sums.map(|(product, square): (f64, f64)| (product / square.max(f64::MIN_POSITIVE)).abs());
    // Near a resonance the load's force hides the body's own.
    let inertia = own.clamp(LEAST_SHARE * whole, whole);
    let crossing = (of_force / of_motion.max(f64::MIN_POSITIVE)).sqrt() / inertia.max(f64::MIN_POSITIVE);
    let crossing = (crossing.sqrt() / TAU).clamp(LOWEST * widest, widest);
    let steps = 400;
    let square: f64 = (0..steps)
        .map(|k| {
            let hz = (f64::from(k) + 0.5) * widest / f64::from(steps);
            let noise = of_force + of_motion * (inertia * (TAU * hz).powi(2)).powi(2);
            noise / (1.0 + (hz / crossing).powi(2)).powi(2) * widest / f64::from(steps)
        })
        .sum();
    Some(Weighting { widest, crossing, noise_sd: square.sqrt() })
}

/// A turned problem's records in the wide band, their force weighted.
pub(crate) fn weighted(turned: &Problem, by: Weighting) -> Problem {
    let one = |record: &Record| {
        let wide = filtered(&turned.model, record, by.widest, SAMPLES);
        // Where the filter has no samples on one side.
        let edge = (EDGE / (by.widest * wide.period)) as usize;
        let wide = if wide.len > 4 * edge { wide.part(edge..wide.len - edge, Vec::new(), 0) } else { wide };
        let low_pass = LowPass::butterworth(1, by.crossing, 1.0 / wide.period);
        let outputs = wide.outputs.iter().map(|o| o.as_ref().map(|samples| low_pass.both_ways(samples))).collect();
        let begins = wide.along_the_motion(0, &turned.model, 0);
        let skip = ((SETTLED / wide.period) as usize).min(wide.len / 10);
        Record { outputs, begins, skip, low_pass: Some(Arc::new(low_pass)), ..wide }
    };
    let of = |records: &[Record]| records.iter().map(one).collect();
    let noise_sd = turned.noise_sd.iter().map(|_| by.noise_sd).collect();
    Problem { fit: of(&turned.fit), held_out: of(&turned.held_out), noise_sd, lag: vec![0; turned.lag.len()], ..turned.clone() }
}

fn signals(record: &Record) -> Option<(&[f64], &[f64], f64)> {
    Some((record.inputs.first()?.as_slice(), record.outputs.iter().flatten().next()?.as_slice(), record.period))
}
