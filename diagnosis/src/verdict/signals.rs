//! When and at which frequencies the residual is large, glitches, and inputs that nobody measured.

use super::types::Where;
use crate::belief::statistics::deviation_by_median;
use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::Evaluator;
use crate::recordings::problem::Problem;
use crate::recordings::unknown::{Estimated, Unknown, estimated};
use crate::tuning::tuning;
use backdrive_plant::write::round_significant;

/// Times at which a motion sensor is far off for a moment while all the rest is measuring error, s: glitches, which no effect in the device causes. Empty
/// where the rest is no measuring error, or a reversal of friction could be it.
pub(crate) fn bursts(problem: &Problem, best: &Candidate) -> Vec<[f64; 2]> {
    use backdrive_plant::model::OutputKind;
    let evaluator = Evaluator::new(problem);
    let mut all = Vec::new();
    for (r, output, range) in evaluator.layout() {
        let Some(part) = best.fit.residuals.get(range) else { continue };
        if matches!(problem.model.outputs[output].kind, OutputKind::Reaction(_)) {
            continue;
        }
        let mut sizes: Vec<f64> = part.iter().map(|x| x.abs()).collect();
        let spread = deviation_by_median(&mut sizes);
        // A rounded signal may well be right in more than half of its samples.
        let far = tuning().claim.glitch * spread.max(1.0);
        let away: Vec<usize> = part.iter().enumerate().filter(|(_, x)| x.abs() > far).map(|(i, _)| i).collect();
        if away.len() < tuning().claim.glitch_samples || away.len() as f64 > tuning().claim.glitch_share * part.len() as f64 {
            continue;
        }
        let mut groups: Vec<(usize, usize)> = Vec::new();
        for i in away {
            match groups.last_mut() {
                Some(group) if i - group.1 <= tuning().claim.glitch_gap => group.1 = i,
                _ => groups.push((i, i)),
            }
        }
        let period = problem.fit[r].period;
        all.extend(
            groups.iter().filter(|g| g.1 - g.0 <= tuning().claim.glitch_longest).map(|g| [g.0 as f64 * period, (g.1 + 1) as f64 * period]),
        );
    }
    all
}

/// When and at which frequencies residuals, in the order of an evaluator, are largest.
pub(crate) fn place_in_signals(problem: &Problem, residuals: &[f64], bursts: &[[f64; 2]]) -> Option<Where> {
    let evaluator = Evaluator::new(problem);
    let mut strongest: Option<(f64, [f64; 2], [f64; 2])> = None;
    for (r, _, range) in evaluator.layout() {
        let Some(part) = residuals.get(range) else { continue };
        let period = problem.fit[r].period;
        let window = (part.len() / 20).max(1);
        let sums: Vec<f64> = part.chunks(window).map(|c| c.iter().map(|x| x * x).sum::<f64>()).collect();
        let Some((at, most)) = sums.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) else { continue };
        if strongest.as_ref().is_none_or(|s| *most > s.0) {
            let time = [at as f64 * window as f64 * period, ((at + 1) * window).min(part.len()) as f64 * period];
            strongest = Some((*most, time, band(part, period)));
        }
    }
    let (_, time, band) = strongest?;
    let r = |x: f64| round_significant(x, 4);
    let times: Vec<[f64; 2]> = if bursts.is_empty() { vec![time] } else { bursts.to_vec() };
    let times: Vec<[f64; 2]> = times.iter().take(20).map(|t| [r(t[0]), r(t[1])]).collect();
    Some(Where { time: times, band_hz: band.map(r), state: None, class: None })
}

/// Frequencies between which the middle eight tenths of a signal's energy lie, Hz.
fn band(samples: &[f64], period: f64) -> [f64; 2] {
    let mut planner = realfft::RealFftPlanner::<f64>::new();
    let transform = planner.plan_fft_forward(samples.len());
    let (mut input, mut output) = (samples.to_vec(), transform.make_output_vec());
    if transform.process(&mut input, &mut output).is_err() {
        return [0.0, 0.5 / period];
    }
    let energy: Vec<f64> = output.iter().map(|c| c.norm_sqr()).collect();
    let total: f64 = energy.iter().sum();
    let hz = |index: usize| index as f64 / (samples.len() as f64 * period);
    let at = |share: f64| {
        let mut sum = 0.0;
        hz(energy
            .iter()
            .position(|e| {
                sum += e;
                sum >= share * total
            })
            .unwrap_or(0))
    };
    [at(0.1), at(0.9)]
}

/// What was found of the inputs that nobody measured.
pub(crate) fn unknown_inputs(problem: &Problem, best: &Candidate) -> Vec<Estimated> {
    let records = best.structure.with_unknown(problem, &problem.fit, &best.fit.values);
    let one = |unknown: &Unknown| {
        let name = problem.model.inputs.get(unknown.input).map_or("", |i| i.name.as_str());
        let curves: Vec<(Vec<f64>, f64)> = records.iter().map(|r| (r.inputs[unknown.input].clone(), r.period)).collect();
        estimated(name, unknown, &curves)
    };
    problem.unknown.iter().map(one).collect()
}
