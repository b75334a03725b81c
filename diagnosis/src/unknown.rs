//! Inputs that nobody measured: the hand of a session, a slow force from outside. Each is a curve of its own in every recording, as fine as its
//! bandwidth asks for, and is found together with the rest.
//!
//! The curve is a uniform cubic B-spline (de Boor, A Practical Guide to Splines, ch. IX) with four knots per period of its bandwidth: it follows
//! a sine of that frequency to 0.1 % of its amplitude, and one of four times the frequency hardly at all.

use crate::problem::{Problem, Record};
use backdrive_plant::model::{InputKind, OutputKind};
use serde::Serialize;

/// An input that was not recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unknown {
    /// Its place among the model's inputs.
    pub input: usize,
    /// Hz, up to which it varies.
    pub bandwidth_hz: f64,
}

/// Knots per period of the bandwidth.
const KNOTS_PER_PERIOD: f64 = 4.0;

impl Unknown {
    /// s from one knot to the next.
    fn spacing(&self) -> f64 {
        1.0 / (KNOTS_PER_PERIOD * self.bandwidth_hz)
    }

    /// How many weights a curve over a whole record has.
    pub fn knots(&self, record: &Record) -> usize {
        let duration = record.len.saturating_sub(1) as f64 * record.period;
        (duration / self.spacing()).ceil() as usize + 3
    }

    /// The samples from the first that a weight moves to the first that the weight `apart` knots on moves.
    pub fn window(&self, knot: usize, apart: usize, record: &Record) -> std::ops::Range<usize> {
        let sample =
            |k: usize| ((k.saturating_sub(3) as f64 * self.spacing() / record.period).ceil() as usize).saturating_sub(record.before);
        // The first weights act from the start on.
        let end = sample(knot + apart).min(record.len);
        sample(knot).min(end)..end
    }

    /// The curve of these weights at each sample of a record, or of a part of it.
    pub fn curve(&self, weights: &[f64], record: &Record) -> Vec<f64> {
        let at = |k: usize| weights.get(k).copied().unwrap_or(0.0);
        let per_sample = record.period / self.spacing();
        (0..record.len)
            .map(|sample| {
                let place = (record.before + sample) as f64 * per_sample;
                let (k, u) = (place.floor() as usize, place - place.floor());
                let v = 1.0 - u;
                let basis = [v * v * v, 3.0 * u * u * u - 6.0 * u * u + 4.0, 3.0 * v * v * v - 6.0 * v * v + 4.0, u * u * u];
                (0..4).map(|i| basis[i] * at(k + i)).sum::<f64>() / 6.0
            })
            .collect()
    }

    /// About how large it is, in its own unit: as the positions that were measured for a motion, as the other forces for a force; 1 where there are none.
    pub fn scale(&self, problem: &Problem) -> f64 {
        let model = &problem.model;
        let most = |sizes: &mut dyn Iterator<Item = f64>| sizes.filter(|x| x.is_finite()).fold(0.0, f64::max);
        let rms = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt();
        let records = &problem.fit;
        let size = match model.inputs.get(self.input).map(|i| i.kind) {
            Some(InputKind::Motion) => most(&mut records.iter().flat_map(|r| {
                let positions = model.outputs.iter().enumerate().filter(|(_, o)| matches!(o.kind, OutputKind::Position(_)));
                positions.filter_map(|(index, o)| r.outputs[index].as_deref().map(|y| rms(y) / o.gain.abs().max(f64::MIN_POSITIVE)))
            })),
            _ => most(&mut records.iter().flat_map(|r| {
                let others = model.inputs.iter().enumerate().filter(|(index, i)| *index != self.input && i.kind == InputKind::Force);
                others.map(|(index, i)| rms(&r.inputs[index]) * i.gain.abs())
            })),
        };
        if size > 0.0 { size } else { 1.0 }
    }
}

/// What a fit says of an input that nobody measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimated {
    /// Name of the input.
    pub input: String,
    /// Hz, up to which it was let vary.
    pub bandwidth_hz: f64,
    /// Hz, below which 95 % of its power was found, its mean apart; 0 where it rests.
    pub found_bandwidth_hz: f64,
    /// Standard deviation over all recordings, in its own unit.
    pub deviation: f64,
}

/// Of the curves of one input in several recordings.
pub fn estimated(name: &str, unknown: &Unknown, curves: &[(Vec<f64>, f64)]) -> Estimated {
    let (mut squares, mut samples) = (0.0, 0);
    // Power by frequency: the lines of recordings of different length are sorted together.
    let mut lines: Vec<(f64, f64)> = Vec::new();
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    for (curve, period) in curves {
        let mean = curve.iter().sum::<f64>() / curve.len().max(1) as f64;
        let n = curve.len().max(1) as f64;
        // A window, so that ends which do not meet are no fast motion.
        let window = |i: usize| (std::f64::consts::PI * (i as f64 + 0.5) / n).sin().powi(2);
        let mut windowed: Vec<f64> = curve.iter().enumerate().map(|(i, x)| (x - mean) * window(i)).collect();
        squares += curve.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        samples += curve.len();
        let transform = planner.plan_fft_forward(windowed.len());
        let mut spectrum = transform.make_output_vec();
        if transform.process(&mut windowed, &mut spectrum).is_ok() {
            lines.extend(spectrum.iter().enumerate().map(|(k, c)| (k as f64 / (n * period), c.norm_sqr())));
        }
    }
    lines.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = lines.iter().map(|l| l.1).sum();
    let mut below = 0.0;
    let found = lines.iter().find(|(_, power)| {
        below += power;
        below >= 0.95 * total
    });
    Estimated {
        input: name.to_string(),
        bandwidth_hz: unknown.bandwidth_hz,
        found_bandwidth_hz: found.filter(|_| total > 0.0).map_or(0.0, |l| l.0),
        deviation: (squares / samples.max(1) as f64).sqrt(),
    }
}
