//! Transport delays, from the slope of the phase.

use crate::spectra::CrossSpectra;
use nalgebra::Complex;
use serde::Serialize;
use std::f64::consts::TAU;

/// A hop that only scales and delays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hop {
    /// Its delay, s.
    pub delay_s: f64,
    /// Standard deviation of the delay, s.
    pub sigma_s: f64,
    /// Its gain: the unit of its output over that of its input.
    pub gain: f64,
    /// Median coherence of the lines that were used.
    pub coherence: f64,
}

/// The delays of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Delays {
    /// From F_s to the reflected part of F_f, of the first axis that touches; its gain is 1/mu, for lambda and mu are divided out.
    pub force: Option<Hop>,
    /// From x_m to x_c; `None` where something is cancelled between them.
    pub motion: Option<Hop>,
    /// Both together, s, as far as they are known: what the loop holds beside its devices.
    pub loop_s: Option<f64>,
}

/// Gain and delay from column `from` to column `to`, by least squares of the phase; `None` where nothing is coherent.
pub(super) fn hop(spectra: &CrossSpectra, from: usize, to: usize) -> Option<Hop> {
    let averages = spectra.averaging.averages.max(1.0);
    let power: Vec<f64> = spectra.lines.iter().map(|s| s[(from, from)].re).collect();
    let largest = power.iter().copied().fold(0.0, f64::max);
    let lines: Vec<(f64, Complex<f64>, f64)> = (0..spectra.hz.len())
        .filter(|k| power[*k] > 1e-6 * largest)
        .map(|k| (spectra.hz[k], spectra.lines[k][(to, from)] / power[k], spectra.coherence(k, to, from)))
        .filter(|(_, h, coherence)| *coherence > 0.8 && h.norm() > 0.0)
        .collect();
    if lines.len() < 4 || largest <= 0.0 {
        return None;
    }
    // The phase is followed upwards from the lowest line, with the delay found so far: it may turn many times.
    let (mut sum_wp, mut sum_ww, mut delay) = (0.0, 0.0, 0.0);
    for (hz, h, coherence) in &lines {
        let w = TAU * hz;
        let phase = (h * Complex::from_polar(1.0, w * delay)).arg() - w * delay;
        let weight = 2.0 * averages * coherence / (1.0 - coherence).max(1e-9);
        sum_wp -= weight * w * phase;
        sum_ww += weight * w * w;
        delay = sum_wp / sum_ww;
    }
    let gain = lines.iter().map(|(hz, h, _)| (h * Complex::from_polar(1.0, TAU * hz * delay)).re).sum::<f64>() / lines.len() as f64;
    let mut coherences: Vec<f64> = lines.iter().map(|l| l.2).collect();
    coherences.sort_by(f64::total_cmp);
    Some(Hop { delay_s: delay, sigma_s: sum_ww.sqrt().recip(), gain, coherence: coherences[coherences.len() / 2] })
}
