//! Fitted structures on an experiment that was not made yet: what each predicts, and how far one can imitate another.

use super::extra_output::output;
use super::menu::{Play, Stand, constant, scaled};
use crate::effort::Effort;
use crate::fit::{Evaluator, Fit, dot, measured};
use crate::normal_equations::normal_equations;
use crate::problem::{Problem, Record};
use crate::simulate::{Conditions, predict_under};
use crate::statistics::correlation_time;
use crate::structure::{Number, Structure};
use crate::work::Budget;
use backdrive_plant::excitation::Excitation;
use backdrive_plant::model::{Model, OutputKind};
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// What is measured: how well, and what is compared. One for each output of the models that are simulated.
#[derive(Debug, Clone)]
pub(super) struct Sensors {
    /// Standard deviation of each output's measuring error, in its unit.
    pub floor: Vec<f64>,
    /// As [`Problem::lag`].
    pub lag: Vec<usize>,
    /// Which outputs are recorded.
    pub there: Vec<bool>,
}

impl Sensors {
    /// The outputs that some recording of the problem has.
    pub(super) fn of(problem: &Problem, floor: &[f64]) -> Sensors {
        let there = |o: usize| problem.fit.iter().any(|r| r.outputs.get(o).is_some_and(Option::is_some));
        let count = problem.model.outputs.len();
        // An output without a floor says nothing.
        let floor = (0..count).map(|o| floor.get(o).copied().filter(|f| *f > 0.0).unwrap_or(f64::INFINITY)).collect();
        Sensors { floor, lag: problem.lag.clone(), there: (0..count).map(there).collect() }
    }
}

/// A fitted structure.
pub(super) struct Rival<'a> {
    pub structure: &'a Structure,
    /// Its numbers, in the fit's own unit.
    pub own: Vec<f64>,
    /// What the recordings know of them: the curvature of half the cost, squared floors.
    information: DMatrix<f64>,
    /// What one squared floor of cost is worth, at least 1: what is left over and hangs together counts less.
    pub unit: f64,
}

impl<'a> Rival<'a> {
    /// From where a fit ended.
    pub(super) fn of(problem: &Problem, structure: &'a Structure, fit: &Fit) -> Rival<'a> {
        let count = fit.residuals.len().max(1) as f64;
        let level = fit.residuals.iter().map(|r| r * r).sum::<f64>() / count;
        let unit = level.max(1.0) * correlation_time(&Evaluator::new(problem), &fit.residuals);
        Rival::with(structure, &fit.values, &fit.jacobian, unit)
    }

    /// From values and the derivatives of the recordings' residuals.
    pub(super) fn with(structure: &'a Structure, values: &[f64], jacobian: &[Vec<f64>], unit: f64) -> Rival<'a> {
        let numbers = &structure.numbers;
        let mut information = match jacobian.len() == numbers.len() && !numbers.is_empty() {
            true => normal_equations(jacobian, &vec![0.0; jacobian[0].len()], None).0,
            false => DMatrix::zeros(numbers.len(), numbers.len()),
        };
        for (j, number) in numbers.iter().enumerate() {
            let (low, high) = number.bounds();
            // What nothing holds is somewhere in its range.
            let spread = number.prior.map_or(high - low, |(_, spread)| spread.min(high - low));
            information[(j, j)] += 1.0 / (spread * spread).max(f64::MIN_POSITIVE);
        }
        let own = numbers.iter().zip(values).map(|(n, v)| n.inward(*v)).collect();
        Rival { structure, own, information, unit: if unit.is_finite() { unit.max(1.0) } else { 1.0 } }
    }

    fn model(&self, problem: &Problem, own: &[f64]) -> Option<Model> {
        let values: Vec<f64> = self.structure.numbers.iter().zip(own).map(|(n, x)| n.outward(*x)).collect();
        self.structure.model(problem, &values)
    }

    /// Its model.
    pub(super) fn as_fitted(&self, problem: &Problem) -> Option<Model> {
        self.model(problem, &self.own)
    }

    /// What it predicts, in floors.
    pub(super) fn prediction(&self, scene: &Scene, trial: &Trial) -> Option<Vec<f64>> {
        scene.prediction(&self.as_fitted(scene.problem)?, trial)
    }

    /// Derivatives of what it predicts, by each number in its own unit; all 0 for what belongs to a recording.
    pub(super) fn jacobian(&self, scene: &Scene, trial: &Trial, own: &[f64], at: &[f64]) -> Vec<Vec<f64>> {
        let column = |(j, number): (usize, &Number)| {
            let none = || vec![0.0; at.len()];
            if number.records.is_some() {
                return none();
            }
            let (low, high) = number.bounds();
            let mut moved = own.to_vec();
            moved[j] = if own[j] + number.step > high { own[j] - number.step } else { own[j] + number.step }.clamp(low, high);
            let step = moved[j] - own[j];
            let there = self.model(scene.problem, &moved).and_then(|model| scene.prediction(&model, trial));
            match there.filter(|_| step != 0.0) {
                Some(mut there) => {
                    there.iter_mut().zip(at).for_each(|(a, b)| *a = (*a - b) / step);
                    there
                }
                None => none(),
            }
        };
        self.structure.numbers.par_iter().enumerate().map(column).collect()
    }

    /// What is left of a difference d when the numbers may move as far as the recordings let them, were the structure linear in them,
    /// squared floors: with derivatives J there and the recordings' information M, the least over s of |d - J s|² + s' M s.
    pub(super) fn remainder(&self, jacobian: &[Vec<f64>], difference: &[f64]) -> f64 {
        let whole = dot(difference, difference);
        let (mut matrix, right) = normal_equations(jacobian, difference, None);
        matrix += &self.information;
        let scale: Vec<f64> = (0..right.len()).map(|j| matrix[(j, j)].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled =
            DMatrix::from_fn(right.len(), right.len(), |a, b| matrix[(a, b)] / (scale[a] * scale[b]) + if a == b { 1e-12 } else { 0.0 });
        let short = DVector::from_fn(right.len(), |j, _| right[j] / scale[j]);
        // Without a factor nothing is claimed.
        scaled.cholesky().map_or(0.0, |c| (whole - short.dot(&c.solve(&short))).clamp(0.0, whole))
    }

    /// The same by a true refit to the recordings and to what `other` predicts for the experiment: what the cost then is above its own
    /// on the recordings alone, squared floors.
    pub(super) fn refit(&self, scene: &Scene, trial: &Trial, other: &Rival) -> Option<f64> {
        let columns = scene.raw(&other.as_fitted(scene.problem)?, trial)?;
        let mut record = trial.record.clone();
        for (column, output) in columns.chunks_exact(record.len).zip(scene.outputs(&trial.record)) {
            *record.outputs.get_mut(output)? = Some(column.to_vec());
        }
        let mut wider = scene.problem.clone();
        wider.fit.push(record);
        let mut evaluator = Evaluator::new(&wider);
        (evaluator.floor, evaluator.substeps, evaluator.budget) = (scene.sensors.floor.clone(), scene.substeps, scene.budget.clone());
        let values: Vec<f64> = self.structure.numbers.iter().zip(&self.own).map(|(n, x)| n.outward(*x)).collect();
        let fit = evaluator.fit(self.structure, &values, Effort { steps: 20, tolerance: 1.0 })?;
        evaluator.records = &scene.problem.fit;
        let before = evaluator.cost(&evaluator.residuals(self.structure, &values)?);
        let pulled = |(n, x): (&Number, &f64)| n.prior.map_or(0.0, |(centre, spread)| ((x - centre) / spread).powi(2));
        let priors: f64 = self.structure.numbers.iter().zip(&self.own).map(pulled).sum();
        Some((fit.cost - before - priors).max(0.0))
    }

    /// Standard deviations of its numbers in their own unit, with the derivatives of an experiment or without.
    pub(super) fn deviations(&self, jacobian: Option<&[Vec<f64>]>) -> Vec<f64> {
        let mut matrix = self.information.clone();
        if let Some(jacobian) = jacobian.filter(|j| j.len() == self.own.len() && !j.is_empty()) {
            matrix += normal_equations(jacobian, &vec![0.0; jacobian[0].len()], None).0;
        }
        let scale: Vec<f64> = (0..self.own.len()).map(|j| matrix[(j, j)].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled =
            DMatrix::from_fn(scale.len(), scale.len(), |a, b| matrix[(a, b)] / (scale[a] * scale[b]) + if a == b { 1e-12 } else { 0.0 });
        let inverse = scaled.cholesky().map(|c| c.inverse());
        let one = |j: usize| inverse.as_ref().map_or(f64::INFINITY, |i| (i[(j, j)] * self.unit).sqrt() / scale[j]);
        (0..scale.len()).map(one).collect()
    }
}

/// Where experiments are played in thought: a problem, what is measured, and how finely is stepped.
#[derive(Clone)]
pub(super) struct Scene<'a> {
    pub problem: &'a Problem,
    pub sensors: Sensors,
    /// Outputs that the model files do not have, put behind theirs. By the nominal model's places and names.
    pub extra: Vec<OutputKind>,
    /// Substeps per sample, at most.
    pub substeps: usize,
    /// Counts what is computed, and ends refits and searches.
    pub budget: Budget<'a>,
}

/// An excitation as a recording without outputs.
pub(super) struct Trial {
    pub play: Play,
    /// What other inputs keep.
    pub others: Vec<(usize, Excitation)>,
    pub record: Record,
}

impl<'a> Scene<'a> {
    /// The same, counted by another budget.
    pub(super) fn within(&self, budget: &Budget<'a>) -> Scene<'a> {
        Scene { budget: budget.clone(), ..self.clone() }
    }

    /// An excitation as a recording, made smaller until it stays within what the input was shown to stand.
    pub(super) fn trial(&self, play: &Play, stands: &[Option<Stand>], rate_hz: f64) -> Option<Trial> {
        let stand = stands.get(play.input)?.as_ref()?;
        let period = 1.0 / rate_hz;
        let samples = play.excitation.samples(rate_hz).ok()?;
        let centred: Vec<f64> = samples.iter().map(|u| u - stand.mean).collect();
        let away = if stand.mean == 0.0 { &samples } else { &centred };
        let share = stand.share(away, period, play.lasting);
        let excitation = if share < 1.0 { scaled(&play.excitation, 0.995 * share) } else { play.excitation.clone() };
        self.trial_of(Play { excitation, ..play.clone() }, stands, rate_hz)
    }

    fn trial_of(&self, play: Play, stands: &[Option<Stand>], rate_hz: f64) -> Option<Trial> {
        let model = &self.problem.model;
        let samples = play.excitation.samples(rate_hz).ok()?;
        let (count, period) = (samples.len(), 1.0 / rate_hz);
        let mut others = Vec::new();
        let mut signals: Vec<(String, Vec<f64>)> = Vec::new();
        for (i, input) in model.inputs.iter().enumerate() {
            let kept = stands.get(i).copied().flatten().map_or(0.0, |s| s.mean);
            let mut column = vec![0.0; count];
            if i == play.input {
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
        Some(Trial { play, others, record })
    }

    /// The same experiment with its amplitude multiplied.
    pub(super) fn smaller(&self, trial: &Trial, factor: f64, stands: &[Option<Stand>], rate_hz: f64) -> Option<Trial> {
        let excitation = scaled(&trial.play.excitation, factor);
        self.trial_of(Play { excitation, ..trial.play.clone() }, stands, rate_hz)
    }

    /// What a model predicts, in floors, the recorded outputs one after the other; the same differences as a fit compares.
    fn prediction(&self, model: &Model, trial: &Trial) -> Option<Vec<f64>> {
        let mut columns = self.raw(model, trial)?;
        let length = trial.record.len;
        for (column, output) in columns.chunks_exact_mut(length).zip(self.outputs(&trial.record)) {
            let (floor, lag) = (*self.sensors.floor.get(output)?, *self.sensors.lag.get(output)?);
            column.iter_mut().for_each(|y| *y /= floor);
            if lag > 0 {
                for i in (lag..length).rev() {
                    column[i] = (column[i] - column[i - lag]) * std::f64::consts::FRAC_1_SQRT_2;
                }
            }
            // Where a device starts is not known as a rule, and moves the whole of a position.
            if self.problem.initial == Initial::Free {
                let mean = column.iter().sum::<f64>() / length as f64;
                column.iter_mut().for_each(|y| *y -= mean);
            }
        }
        Some(columns)
    }

    fn conditions(&self) -> Conditions<'_> {
        Conditions { starts: &[], curves: &[], substeps: self.substeps, guide: None, budget: &self.budget }
    }

    /// What a model predicts, in the outputs' units.
    fn raw(&self, model: &Model, trial: &Trial) -> Option<Vec<f64>> {
        if self.extra.is_empty() {
            return predict_under(model, &trial.record, &self.conditions());
        }
        let mut seen = model.clone();
        let mut record = trial.record.clone();
        for kind in &self.extra {
            seen.outputs.push(output(&self.problem.model, model, kind)?);
            record.outputs.push(Some(Vec::new()));
        }
        predict_under(&seen, &record, &self.conditions())
    }

    /// Indices of the outputs that predictions have.
    pub(super) fn outputs(&self, record: &Record) -> Vec<usize> {
        let own = self.problem.model.outputs.len();
        measured(record).chain(own..own + self.extra.len()).collect()
    }

    /// How far beyond what was recorded a rival's positions and speeds go: the largest ratio of peaks, 0 where there is nothing to compare.
    pub(super) fn excursion(&self, rival: &Rival, trial: &Trial) -> Option<f64> {
        let columns = self.raw(&rival.as_fitted(self.problem)?, trial)?;
        let mut worst = 0.0f64;
        for (column, output) in columns.chunks_exact(trial.record.len).zip(self.outputs(&trial.record)) {
            let kind = &self.problem.model.outputs.get(output)?.kind;
            if !matches!(kind, OutputKind::Position(_) | OutputKind::Velocity(_)) {
                continue;
            }
            let recorded = self.problem.fit.iter().chain(&self.problem.held_out).filter_map(|r| r.outputs.get(output)?.as_deref());
            let shown = recorded.map(|y| y.iter().fold(0.0f64, |a, x| a.max((x - y.first().unwrap_or(&0.0)).abs()))).fold(0.0, f64::max);
            let reached = column.iter().fold(0.0f64, |a, x| a.max((x - column.first().unwrap_or(&0.0)).abs()));
            if shown > 0.0 {
                worst = worst.max(reached / shown);
            }
        }
        Some(worst)
    }
}
