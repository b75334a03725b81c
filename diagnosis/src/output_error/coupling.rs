//! A model coupled to what was measured (a tracking observer): a soft spring, damper or inerter pulls each measured body along its recording.
//!
//! Under a force that the model leaves out a free simulation diverges from the recording. Its residuals then have little to do with the place where the
//! effect acts. They are not a smooth function of the parameters: a slip a moment later is another local minimum. Coupled to the measured motion, the
//! residuals show where and when the missing force acts, several effects add up, and fits converge from far. The stronger the coupling, the more the
//! residuals are forces; without it they are simulation errors. Fits go from one to the other.

use crate::hypothesis::Scales;
use crate::recordings::problem::{Problem, Record};
use backdrive_plant::elements::kind_named;
use backdrive_plant::model::{Body, Element, Hold, Input, InputKind, Model, OutputKind};
use backdrive_plant::stepper::{Segment, segments};
use rayon::prelude::*;
use std::sync::Arc;

/// What pulls a body.
#[derive(Debug, Clone)]
struct Link {
    output: usize,
    body: usize,
    /// Kind of element, its parameter values.
    elements: Vec<(&'static str, f64)>,
    /// How often the output is to be integrated to a position.
    integrations: usize,
    /// Smoothed samples of each record; empty where it has none.
    samples: Vec<Arc<Vec<f64>>>,
    /// Gain, delay and offset that the nominal model gives the sensor, and the paths that follow.
    sensor: [f64; 3],
    paths: Vec<Arc<Vec<Segment>>>,
}

/// A coupling to the recordings of a problem.
#[derive(Debug, Clone)]
pub struct Coupling {
    links: Vec<Link>,
    /// Factor on all of its elements; 0 for none.
    pub strength: f64,
    /// Gain of each force input in the nominal model: a model scaled down is coupled as much more softly.
    gains: Vec<f64>,
}

impl Coupling {
    /// Couples every measured position, velocity and acceleration of a body that no input prescribes. A strength of 1 pulls, at the rms of the motion,
    /// as hard as the forces that act there; `noise_sd` is each output's measuring error.
    pub fn new(problem: &Problem, records: &[Record], scales: &Scales, noise_sd: &[f64], strength: f64) -> Coupling {
        let model = &problem.model;
        let mut links: Vec<Link> = Vec::new();
        for (output, o) in model.outputs.iter().enumerate() {
            let (body, integrations) = match o.kind {
                OutputKind::Position(body) => (body, 0),
                OutputKind::Velocity(body) => (body, 1),
                OutputKind::Acceleration(body) => (body, 2),
                OutputKind::Force(_) | OutputKind::Reaction(_) => continue,
            };
            let prescribed = model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
            let [x, v, a] = scales.motion([Some(body), None]).map(|s| s.rms);
            let force = scales.force(model, [Some(body), None]);
            if prescribed || !(force > 0.0 && x > 0.0 && v > 0.0 && a > 0.0) {
                continue;
            }
            let elements = match integrations {
                0 => vec![("spring", force / x), ("damper", 0.5 * force / v)],
                1 => vec![("damper", force / v)],
                _ => vec![("inerter", force / a)],
            };
            let smoothed =
                |r: &Record| r.outputs.get(output).and_then(Option::as_deref).map_or_else(Vec::new, |y| smooth(y, noise_sd[output]));
            let samples: Vec<Arc<Vec<f64>>> = records.par_iter().map(|r| Arc::new(smoothed(r))).collect();
            let sensor = [o.gain, o.delay, o.offset];
            let paths = samples.iter().zip(records).map(|(s, r)| Arc::new(path(s, sensor, integrations, r.period))).collect();
            links.push(Link { output, body, elements, integrations, samples, sensor, paths });
        }
        Coupling { links, strength, gains: model.inputs.iter().map(|i| i.gain).collect() }
    }

    /// Whether there is nothing to hold on to.
    pub fn is_empty(&self) -> bool {
        self.links.is_empty() || self.strength <= 0.0
    }

    /// The same coupling, another factor.
    pub fn with(&self, strength: f64) -> Coupling {
        Coupling { strength, ..self.clone() }
    }

    /// The same coupling for parts of the records: which record, from which sample to which, and its sample time.
    pub fn of_parts(&self, parts: &[(usize, std::ops::Range<usize>, f64)]) -> Coupling {
        let cut = |link: &Link| {
            let part = |(r, range, _): &(usize, std::ops::Range<usize>, f64)| {
                let samples = link.samples.get(*r).and_then(|s| s.get(range.clone()));
                Arc::new(samples.map(<[f64]>::to_vec).unwrap_or_default())
            };
            let samples: Vec<Arc<Vec<f64>>> = parts.iter().map(part).collect();
            let paths = samples.iter().zip(parts).map(|(s, p)| Arc::new(path(s, link.sensor, link.integrations, p.2))).collect();
            Link { samples, paths, ..link.clone() }
        };
        Coupling { links: self.links.iter().map(cut).collect(), ..self.clone() }
    }

    /// The model with the coupling of a record, and how the bodies that pull are moved: inputs behind those of the model.
    pub fn attach(&self, model: &Model, record: usize, period: f64) -> Option<(Model, Vec<Arc<Vec<Segment>>>)> {
        let mut coupled = model.clone();
        let mut moved = Vec::new();
        let forces = model.inputs.iter().zip(&self.gains).filter(|(i, g)| i.kind == InputKind::Force && **g != 0.0);
        let (sum, count) = forces.fold((0.0, 0.0), |(sum, count), (i, g)| (sum + (i.gain / g).abs(), count + 1.0));
        let scale = if count > 0.0 { sum / count } else { 1.0 };
        for link in &self.links {
            let Some(samples) = link.samples.get(record).filter(|s| !s.is_empty()) else { continue };
            let name = format!("coupling to {}", model.outputs.get(link.output)?.name);
            let body = coupled.bodies.len();
            let sensor = model.outputs.get(link.output)?;
            let strength = self.strength * scale * (sensor.gain / link.sensor[0]).abs();
            coupled.bodies.push(Body { name: name.clone(), inertia: 0.0 });
            for (kind, size) in &link.elements {
                let kind = kind_named(kind)?;
                let values: Vec<Vec<f64>> = kind
                    .parameters
                    .iter()
                    .enumerate()
                    .map(|(i, p)| vec![if i == 0 { strength * size } else { p.default.unwrap_or(0.0) }])
                    .collect();
                let law = (kind.build)(&values).ok()?;
                coupled.elements.push(Element { name: format!("{name}, {}", kind.name), between: [Some(link.body), Some(body)], law });
            }
            coupled.inputs.push(Input::ideal(&name, InputKind::Motion, body, Hold::Cubic));
            let sensor = [sensor.gain, sensor.delay, sensor.offset];
            moved.push(match link.paths.get(record).filter(|_| sensor == link.sensor) {
                Some(known) => known.clone(),
                None => Arc::new(path(samples, sensor, link.integrations, period)),
            });
        }
        Some((coupled, moved))
    }
}

/// How a pulling body moves, from what a sensor of this gain, delay and offset said.
fn path(samples: &[f64], [gain, delay, offset]: [f64; 3], integrations: usize, period: f64) -> Vec<Segment> {
    if samples.is_empty() {
        return Vec::new();
    }
    let mut path = unsensed(samples, gain, delay / period, offset);
    for _ in 0..integrations {
        path = integral(&path, period);
    }
    segments(Hold::Cubic, &path, period)
}

/// What a sensor was shown, from what it said: earlier by its delay (in samples), without offset and gain.
fn unsensed(samples: &[f64], gain: f64, delay: f64, offset: f64) -> Vec<f64> {
    let gain = if gain == 0.0 { 1.0 } else { gain };
    let last = samples.len() - 1;
    (0..samples.len())
        .map(|i| {
            let at = (i as f64 + delay).min(last as f64);
            let low = (at.floor() as usize).min(last);
            let share = at - low as f64;
            let y = samples[low] + share * (samples[(low + 1).min(last)] - samples[low]);
            (y - offset) / gain
        })
        .collect()
}

/// Integral from 0 by the trapezoidal rule.
fn integral(samples: &[f64], period: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut before = samples.first().copied().unwrap_or(0.0);
    samples
        .iter()
        .map(|y| {
            sum += 0.5 * period * (before + y);
            before = *y;
            sum
        })
        .collect()
}

/// The smoothest signal (by third differences, Whittaker 1923) whose distance from the samples is their error `noise_sd`, rms.
pub fn smooth(samples: &[f64], noise_sd: f64) -> Vec<f64> {
    let n = samples.len();
    if n < 8 || noise_sd <= 0.0 {
        return samples.to_vec();
    }
    let rms = |x: &[f64]| (x.iter().zip(samples).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / n as f64).sqrt();
    let (mut low, mut high) = (-4.0f64, 14.0f64);
    let mut best = samples.to_vec();
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        let tried = penalised(samples, 10f64.powf(middle));
        if rms(&tried) < noise_sd {
            best = tried;
            low = middle;
        } else {
            high = middle;
        }
    }
    best
}

/// Solves `(1 + weight D'D) x = y`, D third differences, by the band's LDL' factors.
fn penalised(y: &[f64], weight: f64) -> Vec<f64> {
    let n = y.len();
    const D: [f64; 4] = [-1.0, 3.0, -3.0, 1.0];
    // Diagonal and three below it: band[k][i] couples i and i + k.
    let mut band = vec![[0.0f64; 4]; n];
    for (i, row) in band.iter_mut().enumerate() {
        row[0] = 1.0;
        for first in i.saturating_sub(3)..=i.min(n - 4) {
            let at = i - first;
            for k in 0..4 - at {
                row[k] += weight * D[at] * D[at + k];
            }
        }
    }
    // L by columns: lower[i][k] = L(i + k, i).
    let mut x = y.to_vec();
    for i in 0..n {
        let pivot = band[i][0];
        let below = [band[i][1] / pivot, band[i][2] / pivot, band[i][3] / pivot];
        for a in 0..3 {
            if i + a + 1 >= n {
                break;
            }
            for b in a..3 {
                if i + b + 1 < n {
                    band[i + a + 1][b - a] -= below[a] * below[b] * pivot;
                }
            }
            x[i + a + 1] -= below[a] * x[i];
        }
        band[i] = [pivot, below[0], below[1], below[2]];
    }
    for i in (0..n).rev() {
        let mut value = x[i] / band[i][0];
        for k in 0..3 {
            if i + k + 1 < n {
                value -= band[i][k + 1] * x[i + k + 1];
            }
        }
        x[i] = value;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn a_parabola_is_as_smooth_as_can_be() {
        let y: Vec<f64> = (0..60).map(|i| 0.3 + 0.1 * f64::from(i) - 0.01 * f64::from(i * i)).collect();
        for (a, b) in penalised(&y, 1e6).iter().zip(&y) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }

    #[test]
    fn smoothing_takes_the_error_off() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let clean: Vec<f64> = (0..4000).map(|i| (f64::from(i) * 0.01).sin()).collect();
        let y: Vec<f64> = clean
            .iter()
            .map(|c| {
                let e: f64 = StandardNormal.sample(&mut random);
                c + 0.01 * e
            })
            .collect();
        let s = smooth(&y, 0.01);
        let error = (s.iter().zip(&clean).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / 4000.0).sqrt();
        assert!(error < 0.003, "{error}");
    }
}
