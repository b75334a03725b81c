//! Errors on held-out recordings: of the model as given, with its parameters refitted, and diagnosed.

use super::rounded::rounded;
use super::types::{HeldOut, RecordErrors};
use crate::audit::file_name;
use crate::belief::compare::mean_squares;
use crate::output_error::candidate::Candidate;
use crate::output_error::evaluator::measured;
use crate::recordings::problem::{Problem, Record};
use crate::search::Search;
use std::collections::BTreeMap;

/// An output that was measured in a record.
type Pair<'p> = (&'p Record, usize);

/// The errors; `use_best` states whether the diagnosed model is the best structure, or the unchanged nominal file.
pub(super) fn held_out(problem: &Problem, search: &Search, best: &Candidate, use_best: bool) -> HeldOut {
    let records = if problem.held_out.is_empty() { &problem.fit } else { &problem.held_out };
    let nominal = &search.nominal.structure;
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let before = mean_squares(problem, records, nominal, &nominal.values(problem, &given, &[], &[]));
    let refit = mean_squares(problem, records, nominal, &search.nominal.fit.values);
    let after = if use_best { mean_squares(problem, records, &best.structure, &best.fit.values) } else { before.clone() };
    let pairs: Vec<Pair> = records.iter().flat_map(|record| measured(record).map(move |output| (record, output))).collect();
    let noise_sd: Vec<f64> = pairs.iter().map(|(_, output)| search.noise_sd[*output] * search.noise_sd[*output]).collect();
    let mean = |squares: &Option<Vec<f64>>| squares.as_ref().and_then(|s| averaged(&pairs, s)).and_then(|x| rounded(x, 6));
    let pooled = |squares: &[f64]| pooled(problem, &pairs, squares);
    let one = |(i, (record, output)): (usize, &Pair)| {
        let nrmse = |squares: &Option<Vec<f64>>| squares.as_ref().and_then(|s| rounded(s[i].sqrt() / record.spread[*output], 6));
        RecordErrors {
            record: file_name(&record.name).to_string(),
            output: problem.model.outputs[*output].name.clone(),
            nrmse_before: nrmse(&before),
            nrmse_refit: nrmse(&refit),
            nrmse_after: nrmse(&after),
            noise_floor: rounded(noise_sd[i].sqrt() / record.spread[*output], 6),
        }
    };
    HeldOut {
        nrmse_before: mean(&before),
        nrmse_refit: mean(&refit),
        nrmse_after: mean(&after),
        noise_floor: rounded(averaged(&pairs, &noise_sd).unwrap_or(0.0), 6),
        pooled_before: before.as_deref().map(pooled),
        pooled_refit: refit.as_deref().map(pooled),
        pooled_after: after.as_deref().map(pooled),
        pooled_floor: Some(pooled(&noise_sd)),
        per_record: pairs.iter().enumerate().map(one).collect(),
    }
}

/// Root mean square error over the signal's standard deviation, averaged over all pairs; `None` where there is none.
fn averaged(pairs: &[Pair], squares: &[f64]) -> Option<f64> {
    let sum: f64 = pairs.iter().zip(squares).map(|((record, output), square)| square.sqrt() / record.spread[*output]).sum();
    (!pairs.is_empty()).then(|| sum / pairs.len() as f64)
}

/// Per output the root of the summed squared errors over that of the summed squared deviations, all records together.
fn pooled(problem: &Problem, pairs: &[Pair], squares: &[f64]) -> BTreeMap<String, f64> {
    let of = |index: usize| {
        let (mut error, mut deviation) = (0.0, 0.0);
        for ((record, _), square) in pairs.iter().zip(squares).filter(|((_, output), _)| *output == index) {
            error += record.len as f64 * square;
            deviation += record.len as f64 * record.spread[index] * record.spread[index];
        }
        rounded((error / deviation).sqrt(), 6)
    };
    problem.model.outputs.iter().enumerate().filter_map(|(index, output)| Some((output.name.clone(), of(index)?))).collect()
}
