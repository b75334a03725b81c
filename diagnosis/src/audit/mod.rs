//! Checks of the recordings before any fit: clock, sensors, units, closed loops, repeatability.

mod rates;
mod record;
mod remark;
mod set;
mod signals;
mod units;
mod velocities;

pub use rates::rates;
pub(crate) use remark::file_name;
pub use remark::{Remark, Weight};
pub use signals::limits_reached;
pub use velocities::without_contradicted;

use crate::recordings::problem::{Problem, Record};
use backdrive_plant::model::InputKind;
use backdrive_plant::set::Initial;
use remark::merged;
use signals::is_constant;

/// Checks every recording of a problem, those held out included. Nothing is fitted. The weightiest remarks come first; a remark that holds for several
/// recordings is made once.
pub fn audit(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    for one in problem.fit.iter().chain(&problem.held_out) {
        record::record(problem, one, &mut all);
    }
    set::closed_loop(problem, &mut all);
    let mut all = merged(all, problem.fit.len() + problem.held_out.len());
    all.extend(problem.left_out.iter().map(short));
    all.extend(set::repeats(problem));
    all.extend(units::remarks(problem));
    all.extend(set::noises(problem));
    all.sort_by_key(|r| std::cmp::Reverse(r.weight));
    all
}

/// A recording that was left out.
fn short((name, count): &(String, usize)) -> Remark {
    let fewest = crate::tuning::tuning().recordings.fewest_samples;
    let text = format!("has {count} samples and was left out: a recording needs at least {fewest}");
    Remark { weight: Weight::Caution, records: vec![file_name(name).to_string()], signal: String::new(), about: "short", text }
}

/// Whether there is anything to fit. If there is not, a sentence states the cause and what to do.
///
/// # Errors
/// When nothing drives the device, nothing that was measured moves, or a unit, that of time among them, is off by so much that no fit can be meant.
pub fn usable(problem: &Problem) -> Result<(), String> {
    let model = &problem.model;
    let file = |r: &Record| file_name(&r.name).to_string();
    let first = problem.fit.first().map_or(String::new(), file);
    let still = |input: usize| {
        let force = model.inputs.get(input).is_some_and(|i| i.kind == InputKind::Force);
        let quiet = |samples: &Vec<f64>| is_constant(samples) && (!force || samples.first().is_none_or(|x| *x == 0.0));
        problem.fit.iter().all(|r| r.inputs.get(input).is_none_or(quiet))
    };
    if problem.initial == Initial::Rest && !model.inputs.is_empty() && (0..model.inputs.len()).all(still) {
        let names: Vec<&str> = model.inputs.iter().map(|i| i.name.as_str()).collect();
        let them = names.join(", ");
        return Err(format!("{first}: nothing drives the device: {them} is constant in every recording; record an excitation"));
    }
    let moves =
        |output: usize| problem.fit.iter().any(|r| r.outputs.get(output).is_some_and(|o| o.as_deref().is_some_and(|s| !is_constant(s))));
    if !(0..model.outputs.len()).any(moves) {
        let names: Vec<&str> = model.outputs.iter().map(|o| o.name.as_str()).collect();
        let them = names.join(", ");
        return Err(format!("{first}: {them} is constant in every recording: the sensor is dead, or the wrong column is named"));
    }
    if let Some(text) = rates::unit_of_time(problem) {
        return Err(text);
    }
    if let Some(wrong) = velocities::contradictions(problem).into_iter().find(|wrong| wrong.is_both) {
        let signal = &model.outputs[wrong.output].name;
        return Err(format!("{}: {signal} {}", wrong.file, wrong.text));
    }
    match units::remarks(problem).into_iter().find(|r| r.weight == Weight::Unusable) {
        Some(remark) => Err(format!("{first}: {remark}")),
        None => Ok(()),
    }
}
