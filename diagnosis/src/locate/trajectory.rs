//! The nominal model simulated over a run, and the residual of the recording.

use super::types::{LocateError, Run};
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant, Segment, ahead, segments};

/// A simulated run beside its recording.
pub(super) struct Trajectory {
    pub period: f64,
    pub len: usize,
    /// Position, m, and velocity, m/s, of each body; one column each.
    pub position: Vec<Vec<f64>>,
    pub velocity: Vec<Vec<f64>>,
    /// Inputs behind their gain.
    pub drive: Vec<Vec<f64>>,
    /// Outputs that were recorded: their indices, and what the model predicts.
    pub rows: Vec<usize>,
    pub predicted: Vec<Vec<f64>>,
    /// Recorded less predicted, one column for each of `rows`. That of a delayed output stands at the time that it measures.
    pub residual: Vec<Vec<f64>>,
}

impl Trajectory {
    pub fn of(model: &Model, run: &Run) -> Result<Trajectory, LocateError> {
        let recorded = run.outputs.iter().flatten().map(|c| c.len());
        let len = run.inputs.iter().map(Vec::len).chain(recorded).min().unwrap_or(0);
        if run.inputs.len() < model.inputs.len() || run.outputs.len() < model.outputs.len() {
            let (inputs, outputs) = (run.inputs.len(), run.outputs.len());
            return Err(LocateError::Columns { run: run.name.to_string(), inputs, outputs });
        }
        if len < tuning().locate.fewest_samples {
            return Err(LocateError::TooShort { run: run.name.to_string(), samples: len });
        }
        let caught_up = ahead(model, run.inputs, run.period);
        let (model, inputs) = caught_up.as_ref().map_or((model, run.inputs), |(model, columns)| (model, columns.as_slice()));
        let mut plant = Plant::new(model, run.period, &Options::default())?;
        let driven: Vec<Vec<Segment>> = model.inputs.iter().zip(inputs).map(|(i, c)| segments(i.hold, &c[..len], run.period)).collect();
        plant.start_at(&inputs.iter().map(|c| c.first().copied().unwrap_or(0.0)).collect::<Vec<_>>());
        let bodies = model.bodies.len();
        let mut position = vec![Vec::with_capacity(len); bodies];
        let mut velocity = vec![Vec::with_capacity(len); bodies];
        let mut outputs = vec![Vec::with_capacity(len); model.outputs.len()];
        let mut read = vec![0.0; model.outputs.len()];
        let mut now = vec![Segment::default(); driven.len()];
        for k in 0..len {
            plant.outputs(&mut read);
            for body in 0..bodies {
                position[body].push(plant.position(body));
                velocity[body].push(plant.velocity(body));
            }
            outputs.iter_mut().zip(&read).for_each(|(column, y)| column.push(*y));
            if k + 1 < len {
                now.iter_mut().zip(&driven).for_each(|(s, column)| *s = column.get(k).copied().unwrap_or_default());
                plant.step(&now);
            }
        }
        if !plant.is_finite() || outputs.iter().flatten().any(|y| !y.is_finite()) {
            return Err(LocateError::Diverged { run: run.name.to_string() });
        }
        let (mut rows, mut predicted, mut residual) = (Vec::new(), Vec::new(), Vec::new());
        for (index, ((column, simulated), output)) in run.outputs.iter().zip(outputs).zip(&model.outputs).enumerate() {
            let Some(column) = column else { continue };
            let late = ((output.delay / run.period).round() as usize).min(len - 1);
            // The last samples of a delayed output were not measured within the run: they count as explained.
            let at = |k: usize| if k + late < len { column[k + late] - simulated[k + late] } else { 0.0 };
            residual.push((0..len).map(at).collect());
            rows.push(index);
            predicted.push(simulated);
        }
        if rows.is_empty() {
            return Err(LocateError::NothingMeasured { run: run.name.to_string() });
        }
        let drive = model.inputs.iter().zip(inputs).map(|(i, c)| c[..len].iter().map(|u| i.gain * u + i.offset).collect()).collect();
        Ok(Trajectory { period: run.period, len, position, velocity, drive, rows, predicted, residual })
    }

    /// Keeps only every `stride`-th sample.
    pub fn thin(&mut self, stride: usize) {
        let all = [&mut self.position, &mut self.velocity, &mut self.drive, &mut self.predicted, &mut self.residual];
        for column in all.into_iter().flatten() {
            *column = column.iter().step_by(stride).copied().collect();
        }
        self.len = self.len.div_ceil(stride);
        self.period *= stride as f64;
    }

    /// Displacement and velocity of one place against another.
    pub fn across(&self, ends: [Option<usize>; 2]) -> (Vec<f64>, Vec<f64>) {
        let of = |columns: &[Vec<f64>]| {
            let at = |end: Option<usize>, k: usize| end.and_then(|b| columns.get(b)).map_or(0.0, |c| c[k]);
            (0..self.len).map(|k| at(ends[0], k) - at(ends[1], k)).collect::<Vec<f64>>()
        };
        (of(&self.position), of(&self.velocity))
    }
}
