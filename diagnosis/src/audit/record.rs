//! Checks of one recording: its clock, and each of its signals.

use super::remark::{Remark, Weight, add};
use super::signals::{clipped_share, is_constant, off_grid, quiet_top};
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, OutputKind};

/// Every check of one recording.
pub(super) fn record(problem: &Problem, record: &Record, all: &mut Vec<Remark>) {
    clock(record, all);
    for found in &record.outliers {
        let what = if found.count == 1 { "one sample is".to_string() } else { format!("{} samples are", found.count) };
        let done = if found.replaced { "interpolated from the neighbours" } else { "kept unchanged; check the file" };
        let text = format!(
            "{what} far from the neighbours, the first after {:.4} s by {:.0} times the signal's range: {done}",
            found.first, found.size
        );
        add(all, Weight::Caution, record, &found.signal, "outliers", text);
    }
    for (index, (input, samples)) in problem.model.inputs.iter().zip(&record.inputs).enumerate() {
        if problem.unknown.iter().any(|u| u.input == index) {
            continue;
        }
        constant(record, &input.name, samples, all);
        if let (InputKind::Motion, Some(step)) = (input.kind, crate::recordings::noise::step_of(samples)) {
            let text = format!(
                "drives the model and has a resolution of {step:.4e}: after two differentiations each step is an acceleration of {:.1e} \
                 for one sample. Its effect on the forces is counted as force noise",
                step / (record.period * record.period)
            );
            add(all, Weight::Caution, record, &input.name, "encoder", text);
        }
        if input.kind == InputKind::Force {
            clipped(record, &input.name, samples, "its source may saturate", all);
        }
    }
    for (output, samples) in problem.model.outputs.iter().zip(&record.outputs) {
        match samples {
            None => add(all, Weight::Caution, record, &output.name, "missing", "was not recorded".to_string()),
            Some(samples) => {
                constant(record, &output.name, samples, all);
                sensor(record, &output.name, output.resolution, samples, all);
                if !matches!(output.kind, OutputKind::Position(_)) {
                    clipped(record, &output.name, samples, "its sensor may saturate", all);
                }
            }
        }
    }
}

fn clock(record: &Record, all: &mut Vec<Remark>) {
    let jitter = &record.jitter;
    if record.logged.is_some() {
        let missing: usize = jitter.gaps.iter().map(|g| g.missing).sum();
        let longest = jitter.gaps.iter().map(|g| g.length).fold(0.0, f64::max);
        let gaps = match jitter.gaps.first() {
            Some(first) => format!(
                "{missing} samples seem to be missing in {} gaps of up to {:.1} ms, the first after {:.4} s",
                jitter.gaps.len(),
                1e3 * longest,
                first.after
            ),
            None => format!("samples are up to {:.1} ms off an even clock of {:.3} ms", 1e3 * jitter.largest, 1e3 * record.period),
        };
        add(all, Weight::Caution, record, "", "clock", format!("the clock is irregular: {gaps}; the simulation uses the logged times"));
    } else if !jitter.gaps.is_empty() {
        let missing: usize = jitter.gaps.iter().map(|g| g.missing).sum();
        let text = format!(
            "{missing} samples are missing in {} gaps, the first after {:.4} s; they are filled according to the input's hold",
            jitter.gaps.len(),
            jitter.gaps[0].after
        );
        add(all, Weight::Caution, record, "", "gaps", text);
    } else if jitter.largest > tuning().recordings.jitter * record.period {
        let text = format!(
            "the clock is off its grid by {:.1} % of a sample rms and {:.0} % at worst; smaller delays are not claimed",
            100.0 * jitter.rms / record.period,
            100.0 * jitter.largest / record.period
        );
        add(all, Weight::Caution, record, "", "clock", text);
    }
}

fn constant(record: &Record, name: &str, samples: &[f64], all: &mut Vec<Remark>) {
    if is_constant(samples) {
        let value = samples.first().copied().unwrap_or(0.0);
        add(all, Weight::Caution, record, name, "constant", format!("is constant at {value}: it contains no information"));
    }
}

/// Samples that stay at an extreme for longer than a smooth signal does.
fn clipped(record: &Record, name: &str, samples: &[f64], why: &str, all: &mut Vec<Remark>) {
    let (share, low, high) = clipped_share(samples);
    if share > tuning().recordings.clipped {
        let text = format!("stays at {low:.4} or {high:.4} for {:.0} % of the time: {why}", 100.0 * share);
        add(all, Weight::Note, record, name, "saturated", text);
    }
}

fn sensor(record: &Record, name: &str, stated: f64, samples: &[f64], all: &mut Vec<Remark>) {
    match crate::recordings::noise::step_of(samples) {
        Some(step) if stated > 0.0 && ((step / stated) - (step / stated).round()).abs() > tuning().recordings.grid => {
            let text = format!("has a resolution of {step:.4e}; the model states {stated:.4e}");
            add(all, Weight::Caution, record, name, "encoder", text);
        }
        Some(step) if stated == 0.0 => add(all, Weight::Note, record, name, "encoder", format!("has a resolution of {step:.4e}")),
        Some(_) => {}
        None => {
            if stated > 0.0 && off_grid(samples, stated) {
                let text = format!(
                    "is not quantised to the {stated:.4e} that the model states: it was filtered or converted before it was \
                        recorded"
                );
                add(all, Weight::Caution, record, name, "filtered", text);
            }
            if let Some(share) = quiet_top(samples)
                && share < tuning().recordings.quiet_top
            {
                let text = "has no power in the upper part of its band, not even noise: it was low-pass filtered before recording, or \
                            simulated. A delay or bandwidth found here may belong to the filter"
                    .to_string();
                add(all, Weight::Caution, record, name, "filtered", text);
            }
        }
    }
}
