//! One recording on a regular grid, with the signals that the model names.

use super::error::ProblemError;
use super::logged::Logged;
use super::outliers::{Outliers, beside, places};
use crate::tuning::tuning;
use backdrive_plant::model::{Hold, Model, OutputKind};
use backdrive_plant::recording::{Jitter, Recording};
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{Segment, segments};
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
        let logged = recording;
        let (count, fewest) = (logged.len(), tuning().recordings.fewest_samples);
        if count < fewest {
            return Err(ProblemError::Short { name: logged.name.clone(), count, fewest });
        }
        // A clock that only jitters is taken for even. What fits need of an irregular one on an even grid has as many samples; what is simulated and
        // compared stays on the times at which it was logged.
        let is_irregular = !logged.is_regular(0.5) && unmeasured.is_empty();
        let hold = |name: &str| model.inputs.iter().find(|i| i.name == name).map_or(Hold::Linear, |i| i.hold);
        let recording = if is_irregular { logged.onto_grid(logged.period, hold)? } else { logged.regular_for(model)? };
        let input = |(index, input): (usize, &backdrive_plant::model::Input)| match unmeasured.contains(&index) {
            true => Ok(vec![0.0; recording.len()]),
            false => recording.need_signal(&input.name).map(<[f64]>::to_vec),
        };
        let inputs: Vec<Vec<f64>> = model.inputs.iter().enumerate().map(input).collect::<Result<_, _>>()?;
        let mut outputs: Vec<Option<Vec<f64>>> = model.outputs.iter().map(|o| recording.signal(&o.name).map(<[f64]>::to_vec)).collect();
        let mut outliers = Vec::new();
        let mut look = |name: &str, samples: &mut [f64], replace: bool| {
            let found = places(samples);
            let Some((first, size)) = found.first().copied() else { return };
            found.iter().filter(|_| replace).for_each(|(i, _)| samples[*i] = beside(samples, *i));
            let (count, first) = (found.len(), first as f64 * recording.period);
            outliers.push(Outliers { signal: name.to_string(), count, first, size, replaced: replace });
        };
        // A motion cannot do that; a force may, and what drove the device is what was recorded of it.
        for (output, samples) in model.outputs.iter().zip(&mut outputs) {
            let motion = !matches!(output.kind, OutputKind::Reaction(_));
            samples.iter_mut().for_each(|samples| look(&output.name, samples, motion));
        }
        for (input, samples) in model.inputs.iter().zip(&inputs) {
            look(&input.name, &mut samples.clone(), false);
        }
        let period = recording.period;
        let segments = model.inputs.iter().zip(&inputs).map(|(input, samples)| segments(input.hold, samples, period)).collect();
        let logged = if is_irregular {
            let of = |name: &String| logged.need_signal(name).map(<[f64]>::to_vec);
            let inputs: Vec<Vec<f64>> = model.inputs.iter().map(|i| of(&i.name)).collect::<Result<_, _>>()?;
            let mut outputs: Vec<Option<Vec<f64>>> = model.outputs.iter().map(|o| logged.signal(&o.name).map(<[f64]>::to_vec)).collect();
            for (output, samples) in model.outputs.iter().zip(&mut outputs).filter(|(o, _)| !matches!(o.kind, OutputKind::Reaction(_))) {
                samples.iter_mut().for_each(|s| places(s).into_iter().for_each(|(i, _)| s[i] = beside(s, i)));
                debug_assert!(samples.as_ref().is_none_or(|s| s.len() == count), "{}", output.name);
            }
            Some(Arc::new(Logged::new(model, &logged.t, &inputs, outputs)))
        } else {
            None
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
        })
    }

    /// Samples of an output that a free simulation is compared with: as they were logged. `None` where this file has none.
    pub fn compared(&self, output: usize) -> Option<&[f64]> {
        let outputs = self.logged.as_ref().map_or(&self.outputs, |logged| &logged.outputs);
        outputs.get(output)?.as_deref()
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
            logged: None,
            ..self.clone()
        }
    }
}

/// Standard deviation; 1 where it is 0.
fn spread(samples: &[f64]) -> f64 {
    let n = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let variance = samples.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    if variance > 0.0 { variance.sqrt() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

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
