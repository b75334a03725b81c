//! Inputs that were not measured, such as the hand of a user or a slow external force. Each is estimated in every recording as a curve of limited
//! bandwidth, together with the parameters.
//!
//! The curve is a uniform cubic B-spline (de Boor, A Practical Coupling to Splines, ch. IX) with four knots per period of its bandwidth. The one nearest
//! to a sine has a residual of 1.3 % of it at the bandwidth, of 0.05 % at half of it, and hardly follows it at twice the bandwidth.

use crate::recordings::problem::Record;
use backdrive_plant::model::{InputKind, Model, OutputKind};
use backdrive_signal::statistics::rms;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

    /// The samples from the first that a weight affects to the first that the weight `apart` knots later affects.
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

    /// Its typical size, in its unit: for a motion the largest root mean square of the measured positions, for a force that of the other forces; 1 where
    /// there are none.
    pub fn scale(&self, model: &Model, records: &[Record]) -> f64 {
        let most = |sizes: &mut dyn Iterator<Item = f64>| sizes.filter(|x| x.is_finite()).fold(0.0, f64::max);
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

/// The estimate of an input that was not measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimated {
    /// Name of the input.
    pub input: String,
    /// Bandwidth that it was allowed, Hz.
    pub bandwidth_hz: f64,
    /// Hz, below which 95 % of its power was found, its mean apart; 0 where it rests.
    pub found_bandwidth_hz: f64,
    /// Standard deviation over all recordings, in its own unit.
    pub deviation: f64,
}

/// From the estimated curves of one input in several recordings, each with its sample time, s.
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const PERIOD: f64 = 0.01;

    fn record(before: usize, len: usize) -> Record {
        Record {
            name: "r".to_string(),
            period: PERIOD,
            len,
            jitter: Default::default(),
            inputs: Vec::new(),
            segments: Vec::new(),
            outputs: Vec::new(),
            spread: Vec::new(),
            conditions: Vec::new(),
            begins: Vec::new(),
            skip: 0,
            before,
            outliers: Vec::new(),
            logged: None,
            low_pass: None,
        }
    }

    /// Residual of the nearest curve to a sine, as a share of it, without both ends.
    fn residual_of_sine(unknown: &Unknown, hz: f64) -> f64 {
        let record = record(0, 2000);
        let knots = unknown.knots(&record);
        let one = |k: usize| unknown.curve(&(0..knots).map(|i| if i == k { 1.0 } else { 0.0 }).collect::<Vec<_>>(), &record);
        let columns: Vec<DVector<f64>> = (0..knots).map(|k| DVector::from_vec(one(k))).collect();
        let basis = DMatrix::from_columns(&columns);
        let sine = DVector::from_fn(2000, |i, _| (std::f64::consts::TAU * hz * i as f64 * PERIOD + 0.4).sin());
        let weights = (basis.transpose() * &basis).cholesky().unwrap().solve(&(basis.transpose() * &sine));
        let rest = sine - basis * weights;
        (rest.rows(300, 1400).norm_squared() / 700.0).sqrt()
    }

    #[test]
    fn it_is_as_fast_as_its_bandwidth() {
        let unknown = Unknown { input: 0, bandwidth_hz: 1.0 };
        assert!(residual_of_sine(&unknown, 0.5) < 5e-4, "{}", residual_of_sine(&unknown, 0.5));
        assert!((0.01..0.014).contains(&residual_of_sine(&unknown, 1.0)), "{}", residual_of_sine(&unknown, 1.0));
        assert!(residual_of_sine(&unknown, 2.0) > 0.9, "{}", residual_of_sine(&unknown, 2.0));
    }

    #[test]
    fn equal_weights_make_a_constant_and_a_part_is_a_part_of_the_whole() {
        let unknown = Unknown { input: 0, bandwidth_hz: 3.0 };
        let whole = record(0, 400);
        let knots = unknown.knots(&whole);
        assert!(unknown.curve(&vec![2.5; knots], &whole).iter().all(|x| (x - 2.5).abs() < 1e-12));
        let weights: Vec<f64> = (0..knots).map(|k| (k as f64).sin()).collect();
        assert_eq!(unknown.curve(&weights, &whole)[130..210], unknown.curve(&weights, &record(130, 80))[..]);
    }

    #[test]
    fn windows_of_weights_that_are_moved_together_do_not_meet() {
        let unknown = Unknown { input: 0, bandwidth_hz: 3.0 };
        for record in [record(0, 400), record(130, 80)] {
            let knots = unknown.knots(&super::tests::record(0, 400));
            for first in 0..6 {
                let windows: Vec<_> = (first..knots).step_by(6).map(|k| unknown.window(k, 6, &record)).collect();
                assert!(windows.windows(2).all(|w| w[0].end == w[1].start), "{windows:?}");
                // Where the weight acts is inside, up to the end of its window.
                let k = first + 6;
                let curve = unknown.curve(&(0..knots).map(|i| if i == k { 1.0 } else { 0.0 }).collect::<Vec<_>>(), &record);
                let window = unknown.window(k, 6, &record);
                assert!(curve.iter().enumerate().all(|(i, x)| *x == 0.0 || window.contains(&i)), "{k} {window:?}");
            }
        }
    }

    #[test]
    fn the_bandwidth_that_is_found_is_that_of_the_motion() {
        let unknown = Unknown { input: 0, bandwidth_hz: 5.0 };
        let sine: Vec<f64> = (0..2000).map(|i| 3.0 + 0.2 * (std::f64::consts::TAU * 1.5 * i as f64 * PERIOD).sin()).collect();
        let found = estimated("hand", &unknown, &[(sine, PERIOD), (vec![1.0; 500], PERIOD)]);
        assert!((1.5..1.7).contains(&found.found_bandwidth_hz), "{found:?}");
        assert!((found.deviation - 0.2 / 2f64.sqrt() * 0.8f64.sqrt()).abs() < 2e-3, "{found:?}");
    }
}
