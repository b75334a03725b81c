//! A recording whose clock is irregular, on the times at which it was logged. The inputs of a simulation are on a grid fine enough for these times, and
//! each sample has its place on that grid.

use crate::tuning::tuning;
use backdrive_plant::model::{Hold, Input, Model};
use backdrive_plant::recording::resample;
use backdrive_plant::stepper::{Segment, segments};

/// The recording on its own times.
#[derive(Debug, Clone)]
pub struct Logged {
    /// Step of the grid, s.
    pub step: f64,
    /// Inputs of the model on the grid.
    pub inputs: Vec<Vec<f64>>,
    /// The same as the stepper takes them.
    pub segments: Vec<Vec<Segment>>,
    /// Where each sample was taken, steps of the grid from the first sample.
    pub at: Vec<f64>,
    /// Samples of each output as they were logged; `None` where this file has none.
    pub outputs: Vec<Option<Vec<f64>>>,
}

impl Logged {
    /// From samples at times `t`, s, which rise. `inputs` and `outputs` are in the order of the model.
    pub(super) fn new(model: &Model, t: &[f64], inputs: &[&[f64]], outputs: Vec<Option<Vec<f64>>>) -> Logged {
        let (first, last) = (t.first().copied().unwrap_or(0.0), t.last().copied().unwrap_or(0.0));
        let mean = (last - first) / t.len().saturating_sub(1).max(1) as f64;
        let step = mean / tuning().recordings.grid_steps as f64;
        // One point beyond the last sample, so that it has neighbours on both sides.
        let count = ((last - first) / step).ceil() as usize + 2;
        let grid: Vec<f64> = (0..count).map(|i| first + i as f64 * step).collect();
        let onto = |(input, samples): (&Input, &&[f64])| match input.hold {
            Hold::Zero => held(t, samples, first, step, count),
            hold => resample(hold, t, samples, &grid),
        };
        let inputs: Vec<Vec<f64>> = model.inputs.iter().zip(inputs).map(onto).collect();
        let segments = model.inputs.iter().zip(&inputs).map(|(input, samples)| segments(input.hold, samples, step)).collect();
        Logged { step, inputs, segments, at: t.iter().map(|t| (t - first) / step).collect(), outputs }
    }

    /// The first samples of it.
    pub(super) fn first(&self, samples: usize) -> Logged {
        let cut = |outputs: &Option<Vec<f64>>| outputs.as_ref().map(|o| o[..samples.min(o.len())].to_vec());
        Logged { at: self.at[..samples.min(self.at.len())].to_vec(), outputs: self.outputs.iter().map(cut).collect(), ..self.clone() }
    }

    /// Points of the grid.
    pub fn len(&self) -> usize {
        self.at.last().map_or(0, |last| last.ceil() as usize + 2)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.at.is_empty()
    }

    /// Values at the times of the samples of a column on the grid: cubics through four of its points.
    pub fn read(&self, column: &[f64]) -> Vec<f64> {
        let at = |place: &f64| {
            let last = column.len().saturating_sub(4);
            let k = (place.floor() as usize).saturating_sub(1).min(last);
            let Some([a, b, c, d]) = column.get(k..k + 4) else { return column.last().copied().unwrap_or(0.0) };
            let s = place - k as f64;
            let (s1, s2, s3) = (s - 1.0, s - 2.0, s - 3.0);
            -a * s1 * s2 * s3 / 6.0 + b * s * s2 * s3 / 2.0 - c * s * s1 * s3 / 2.0 + d * s * s1 * s2 / 6.0
        };
        self.at.iter().map(at).collect()
    }
}

/// A held input on the grid: each point has the mean over its step, so that a change between two points comes neither early nor late.
fn held(t: &[f64], samples: &[f64], first: f64, step: f64, count: usize) -> Vec<f64> {
    let mut i = 0;
    let mean = |k: usize| {
        let (from, to) = (first + k as f64 * step, first + (k + 1) as f64 * step);
        while i + 1 < t.len() && t[i + 1] <= from {
            i += 1;
        }
        let (mut sum, mut at, mut j) = (0.0, from, i);
        while j + 1 < t.len() && t[j + 1] < to {
            sum += samples[j] * (t[j + 1] - at);
            at = t[j + 1];
            j += 1;
        }
        (sum + samples.get(j).copied().unwrap_or(0.0) * (to - at)) / step
    };
    (0..count).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output_error::simulate::predict;
    use crate::recordings::problem::Record;
    use backdrive_plant::recording::Recording;

    /// A mass on a spring with a damper.
    const SPRUNG: &str = "name = 'sprung'\n[bodies]\ncart = 2.0\n[[elements]]\nkind = 'spring'\nbetween = ['cart', 'ground']\nstiffness = 800.0\n\
                          [[elements]]\nkind = 'damper'\nbetween = ['cart', 'ground']\ndamping = 8.0\n\
                          [[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\nhold = 'linear'\n\
                          [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";

    /// Times whose steps alternate between 0.4 and 1.6 of their mean, with one of six.
    fn irregular(count: usize, mean: f64) -> Vec<f64> {
        let step = |i: usize| {
            mean * if i % 97 == 50 {
                6.0
            } else if i.is_multiple_of(2) {
                0.4
            } else {
                1.6
            }
        };
        (0..count).scan(0.0, |t, i| Some(std::mem::replace(t, *t + step(i)))).collect()
    }

    #[test]
    fn an_irregular_recording_is_simulated_on_the_times_it_was_logged_at() {
        let model = Model::from_toml(SPRUNG, "sprung.toml").unwrap();
        let t = irregular(2000, 2e-3);
        // Slow enough for straight lines between the samples to be the force: its answer is that of the steady state in closed form.
        let (omega, mass, spring, damping) = (11.0, 2.0, 800.0, 8.0);
        let force: Vec<f64> = t.iter().map(|t| (omega * t).sin()).collect();
        let (re, im) = (spring - mass * omega * omega, damping * omega);
        let size = 1.0 / (re * re + im * im).sqrt();
        let steady: Vec<f64> = t.iter().map(|t| size * (omega * t - f64::atan2(im, re)).sin()).collect();
        let recording = Recording::new("r", t.clone(), vec![("f".to_string(), force), ("x".to_string(), steady.clone())]).unwrap();
        let record = Record::new(&recording, &model, Vec::new()).unwrap();
        assert_eq!(record.len, 2000);
        let predicted = predict(&model, &record, 16).unwrap();
        // After the transient, e^(-c/2m t).
        let late: Vec<usize> = (0..t.len()).filter(|i| t[*i] > 3.0).collect();
        let off = late.iter().map(|i| (predicted[*i] - steady[*i]).abs()).fold(0.0, f64::max);
        assert!(late.len() > 400 && off < 2e-3 * size, "{off} of {size}");
        assert_eq!(record.compared(0).unwrap(), steady);
        // Its beginning alone is predicted as in the whole.
        let beginning = record.part(0..500, Vec::new(), 0);
        assert_eq!(beginning.compared(0).unwrap(), &steady[..500]);
        let alone = predict(&model, &beginning, 16).unwrap();
        assert!(alone.iter().zip(&predicted).all(|(a, b)| (a - b).abs() < 1e-9 * size) && alone.len() == 500);
    }

    #[test]
    fn a_held_input_keeps_its_impulse_on_the_grid() {
        let (t, y) = ([0.0, 0.35, 0.5, 2.0], [1.0, -2.0, 4.0, 0.0]);
        let found = held(&t, &y, 0.0, 0.25, 8);
        assert!((found.iter().sum::<f64>() * 0.25 - (0.35 - 0.3 + 6.0)).abs() < 1e-12, "{found:?}");
        assert!((found[1] - (0.1 - 0.3) / 0.25).abs() < 1e-12);
    }

    #[test]
    fn a_cubic_is_read_between_the_points_of_the_grid() {
        let logged = Logged { step: 1.0, inputs: Vec::new(), segments: Vec::new(), at: vec![0.0, 0.3, 2.5, 6.9], outputs: Vec::new() };
        let cubic = |x: f64| 1.0 - x + 0.5 * x * x - 0.02 * x * x * x;
        let column: Vec<f64> = (0..logged.len()).map(|i| cubic(i as f64)).collect();
        for (place, found) in logged.at.iter().zip(logged.read(&column)) {
            assert!((found - cubic(*place)).abs() < 1e-12);
        }
    }
}
