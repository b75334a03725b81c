//! Checks that take more than one recording: noise of each output, how well the device repeats itself, whether a controller closes the loop.

use super::remark::{Remark, Weight, add, file_name};
use super::signals::answers;
use crate::recordings::problem::Problem;
use crate::recordings::repeatability::{self, Repeat};
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, OutputKind};

/// Noise standard deviation of each output.
pub(super) fn noises(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    for (index, (output, noise_sd)) in problem.model.outputs.iter().zip(&problem.noise_sd).enumerate() {
        let spreads: Vec<f64> = problem.fit.iter().filter(|r| r.outputs[index].is_some()).map(|r| r.spread[index]).collect();
        if spreads.is_empty() {
            continue;
        }
        let spread = spreads.iter().sum::<f64>() / spreads.len() as f64;
        let text = format!("its sensor noise is {noise_sd:.2e}, {:.3} % of its range of motion", 100.0 * noise_sd / spread);
        let weight = if noise_sd / spread > tuning().recordings.noisy { Weight::Caution } else { Weight::Note };
        all.push(Remark { weight, records: Vec::new(), signal: output.name.clone(), about: "noise", text });
    }
    all
}

/// Recordings of the same excitation, and periods of a periodic one: how well the device repeats itself.
pub(super) fn repeats(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    for Repeat { record, of, output, apart, period } in repeatability::repeats(problem) {
        let (Some(own), Some(other), Some(name)) = (problem.fit.get(record), problem.fit.get(of), problem.model.outputs.get(output)) else {
            continue;
        };
        let times = apart / problem.noise_sd[output];
        let what = match period {
            Some(length) => format!("its periods of {length:.3} s"),
            None => file_name(&other.name).to_string(),
        };
        let (text, weight) = if times > tuning().recordings.repeats {
            (
                format!("repeats {what} only to within {apart:.2e}, {times:.1} times its noise: no model can predict it better"),
                Weight::Caution,
            )
        } else {
            (format!("repeats {what} to within its noise"), Weight::Note)
        };
        add(&mut all, weight, own, &name.name, "repeats", text);
    }
    all
}

/// Whether a force is fed back from an output: the noise of the output then shows in the force one sample later.
pub(super) fn closed_loop(problem: &Problem, all: &mut Vec<Remark>) {
    for record in &problem.fit {
        for (input, u) in problem.model.inputs.iter().zip(&record.inputs).filter(|(i, _)| i.kind == InputKind::Force) {
            for (output, y) in problem.model.outputs.iter().zip(&record.outputs) {
                let Some(y) = y else { continue };
                if !matches!(output.kind, OutputKind::Position(_) | OutputKind::Velocity(_)) {
                    continue;
                }
                let found = answers(u, y);
                if found > tuning().recordings.closed_loop {
                    let text = format!(
                        "follows the noise of {} (correlation {found:.2}): a controller closes the loop and hides the disturbances that \
                            it rejects",
                        output.name
                    );
                    add(all, Weight::Note, record, &input.name, "loop", text);
                }
            }
        }
    }
}
