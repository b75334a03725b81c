//! Recordings of very many samples, thinned before a search as far as the device allows. Outputs keep every n-th sample, unchanged. A held force becomes
//! the straight line of the same impulse and moment over all samples between. What is still too many is cut at the end of each recording.

use crate::audit::{Remark, Weight};
use crate::output_error::simulate::predict;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::model::{Hold, Model};
use backdrive_plant::stepper::{Segment, segments};

/// The problem with as many samples as a search needs, and what was done to it; unchanged where it has no more.
pub fn thinned(problem: Problem) -> (Problem, Option<Remark>) {
    let most = tuning().recordings.most_samples;
    let total = samples_of(&problem.fit);
    if total <= most {
        return (problem, None);
    }
    let mut every = total.div_ceil(most);
    let mut changes = change(&problem, every);
    while every > 1 && changes > tuning().recordings.thinned_error {
        every = (every * 2 / 3).max(1);
        changes = change(&problem, every);
    }
    let lag = problem.lag.iter().map(|lag| if *lag > 0 { (lag / every).max(1) } else { 0 }).collect();
    let taken = |records: &[Record], most: usize| {
        let thin: Vec<Record> = records.iter().map(|r| one_in(&problem.model, r, every)).collect();
        let share = most as f64 / samples_of(&thin).max(1) as f64;
        let first = |r: &Record| match share < 1.0 && r.logged.is_none() {
            true => r.part(
                0..((r.len as f64 * share) as usize).clamp(tuning().recordings.fewest_samples.min(r.len), r.len),
                r.begins.clone(),
                r.skip,
            ),
            false => r.clone(),
        };
        (thin.iter().map(first).collect::<Vec<_>>(), share)
    };
    let (fit, share) = taken(&problem.fit, most);
    let (held_out, _) = taken(&problem.held_out, most);
    let mut text = format!("hold {total} samples, of which {} are fitted", samples_of(&fit));
    if every > 1 {
        let how = format!(
            "every {every}th sample is used, with linear forces between, which changes a prediction by {changes:.2} noise \
                standard deviations"
        );
        text = format!("{text}: {how}");
    }
    if share < 1.0 {
        let why = if every > 1 { "and fewer" } else { "fewer" };
        text = format!("{text}; {why} would change predictions, so of each recording the first {:.0} % are used", 100.0 * share);
    }
    let remark = Remark { weight: Weight::Note, records: Vec::new(), signal: String::new(), about: "thinned", text };
    (Problem { fit, held_out, lag, ..problem }, Some(remark))
}

fn samples_of(records: &[Record]) -> usize {
    records.iter().map(|r| r.len).sum()
}

/// Change of the prediction of the model as given when only every n-th sample is taken: root mean square in noise standard deviations, on the beginnings of
/// the longest recordings. Infinite where it cannot be computed.
fn change(problem: &Problem, every: usize) -> f64 {
    if every <= 1 {
        return 0.0;
    }
    let mut longest: Vec<&Record> = problem.fit.iter().filter(|r| r.logged.is_none()).collect();
    longest.sort_by_key(|r| std::cmp::Reverse(r.len));
    let (mut sum, mut count) = (0.0, 0);
    for record in longest.into_iter().take(2) {
        let part = record.part(0..record.len.min(tuning().recordings.probe), record.begins.clone(), record.skip);
        let thin = one_in(&problem.model, &part, every);
        let substeps = tuning().fit.fine_substeps;
        let (Some(all), Some(few)) = (predict(&problem.model, &part, substeps), predict(&problem.model, &thin, substeps)) else {
            return f64::INFINITY;
        };
        let measured = (0..problem.model.outputs.len()).filter(|o| part.outputs.get(*o).is_some_and(Option::is_some));
        for ((all, few), output) in all.chunks_exact(part.len).zip(few.chunks_exact(thin.len)).zip(measured) {
            let noise = problem.noise_sd.get(output).copied().unwrap_or(1.0);
            sum += all.iter().step_by(every).zip(few).map(|(a, b)| (a - b) * (a - b) / (noise * noise)).sum::<f64>();
            count += few.len();
        }
    }
    if count > 0 { (sum / count as f64).sqrt() } else { f64::INFINITY }
}

/// Every n-th sample of a recording, as a recording of that period; one of an irregular clock is unchanged.
fn one_in(model: &Model, record: &Record, every: usize) -> Record {
    if every <= 1 || record.logged.is_some() {
        return record.clone();
    }
    let period = record.period * every as f64;
    let picked = |samples: &Vec<f64>| samples.iter().step_by(every).copied().collect::<Vec<f64>>();
    let line = |samples: &[f64]| {
        let count = samples.len().max(1) as f64;
        let mean = samples.iter().sum::<f64>() / count;
        let moment: f64 = samples.iter().enumerate().map(|(i, u)| (i as f64 + 0.5 - 0.5 * count) * u).sum();
        // Over `count` steps of length 1: the slope of the same moment is 12 M / count³.
        let slope = 12.0 * moment / (count * count * count) / record.period;
        Segment { c: [mean - 0.5 * slope * count * record.period, slope, 0.0, 0.0] }
    };
    let driven = model.inputs.iter().zip(&record.inputs).map(|(input, samples)| match input.hold {
        Hold::Zero => {
            let lines: Vec<Segment> = samples.chunks(every).map(line).collect();
            (lines.iter().map(|s| s.value(0.5 * period)).collect::<Vec<f64>>(), lines)
        }
        hold => {
            let samples = picked(samples);
            let pieces = segments(hold, &samples, period);
            (samples, pieces)
        }
    });
    let (inputs, segments): (Vec<Vec<f64>>, Vec<Vec<Segment>>) = driven.unzip();
    Record {
        period,
        len: record.len.div_ceil(every),
        inputs,
        segments,
        outputs: record.outputs.iter().map(|o| o.as_ref().map(picked)).collect(),
        skip: record.skip / every,
        before: record.before / every,
        ..record.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_plant::recording::Recording;
    use backdrive_plant::set::Initial;
    use std::path::PathBuf;

    const MODEL: &str = "name = 'cart'\n[bodies]\ncart = 2.0\n[[elements]]\nname = 's'\nkind = 'spring'\nbetween = ['cart', 'ground']\nstiffness = 200.0\n\
                         [[elements]]\nname = 'd'\nkind = 'damper'\nbetween = ['cart', 'ground']\ndamping = 4.0\n\
                         [[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\nhold = 'zero'\n[[outputs]]\nname = 'x'\nkind = 'position'\nof = 'cart'\n";

    /// The same with a resonance near a seventh of the sampling rate.
    fn stiff() -> String {
        MODEL.replace("200.0", "1.8e6").replace("4.0", "200.0")
    }

    /// The device driven for so many samples by a force whose frequency is this share of the sampling rate, with noise of this size.
    fn problem(text: &str, samples: usize, frequency: f64, noise: f64) -> Problem {
        let model = Model::from_toml(text, "cart.toml").unwrap();
        let period = 1e-3;
        let t: Vec<f64> = (0..samples).map(|i| period * i as f64).collect();
        let f: Vec<f64> = (0..samples).map(|i| 5.0 * (std::f64::consts::TAU * frequency * i as f64).sin()).collect();
        let signals = vec![("f".to_string(), f), ("x".to_string(), vec![0.0; samples])];
        let mut record = Record::new(&Recording::new("r", t, signals).unwrap(), &model, Vec::new()).unwrap();
        let x = predict(&model, &record, 8).unwrap();
        // No smooth function: the last digits of a product of large numbers.
        let off = |i: usize| noise * (((i * 7919 + 13) % 1009) as f64 / 504.5 - 1.0);
        record.outputs[0] = Some(x.iter().enumerate().map(|(i, x)| x + off(i)).collect());
        let made = Problem::new(text.to_string(), PathBuf::from("cart.toml"), model, vec![record.clone()], vec![record], Initial::Rest);
        Problem { noise_sd: vec![noise / 3f64.sqrt()], ..made.unwrap() }
    }

    #[test]
    fn few_samples_stay_as_they_are() {
        let (same, remark) = thinned(problem(MODEL, 5000, 0.002, 1e-5));
        assert!(remark.is_none() && same.fit[0].len == 5000);
    }

    #[test]
    fn what_moves_slowly_is_thinned_and_predicted_alike() {
        let full = problem(MODEL, 300_000, 0.001, 1e-4);
        let (thin, remark) = thinned(full.clone());
        let text = remark.unwrap().text;
        assert!(text.contains("th sample is used") && samples_of(&thin.fit) <= tuning().recordings.most_samples + 1, "{text}");
        let every = full.fit[0].len.div_ceil(thin.fit[0].len);
        assert!(every > 1 && (thin.fit[0].period - every as f64 * full.fit[0].period).abs() < 1e-12);
        // Both predictions agree at the samples that both have.
        let (a, b) = (predict(&full.model, &full.fit[0], 8).unwrap(), predict(&thin.model, &thin.fit[0], 8).unwrap());
        let worst = a.iter().step_by(every).zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst}");
    }

    #[test]
    fn what_moves_within_a_few_samples_is_cut_and_not_thinned() {
        // A line of the same impulse and moment moves a free mass as the force does, but not what rings within it.
        let (thin, remark) = thinned(problem(&stiff(), 200_000, 0.1, 1e-9));
        let text = remark.unwrap().text;
        assert!(!text.contains("one in") && text.contains("the first"), "{text}");
        assert!(thin.fit[0].len <= tuning().recordings.most_samples && (thin.fit[0].period - 1e-3).abs() < 1e-15);
    }
}
