//! How an input runs between its samples, where the model file does not say: what that assumption is worth, and what the recordings say of it.
//!
//! A force is taken as held, as a servo does. A measured force runs on between its samples, and is early by half a sample where it is modelled as held.
//! Nothing in a device is early, so a lead of exactly that size can be distinguished from an effect.

use crate::belief::statistics::levels;
use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::dot;
use crate::recordings::problem::{Problem, Record};
use crate::search::screen::Projector;
use crate::tuning::tuning;
use backdrive_plant::model::{Hold, InputKind};
use backdrive_plant::stepper::segments;

/// Force inputs of which the model file does not say how they run between samples, and that are held by default.
pub fn assumed(problem: &Problem) -> Vec<usize> {
    let Ok(document) = problem.text.parse::<toml_edit::DocumentMut>() else { return Vec::new() };
    let tables = document.get("inputs").and_then(|item| item.as_array_of_tables());
    let stated = |name: &str| {
        tables.is_some_and(|all| all.iter().any(|t| t.get("name").and_then(|n| n.as_str()) == Some(name) && t.contains_key("hold")))
    };
    let logged = problem.fit.iter().any(|r| r.logged.is_some());
    let is_assumed = |(index, input): (usize, &backdrive_plant::model::Input)| {
        let held = input.kind == InputKind::Force && input.hold == Hold::Zero;
        (held && !logged && !stated(&input.name) && problem.unknown.iter().all(|u| u.input != index)).then_some(index)
    };
    problem.model.inputs.iter().enumerate().filter_map(is_assumed).collect()
}

/// The same problem with these inputs as straight lines between their samples, in the model's text too: what is written of it simulates as this one does.
pub fn linear(problem: &Problem, inputs: &[usize]) -> Problem {
    let mut other = problem.clone();
    let is_one = |name: Option<&str>| inputs.iter().any(|i| problem.model.inputs.get(*i).map(|input| input.name.as_str()) == name);
    if let Ok(mut document) = problem.text.parse::<toml_edit::DocumentMut>()
        && let Some(tables) = document.get_mut("inputs").and_then(|item| item.as_array_of_tables_mut())
    {
        for table in tables.iter_mut().filter(|t| is_one(t.get("name").and_then(|n| n.as_str()))) {
            table.insert("hold", toml_edit::value("linear"));
        }
        other.text = document.to_string();
    }
    for input in inputs {
        if let Some(input) = other.model.inputs.get_mut(*input) {
            input.hold = Hold::Linear;
        }
    }
    let change = |record: &mut Record| {
        for input in inputs {
            let drawn = record.inputs.get(*input).map(|samples| segments(Hold::Linear, samples, record.period));
            if let (Some(slot), Some(drawn)) = (record.segments.get_mut(*input), drawn) {
                *slot = drawn;
            }
        }
    };
    other.fit.iter_mut().chain(&mut other.held_out).for_each(change);
    other
}

/// The evidence on an input that is assumed to be held between samples.
#[derive(Debug, Clone)]
pub struct HoldEvidence {
    /// The input.
    pub input: usize,
    /// What a straight line between samples changes at each output, root mean square in noise standard deviations.
    pub changes: Vec<f64>,
    /// How much of that change the residual of a model asks for: 0 where it is held, 1 where it runs on.
    pub share: f64,
    /// Standard deviation of that share; infinite where the parameters of the model can do the same.
    pub deviation: f64,
}

impl HoldEvidence {
    /// Whether the recordings show that it is linear between samples.
    pub fn runs_on(&self) -> bool {
        let claim = &tuning().claim;
        self.share > claim.runs_on * self.deviation && (self.share - 1.0).abs() < 0.5 && self.changes.iter().any(|c| *c > claim.useful)
    }

    /// What is not known of it, at each output, noise standard deviations: all of the change where the recordings cannot tell.
    pub fn unknown(&self) -> Vec<f64> {
        self.changes.iter().map(|change| change * self.deviation.min(1.0)).collect()
    }
}

/// The evidence of a fitted structure's residual on each input that is assumed to be held.
pub fn evidence(evaluator: &Evaluator, fitted: &Candidate) -> Vec<HoldEvidence> {
    let problem = evaluator.problem;
    let fit = &fitted.fit;
    let stride = fit.residuals.len().div_ceil(tuning().screening.residuals).max(1);
    let one = |input: usize| {
        let other = linear(problem, &[input]);
        let there = Evaluator { problem: &other, records: &other.fit, ..evaluator.clone() };
        let run_on = there.residuals(&fitted.structure, &fit.values)?;
        let change: Vec<f64> = run_on.iter().zip(&fit.residuals).map(|(a, b)| a - b).collect();
        let changes = levels(evaluator, &change);
        let projector = Projector::new(&fit.jacobian, stride);
        let every = |all: &[f64]| all.iter().step_by(stride).copied().collect::<Vec<f64>>();
        let (mut column, mut left) = (every(&change), every(&fit.residuals));
        projector.apply(&mut column);
        projector.apply(&mut left);
        let size = dot(&column, &column);
        let share = if size > 0.0 { -dot(&column, &left) / size } else { 0.0 };
        // Neighbouring residuals are correlated, so each counts for less than one; the residual of the model counts as noise.
        let unit = (dot(&left, &left) / left.len().max(1) as f64).max(1.0) * fitted.correlation_time;
        let deviation = if size > 0.0 { (unit / (size * stride as f64)).sqrt() } else { f64::INFINITY };
        Some(HoldEvidence { input, changes, share, deviation })
    };
    assumed(problem).into_iter().filter_map(one).collect()
}
