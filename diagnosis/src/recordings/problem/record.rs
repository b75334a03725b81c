//! One recording on a regular grid, with the signals that the model names.

use super::error::ProblemError;
use super::logged::Logged;
use super::outliers::{Outliers, beside, places};
use crate::tuning::tuning;
use backdrive_plant::model::{Hold, Input, InputKind, Model, OutputKind};
use backdrive_plant::recording::{Jitter, Recording};
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{Segment, segments};
use backdrive_signal::low_pass::LowPass;
use std::sync::Arc;

/// One recording, ready to be simulated and compared.
#[derive(Debug, Clone)]
pub struct Record {
    /// Its file.
    pub name: String,
    /// Sample time, s.
    pub period: f64,
    /// Number of samples.
    pub len: usize,
    /// How regular its clock was before it was put on a grid.
    pub jitter: Jitter,
    /// Samples of each input of the model.
    pub inputs: Vec<Vec<f64>>,
    /// The same as the stepper takes them.
    pub segments: Vec<Vec<Segment>>,
    /// Samples of each output of the model, in the output's unit; `None` where this file has none.
    pub outputs: Vec<Option<Vec<f64>>>,
    /// Standard deviation of each output's samples; 1 where there are none or all are the same.
    pub spread: Vec<f64>,
    /// Samples that no device can have made.
    pub outliers: Vec<Outliers>,
    /// Parameters with another value in this file.
    pub conditions: Vec<(String, Condition)>,
    /// Bodies that do not start at rest, where it is a part of a recording: body, position in m, velocity in m/s.
    pub begins: Vec<(usize, f64, f64)>,
    /// Samples at its start that do not count, for the same reason.
    pub skip: usize,
    /// Samples of the recording before it, where it is a part of one.
    pub before: usize,
    /// The recording on the times at which it was logged, where its clock is irregular; its other samples are then brought onto an even grid of as many.
    pub logged: Option<Arc<Logged>>,
    /// The low-pass that its inputs and outputs went through, and that a prediction of its outputs has to go through; see [`crate::equation_error`].
    pub low_pass: Option<Arc<LowPass>>,
}

impl Record {
    /// A recording as the model needs it.
    ///
    /// # Errors
    /// When an input is missing, or there are too few samples.
    pub fn new(recording: &Recording, model: &Model, conditions: Vec<(String, Condition)>) -> Result<Record, ProblemError> {
        Record::without(recording, model, conditions, &[])
    }

    /// The same where the inputs `unmeasured`, by their index in the model, were not recorded: their samples are 0.
    pub(super) fn without(
        recording: &Recording,
        model: &Model,
        conditions: Vec<(String, Condition)>,
        unmeasured: &[usize],
    ) -> Result<Record, ProblemError> {
        let jitter = recording.jitter.clone();
        let (count, fewest) = (recording.len(), tuning().recordings.fewest_samples);
        if count < fewest {
            return Err(ProblemError::Short { name: recording.name.clone(), count, fewest });
        }
        let (as_logged, outliers) = without_outliers(recording, model);
        // A clock that only jitters is taken for even. What fits need of an irregular one on an even grid has as many samples; what is simulated and
        // compared stays on the times at which it was logged.
        let is_irregular = !as_logged.is_regular(0.5) && unmeasured.is_empty();
        let hold = |name: &str| model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold);
        let recording = if is_irregular { as_logged.onto_grid(as_logged.period, hold)? } else { as_logged.regular_for(model)? };
        let input = |(index, input): (usize, &Input)| match unmeasured.contains(&index) {
            true => Ok(vec![0.0; recording.len()]),
            false => recording.need_signal(&input.name).map(<[f64]>::to_vec),
        };
        let outputs_in = |from: &Recording| -> Vec<Option<Vec<f64>>> {
            model.outputs.iter().map(|o| from.signal(&o.name).map(<[f64]>::to_vec)).collect()
        };
        let inputs: Vec<Vec<f64>> = model.inputs.iter().enumerate().map(input).collect::<Result<_, _>>()?;
        let outputs = outputs_in(&recording);
        let period = recording.period;
        let segments = model.inputs.iter().zip(&inputs).map(|(input, samples)| segments(input.hold, samples, period)).collect();
        let logged = match is_irregular {
            true => Some(Arc::new(Logged::new(model, &as_logged.t, &as_logged.inputs_of(model)?, outputs_in(&as_logged)))),
            false => None,
        };
        let spread = outputs.iter().map(|o| o.as_deref().map_or(1.0, spread)).collect();
        let (name, len, begins) = (recording.name.clone(), recording.len(), Vec::new());
        Ok(Record {
            name,
            period,
            len,
            jitter,
            inputs,
            segments,
            outputs,
            spread,
            outliers,
            conditions,
            begins,
            skip: 0,
            before: 0,
            logged,
            low_pass: None,
        })
    }

    /// Samples of an output that a free simulation is compared with: as they were logged. `None` where this file has none.
    pub fn compared(&self, output: usize) -> Option<&[f64]> {
        let outputs = self.logged.as_ref().map_or(&self.outputs, |logged| &logged.outputs);
        outputs.get(output)?.as_deref()
    }

    /// The same without some of its outputs, by their index in the model.
    pub(super) fn without_outputs(mut self, outputs: &[usize]) -> Record {
        for output in outputs {
            self.outputs.get_mut(*output).map(Option::take);
            if let Some(logged) = &mut self.logged {
                Arc::make_mut(logged).outputs.get_mut(*output).map(Option::take);
            }
        }
        self
    }

    /// The sum of the forces that inputs make, at its samples, N or N m; `None` where an input has too few.
    pub(crate) fn total_force(&self, model: &Model) -> Option<Vec<f64>> {
        let mut force = vec![0.0; self.len];
        for (input, samples) in model.inputs.iter().zip(&self.inputs) {
            // What is held from sample to sample acts half a sample later on average: around a sample, half the one before.
            let before = |i: usize| if input.hold == Hold::Zero { samples.get(i.saturating_sub(1)) } else { samples.get(i) };
            for (i, (sum, now)) in force.iter_mut().zip(samples).enumerate() {
                *sum += input.gain * 0.5 * (now + before(i)?);
            }
        }
        Some(force)
    }

    /// Bodies from `first` on, those of a hypothesis included, as the one body that a motion input prescribes moves at a sample: index, position, velocity. What
    /// hangs on a body begins with it. Empty where no motion is prescribed, or several are.
    pub(crate) fn along_the_motion(&self, first: usize, model: &Model, at: usize) -> Vec<(usize, f64, f64)> {
        let motions: Vec<usize> = (0..model.inputs.len()).filter(|i| model.inputs[*i].kind == InputKind::Motion).collect();
        let [input] = motions.as_slice() else { return Vec::new() };
        let Some((samples, gain)) = self.inputs.get(*input).zip(model.inputs.get(*input).map(|i| i.gain)) else { return Vec::new() };
        let (before, after) = (at.saturating_sub(1), (at + 1).min(samples.len().saturating_sub(1)));
        let (Some(now), Some(a), Some(b)) = (samples.get(at), samples.get(before), samples.get(after)) else { return Vec::new() };
        let speed = gain * (b - a) / (after.saturating_sub(before).max(1) as f64 * self.period);
        (first..model.bodies.len() + ADDED).map(|body| (body, gain * now, speed)).collect()
    }

    /// A part of the recording, with the motion that the bodies begin with and the samples that do not count.
    pub fn part(&self, range: std::ops::Range<usize>, begins: Vec<(usize, f64, f64)>, skip: usize) -> Record {
        let of = |samples: &Vec<f64>| samples.get(range.clone()).map(<[f64]>::to_vec).unwrap_or_default();
        Record {
            len: range.len(),
            inputs: self.inputs.iter().map(of).collect(),
            // One fewer than samples where the input runs on from one to the next.
            segments: self
                .segments
                .iter()
                .map(|s| s.get(range.start..range.end.min(s.len())).map(<[Segment]>::to_vec).unwrap_or_default())
                .collect(),
            outputs: self.outputs.iter().map(|o| o.as_ref().map(of)).collect(),
            begins,
            skip,
            before: self.before + range.start,
            // From the middle on it is simulated coupled, which is on an even grid.
            logged: self.logged.as_ref().filter(|_| range.start == 0).map(|logged| Arc::new(logged.first(range.end))),
            ..self.clone()
        }
    }
}

/// Bodies that hypotheses may add, at most.
const ADDED: usize = 4;

/// A recording whose outliers are put between their neighbours, and all that were found. Those of forces are left as they are: a motion cannot do that, a force
/// may, and what drove the device is what was recorded of it.
fn without_outliers(recording: &Recording, model: &Model) -> (Recording, Vec<Outliers>) {
    let mut clean = recording.clone();
    let mut all = Vec::new();
    let is_motion = |name: &str| model.outputs.iter().any(|o| o.name == name && !matches!(o.kind, OutputKind::Reaction(_)));
    let is_of_model = |name: &str| model.inputs.iter().any(|i| i.name == name) || model.outputs.iter().any(|o| o.name == name);
    for (name, samples) in clean.signals.iter_mut().filter(|(name, _)| is_of_model(name)) {
        let (found, replaced) = (places(samples), is_motion(name));
        let Some((at, size)) = found.first().copied() else { continue };
        found.iter().filter(|_| replaced).for_each(|(i, _)| samples[*i] = beside(samples, *i));
        let first = recording.t[at] - recording.t[0];
        all.push(Outliers { signal: name.clone(), count: found.len(), first, size, replaced });
    }
    (clean, all)
}

/// Standard deviation; 1 where it is 0.
pub(crate) fn spread(samples: &[f64]) -> f64 {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    if variance > 0.0 { variance.sqrt() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wild_sample_of_a_motion_is_put_between_its_neighbours_on_whatever_clock() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                    [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        for odd in [0.0, 0.6] {
            // With a gap in the middle, or without.
            let t: Vec<f64> = (0..200).map(|i| 0.01 * (f64::from(i) + if i > 100 { 40.0 * odd } else { 0.0 })).collect();
            let mut x: Vec<f64> = t.iter().map(|t| t.sin()).collect();
            x[40] = 90.0;
            let signals = vec![("f".to_string(), t.clone()), ("x".to_string(), x)];
            let record = Record::new(&Recording::new("r", t.clone(), signals).unwrap(), &model, Vec::new()).unwrap();
            assert_eq!(record.logged.is_some(), odd > 0.0);
            let [found] = record.outliers.as_slice() else { panic!("{:?}", record.outliers) };
            assert!(found.count == 1 && found.replaced && (found.first - 0.4).abs() < 1e-9, "{found:?}");
            assert!((record.compared(0).unwrap()[40] - t[40].sin()).abs() < 1e-4);
            assert!(record.outputs[0].as_ref().unwrap().iter().all(|x| x.abs() < 1.1));
        }
    }

    #[test]
    fn a_part_to_the_very_end_keeps_its_inputs() {
        let text = "name = 'cart'\n[bodies]\ncart = 2.0\n[[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\n\
                    [[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let t: Vec<f64> = (0..100).map(|i| 0.01 * f64::from(i)).collect();
        let signals = vec![("f".to_string(), t.clone()), ("x".to_string(), t.clone())];
        let record = Record::new(&Recording::new("r", t, signals).unwrap(), &model, Vec::new()).unwrap();
        let part = record.part(60..100, Vec::new(), 0);
        assert_eq!((part.len, part.segments[0].len()), (40, 39));
        assert_eq!(record.part(20..60, Vec::new(), 0).segments[0].len(), 40);
    }
}
