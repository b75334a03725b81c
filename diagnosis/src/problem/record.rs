//! One recording on a regular grid, with the signals that the model names.

use super::error::ProblemError;
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use backdrive_plant::recording::{Jitter, Recording};
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{Segment, segments};

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
    /// Parameters with another value in this file.
    pub conditions: Vec<(String, Condition)>,
    /// Bodies that do not start at rest, where it is a part of a recording: body, position in m, velocity in m/s.
    pub begins: Vec<(usize, f64, f64)>,
    /// Samples at its start that do not count, for the same reason.
    pub skip: usize,
    /// Samples of the recording before it, where it is a part of one.
    pub before: usize,
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
        let recording = recording.regular_for(model)?;
        let (count, fewest) = (recording.len(), tuning().recordings.fewest_samples);
        if count < fewest {
            return Err(ProblemError::Set(format!(
                "{}: has {count} samples; a diagnosis needs at least {fewest} per recording",
                recording.name
            )));
        }
        let input = |(index, input): (usize, &backdrive_plant::model::Input)| match unmeasured.contains(&index) {
            true => Ok(vec![0.0; recording.len()]),
            false => recording.need_signal(&input.name).map(<[f64]>::to_vec),
        };
        let inputs: Vec<Vec<f64>> = model.inputs.iter().enumerate().map(input).collect::<Result<_, _>>()?;
        let outputs: Vec<Option<Vec<f64>>> = model.outputs.iter().map(|o| recording.signal(&o.name).map(<[f64]>::to_vec)).collect();
        let period = recording.period;
        let segments = model.inputs.iter().zip(&inputs).map(|(input, samples)| segments(input.hold, samples, period)).collect();
        let spread = outputs.iter().map(|o| o.as_deref().map_or(1.0, spread)).collect();
        let (name, len, begins) = (recording.name.clone(), recording.len(), Vec::new());
        Ok(Record { name, period, len, jitter, inputs, segments, outputs, spread, conditions, begins, skip: 0, before: 0 })
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
