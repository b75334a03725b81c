//! What an experiment is simulated with: sensors, solver steps and work; and an excitation as a recording to come.

use super::extra_output::output;
use super::menu::{Choice, InputRange, constant, scaled};
use crate::output_error::evaluator::measured;
use crate::output_error::simulate::{Conditions, predict_under};
use crate::output_error::work::Budget;
use crate::recordings::problem::{Problem, Record};
use backdrive_plant::excitation::Excitation;
use backdrive_plant::model::{Model, OutputKind};
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;

/// What is measured: how well, and what is compared. One for each output of the models that are simulated.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    /// Noise standard deviation of each output, in its unit.
    pub noise_sd: Vec<f64>,
    /// As [`Problem::lag`].
    pub lag: Vec<usize>,
    /// Which outputs are recorded.
    pub there: Vec<bool>,
}

impl Sensors {
    /// The outputs that some recording of the problem has.
    pub(super) fn of(problem: &Problem, noise_sd: &[f64]) -> Sensors {
        let there = |o: usize| problem.fit.iter().any(|r| r.outputs.get(o).is_some_and(Option::is_some));
        let count = problem.model.outputs.len();
        // An output without a noise standard deviation is given no weight.
        let noise_sd = (0..count).map(|o| noise_sd.get(o).copied().filter(|f| *f > 0.0).unwrap_or(f64::INFINITY)).collect();
        Sensors { noise_sd, lag: problem.lag.clone(), there: (0..count).map(there).collect() }
    }
}

/// What an experiment is simulated with: a problem, its sensors, the solver steps and the work that is left.
#[derive(Clone)]
pub(super) struct Setup<'a> {
    pub problem: &'a Problem,
    pub sensors: Sensors,
    /// Outputs beyond those of the model file, with the indices of the nominal model; they come last in predictions.
    pub extra: Vec<OutputKind>,
    /// Substeps per sample, at most.
    pub substeps: usize,
    /// Counts the work, and ends refits when it is used up.
    pub budget: Budget<'a>,
}

/// An excitation as a recording whose outputs are still 0.
pub(super) struct Trial {
    pub choice: Choice,
    /// Constant values of the other inputs.
    pub others: Vec<(usize, Excitation)>,
    pub record: Record,
}

impl<'a> Setup<'a> {
    /// The same, counted by another budget.
    pub(super) fn within(&self, budget: &Budget<'a>) -> Setup<'a> {
        Setup { budget: budget.clone(), ..self.clone() }
    }

    /// An excitation as a recording, made smaller until it stays within the range of the input.
    pub(super) fn trial(&self, choice: &Choice, ranges: &[Option<InputRange>], rate_hz: f64) -> Option<Trial> {
        let range = ranges.get(choice.input)?.as_ref()?;
        let period = 1.0 / rate_hz;
        let samples = choice.excitation.samples(rate_hz).ok()?;
        let centred: Vec<f64> = samples.iter().map(|u| u - range.mean).collect();
        let away = if range.mean == 0.0 { &samples } else { &centred };
        let share = range.share(away, period, choice.lasting);
        let excitation = if share < 1.0 { scaled(&choice.excitation, 0.995 * share) } else { choice.excitation.clone() };
        self.trial_of(Choice { excitation, ..choice.clone() }, ranges, rate_hz)
    }

    fn trial_of(&self, choice: Choice, ranges: &[Option<InputRange>], rate_hz: f64) -> Option<Trial> {
        let model = &self.problem.model;
        let samples = choice.excitation.samples(rate_hz).ok()?;
        let (count, period) = (samples.len(), 1.0 / rate_hz);
        let mut others = Vec::new();
        let mut signals: Vec<(String, Vec<f64>)> = Vec::new();
        for (i, input) in model.inputs.iter().enumerate() {
            let kept = ranges.get(i).copied().flatten().map_or(0.0, |s| s.mean);
            let mut column = vec![0.0; count];
            if i == choice.input {
                column.copy_from_slice(&samples);
            } else if kept != 0.0 {
                let keep = constant(kept, count as f64 * period);
                let kept = keep.samples(rate_hz).ok()?;
                column.iter_mut().zip(kept).for_each(|(a, b)| *a = b);
                others.push((i, keep));
            }
            signals.push((input.name.clone(), column));
        }
        let there = model.outputs.iter().zip(&self.sensors.there).filter(|(_, there)| **there);
        signals.extend(there.map(|(o, _)| (o.name.clone(), vec![0.0; count])));
        let t = (0..count).map(|k| k as f64 * period).collect();
        let recording = Recording::new("experiment", t, signals).ok()?;
        let record = Record::new(&recording, model, Vec::new()).ok()?;
        Some(Trial { choice, others, record })
    }

    /// The same experiment with its amplitude multiplied.
    pub(super) fn smaller(&self, trial: &Trial, factor: f64, ranges: &[Option<InputRange>], rate_hz: f64) -> Option<Trial> {
        let excitation = scaled(&trial.choice.excitation, factor);
        self.trial_of(Choice { excitation, ..trial.choice.clone() }, ranges, rate_hz)
    }

    /// What a model predicts, in noise standard deviations: the recorded outputs one after the other, with the same lags as in a fit.
    pub(super) fn prediction(&self, model: &Model, trial: &Trial) -> Option<Vec<f64>> {
        let mut columns = self.outputs_of(model, trial)?;
        let length = trial.record.len;
        for (column, output) in columns.chunks_exact_mut(length).zip(self.outputs(&trial.record)) {
            let (noise_sd, lag) = (*self.sensors.noise_sd.get(output)?, *self.sensors.lag.get(output)?);
            column.iter_mut().for_each(|y| *y /= noise_sd);
            if lag > 0 {
                for i in (lag..length).rev() {
                    column[i] = (column[i] - column[i - lag]) * std::f64::consts::FRAC_1_SQRT_2;
                }
            }
            // The start is estimated in every recording, so a constant does not count.
            if self.problem.initial == Initial::Free {
                let mean = column.iter().sum::<f64>() / length as f64;
                column.iter_mut().for_each(|y| *y -= mean);
            }
        }
        Some(columns)
    }

    fn conditions(&self) -> Conditions<'_> {
        Conditions { starts: &[], curves: &[], substeps: self.substeps, coupling: None, budget: &self.budget }
    }

    /// What a model predicts, in the outputs' units.
    pub(super) fn outputs_of(&self, model: &Model, trial: &Trial) -> Option<Vec<f64>> {
        if self.extra.is_empty() {
            return predict_under(model, &trial.record, &self.conditions());
        }
        let mut extended = model.clone();
        let mut record = trial.record.clone();
        for kind in &self.extra {
            extended.outputs.push(output(&self.problem.model, model, kind)?);
            record.outputs.push(Some(Vec::new()));
        }
        predict_under(&extended, &record, &self.conditions())
    }

    /// Indices of the outputs that predictions have.
    pub(super) fn outputs(&self, record: &Record) -> Vec<usize> {
        let own = self.problem.model.outputs.len();
        measured(record).chain(own..own + self.extra.len()).collect()
    }
}
