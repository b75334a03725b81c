//! Samples that were not taken when the rows say: filled up from a lower rate, or low-passed.

use crate::finding::{Finding, FindingKind, Weight};
use crate::numeric::quantile;
use crate::recording::Recording;
use backdrive_diagnosis::recordings::signal::density;

/// The factors of rate that are tried.
const FACTORS: std::ops::RangeInclusive<usize> = 2..=12;
/// Share of the changes that have to fall on every k-th sample. Where samples are independent it is 1/k.
const IN_PHASE: f64 = 0.96;
/// Fewest changes that say so.
const LEAST: usize = 40;
/// Power density in the top quarter of the band beside that of the second: white noise has 1, a second-order low-pass at a tenth of the rate 0.01.
const QUIET: f64 = 2e-3;

/// Finds them.
pub fn check(recording: &Recording, out: &mut Vec<Finding>) {
    for signal in recording.signals.iter().filter(|signal| signal.quantity.is_measured()) {
        let values: Vec<f64> = signal.values.iter().copied().filter(|x| x.is_finite()).collect();
        if values.len() < 200 {
            continue;
        }
        let first: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let second: Vec<f64> = values.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
        let rate = recording.rate();
        let filled = every(&first).map(|k| (k, "held")).or_else(|| every(&second).map(|k| (k, "interpolated")));
        if let Some((factor, how)) = filled {
            let message = format!(
                "{:?} was sampled at {:.4} Hz and {how} to the {:.4} Hz of the file: its derivative between samples is an artefact",
                signal.name,
                rate / factor as f64,
                rate
            );
            let todo = format!("record at the sensor's own rate, or keep every {factor}th row");
            out.push(Finding::new(FindingKind::Resampled, &recording.file, &[&signal.name], message).at(&signal.joint).todo(todo));
        } else if let Some(corner) = low_passed(&values, recording.period) {
            let message = format!("{:?} has almost no noise above {corner:.3} Hz: it was low-pass filtered, or computed", signal.name);
            let todo = "log the raw signal as well: a causal filter delays the signal";
            let finding = Finding::new(FindingKind::Filtered, &recording.file, &[&signal.name], message).at(&signal.joint);
            out.push(finding.weighing(Weight::Note).todo(todo).sure(0.9));
        }
    }
}

/// The number of samples after which changes come, where they come at every such sample and nowhere else.
fn every(changes: &[f64]) -> Option<usize> {
    let large = quantile(changes, 0.9);
    let moving: Vec<usize> = (0..changes.len()).filter(|i| changes[*i] > 0.03 * large && changes[*i] > 0.0).collect();
    if moving.len() < LEAST {
        return None;
    }
    // The largest factor that holds: what comes at every fourth sample comes at every second too.
    FACTORS.rev().find(|factor| {
        let mut counts = vec![0usize; *factor];
        moving.iter().for_each(|i| counts[i % factor] += 1);
        let most = counts.iter().copied().max().unwrap_or(0);
        let possible = changes.len() / factor;
        most as f64 > IN_PHASE * moving.len() as f64 && most * 3 > possible
    })
}

/// The frequency above which the density falls below that of white noise, Hz.
fn low_passed(values: &[f64], period: f64) -> Option<f64> {
    let (hz, density) = density(values, period);
    let mean = |from: f64, to: f64| {
        let part = density.get((from * density.len() as f64) as usize..(to * density.len() as f64) as usize).unwrap_or(&[]);
        part.iter().sum::<f64>() / part.len().max(1) as f64
    };
    let (middle, top) = (mean(0.25, 0.5), mean(0.75, 1.0));
    // Rounding leaves a noise floor: a spectrum that is at it throughout is no evidence.
    let whole = density.iter().copied().fold(0.0, f64::max);
    (top > 0.0 && top < QUIET * middle && middle > 1e-12 * whole).then(|| hz.get(density.len() / 4).copied()).flatten()
}
