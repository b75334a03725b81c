//! The experiment that determines parameters which the recordings leave open.

use super::planner::Planner;
use super::rivals::Rival;
use super::types::{Experiment, Reason};
use super::words::{described, short};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::Budget;
use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use backdrive_signal::statistics::rms;

/// The excitation that determines parameters of a structure which the recordings do not determine. `numbers` are places among [`Structure::free`], `before`
/// the reported standard deviation of each parameter, in the fit's own unit. It is wider than that of the sensors' noise alone where residuals are
/// correlated or models differ; an experiment is assumed to reduce it by the same factor. What exceeds the budget is not tried.
///
/// # Errors
/// States why when no excitation would determine them.
pub fn excite<'a>(
    problem: &'a Problem,
    structure: &Structure,
    values: &[f64],
    numbers: &[usize],
    before: &[f64],
    noise_sd: &[f64],
    budget: &Budget<'a>,
) -> Result<Experiment, Reason> {
    let numbers: Vec<usize> = numbers.iter().copied().filter(|j| structure.free.get(*j).is_some_and(|n| n.records.is_none())).collect();
    if numbers.is_empty() || values.len() != structure.free.len() || before.len() != values.len() {
        return Err(Reason("there is no parameter to determine".to_string()));
    }
    let model = structure.model(problem, values).ok_or_else(|| Reason("the model cannot be simulated".to_string()))?;
    let planner = Planner::new(problem, noise_sd, budget)?;
    let mut evaluator = Evaluator::new(problem);
    (evaluator.noise_sd, evaluator.substeps) = (planner.setup.sensors.noise_sd.clone(), tuning().experiment.substeps[0]);
    let own: Vec<f64> = structure.free.iter().zip(values).map(|(n, v)| n.to_internal(*v)).collect();
    let residuals = evaluator.residuals(structure, values).ok_or_else(|| Reason("the model diverges on the recordings".to_string()))?;
    let known = Rival::with(structure, values, &evaluator.jacobian(structure, &own, &residuals), 1.0);
    // The reported standard deviation, divided by the one caused by the sensors' noise alone.
    let ratio = |(own, before): (&f64, &f64)| Some(before / own).filter(|ratio| ratio.is_finite() && *ratio > 0.0).unwrap_or(1.0);
    let wider: Vec<f64> = known.deviations(None).iter().zip(before).map(ratio).collect();
    let whole = |j: usize| if structure.free[j].log { 1.0 } else { own[j].abs() };
    let numbers: Vec<usize> = numbers.into_iter().filter(|j| before[*j] > tuning().experiment.open * whole(*j)).collect();
    if numbers.is_empty() {
        return Err(Reason(format!(
            "the recordings determine all these parameters with a standard deviation of {} % or less",
            short(100.0 * tuning().experiment.open)
        )));
    }
    let cases = planner.cases(std::slice::from_ref(&known));
    // What a standard deviation is compared with: the parameter itself, or its standard deviation from the recordings where that is smaller.
    let size = |j: usize| if whole(j) > 0.0 { whole(j).min(before[j]) } else { before[j] };
    let places: Vec<usize> = (0..cases.len()).collect();
    let determined = planner.setup.budget.abreast(&places, |budget, s| {
        let case = &cases[*s];
        let jacobian = known.jacobian(&planner.setup.within(budget), &case.trial, &known.own, &case.predictions[0]);
        let after: Vec<f64> = known.deviations(Some(&jacobian)).iter().zip(&wider).map(|(after, wider)| after * wider).collect();
        let worst = numbers.iter().map(|j| size(*j) / after[*j]).fold(f64::INFINITY, f64::min);
        (*s, worst, after)
    });
    let gains: Vec<(usize, f64, Vec<f64>)> = determined.into_iter().flatten().filter(|g| g.1.is_finite()).collect();
    let rate = |g: &(usize, f64, Vec<f64>)| g.1 * g.1 / (cases[g.0].trial.seconds() + tuning().experiment.setting_up);
    let best = gains.iter().max_by(|a, b| rate(a).total_cmp(&rate(b)));
    let names: Vec<String> = numbers.iter().map(|j| name_of(problem, structure, *j)).collect();
    let least = tuning().experiment.wanted / f64::from(tuning().experiment.most_repeats as u32).sqrt();
    let Some((case, separation, after)) = best.filter(|g| g.1 >= least) else {
        let list = names.join(", ");
        return Err(Reason(format!(
            "no excitation within the range of the recordings determines {list}: use larger amplitudes, another sensor or another input"
        )));
    };
    let case = &cases[*case];
    let accuracy = numbers.iter().map(|j| {
        let number = &structure.free[*j];
        let percent = 100.0 * if number.log { after[*j] } else { after[*j] / values[*j].abs().max(f64::MIN_POSITIVE) };
        if values[*j] == 0.0 {
            format!("{} to {}", name_of(problem, structure, *j), short(after[*j]))
        } else {
            format!("{} to {} %", name_of(problem, structure, *j), short(percent))
        }
    });
    let sentence = format!(
        "Play {}: it determines {}, which the recordings do not determine.",
        described(&model, &case.trial),
        accuracy.collect::<Vec<_>>().join(", ")
    );
    let jacobian = known.jacobian(&planner.setup, &case.trial, &known.own, &case.predictions[0]);
    let change: Vec<f64> = jacobian.get(numbers[0]).map(|c| c.iter().map(|x| x * after[numbers[0]]).collect()).unwrap_or_default();
    Ok(planner.experiment(case, sentence, names, *separation, &change, rms(&change)))
}

/// The name of a parameter.
fn name_of(problem: &Problem, structure: &Structure, number: usize) -> String {
    match structure.free.get(number).map(|n| &n.role) {
        Some(Role::Stated(i)) => problem.stated.get(*i).map_or_else(String::new, |s| s.path.clone()),
        Some(Role::Added(h, p)) => {
            let hypothesis = structure.added.get(*h);
            let key = hypothesis.and_then(|h| h.parameters.get(*p)).map_or("", |p| p.key.as_str());
            format!("{key} of {}", hypothesis.map_or("", |h| h.id.as_str()))
        }
        _ => String::new(),
    }
}
