//! The loop that was measured beside the loop that the models make of the same session.

use super::question::Question;
use super::types::{Answer, AnswerError, LoopCheck};
use crate::frequency::{self, Frequency};
use crate::resimulate::{Gain, RunOptions, Scenario};
use std::sync::atomic::AtomicBool;

/// The loop measured in the bag beside the same measurement on what the models make of the same session, dither and all.
pub(super) fn loop_check(
    scenario: &Scenario,
    question: &Question,
    answer: &Answer,
    cancel: &AtomicBool,
) -> Result<Option<LoopCheck>, AnswerError> {
    let Some(measured) = &answer.frequency else { return Ok(None) };
    let rows = question.session.len();
    let (mu, lambda) = (question.session.mu.get(rows / 2), question.session.lambda.get(rows / 2));
    let (Some(mu), Some(lambda)) = (mu, lambda) else { return Ok(None) };
    let options = RunOptions { keep_dither: true, keep_signals: true, ..RunOptions::default() };
    if !(mu * lambda).is_finite() || question.script.is_some() {
        return Ok(None);
    }
    let run = scenario.run(Gain { mu: *mu, lambda: *lambda }, &options, cancel)?;
    let Some(signals) = run.signals else { return Ok(None) };
    let options = frequency::Options { draws: 50, ..Default::default() };
    let modelled = frequency::analyse(&signals, &options)?;
    Ok(compare_loops(measured, &modelled))
}

/// Relative difference of two loops beyond which they are not the same.
const SAME_LOOP: f64 = 0.04;

fn compare_loops(measured: &Frequency, modelled: &Frequency) -> Option<LoopCheck> {
    let (mut difference, mut noise, mut count) = (0.0, 0.0, 0.0);
    let centre = measured.edge.frequency_hz.filter(|f| *f > 0.0);
    for (a, b) in measured.levels.iter().zip(&modelled.levels) {
        for (x, y) in a.axes.iter().zip(&b.axes) {
            for (i, hz) in a.hz.iter().enumerate() {
                let near = centre.is_none_or(|c| (c / 3.0..c * 3.0).contains(hz));
                let Some(j) = b.hz.iter().position(|f| (f - hz).abs() < 1e-6) else { continue };
                if !near || !x.told[i] || !y.told[j] {
                    continue;
                }
                let (p, q) = (x.l[i], y.l[j]);
                let power = p[0] * p[0] + p[1] * p[1];
                difference += ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2)) / power;
                noise += 2.0 * (x.sigma[i].powi(2) + y.sigma[j].powi(2)) / power;
                count += 1.0;
            }
        }
    }
    if count < 3.0 {
        return None;
    }
    let (difference, noise) = (f64::sqrt(difference / count), f64::sqrt(noise / count));
    Some(LoopCheck { difference, noise, agrees: difference <= SAME_LOOP || difference <= 2.0 * noise })
}
