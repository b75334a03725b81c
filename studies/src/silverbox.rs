//! Silverbox: an electronic mass on a hardening spring. From the linear model to the cubic spring, extrapolated to larger amplitudes.

use crate::run::{Ask, diagnose, diagnosed_model, parameter, said};
use crate::table::Report;
use crate::{Context, Study, StudyError, csv_columns};
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, simulate};
use backdrive_signal::statistics::rms;
use std::ops::Range;

pub(crate) const STUDY: Study = Study {
    name: "silverbox",
    about: "an electronic mass-spring-damper: its cubic spring, extrapolated",
    needs: ("silverbox", &["snls80mv.csv"]),
    run,
};

/// Sample rate, Hz: 1e7 / 2^14, which the file's times round.
const RATE: f64 = 1e7 / 16384.0;
/// Rows of the benchmark: the growing noise, its part within the amplitudes of the training, and the multisine.
const ARROW: Range<usize> = 100..40575;
const ARROW_WITHIN: Range<usize> = 100..32100;
const MULTISINE: Range<usize> = 40650..127400;
/// Share of the multisine that is fitted.
const FITTED: f64 = 0.75;
/// Where the box is at rest before the multisine.
const REST: usize = 40560;
/// Samples at the start of the test part that the benchmark does not count.
const INIT: usize = 50;

/// RMSE in mV of others: multisine, whole arrow, arrow within the amplitudes of the training. Champneys et al. 2024, Tables 3 and 4.
const OTHERS: [(&str, [f64; 3]); 4] = [
    ("linear state space", [6.96, 14.4, 6.58]),
    ("polynomial NARX", [0.640, 2.25, 0.571]),
    ("GP-NARX", [0.301, 0.60, 0.259]),
    ("DT-SUBNET", [0.36, 1.4, 0.32]),
];

fn run(context: &Context) -> Result<Report, StudyError> {
    let columns = csv_columns::read_at_least(&context.data.join("snls80mv.csv"), &["u_V", "y_V"], MULTISINE.end)?;
    let (u, y) = (&columns[0], &columns[1]);
    let end = MULTISINE.end;
    let split = MULTISINE.start + (FITTED * MULTISINE.len() as f64) as usize;
    for (name, rows) in [("multisine-train.csv", REST..split), ("multisine-test.csv", split..end), ("arrow.csv", 0..ARROW.end)] {
        let t: Vec<f64> = (0..rows.len()).map(|i| i as f64 / RATE).collect();
        csv_columns::write(&context.out.join(name), &["t", "u", "y"], &[&t, &u[rows.clone()], &y[rows]])?;
    }
    let ask =
        Ask { name: "", set: "set.toml", model: "model.toml", without: &[], effects: 3, effort: if context.quick { 0.85 } else { 2.5 } };
    let found = diagnose(context, &ask)?;
    let verdict = &found.verdict;
    let model = diagnosed_model(context, &ask)?;

    let mut report = Report::new("Silverbox, from the linear model");
    let words = said(verdict);
    report.word("verdict", &words);
    let named = parameter(verdict, "cubic_spring", "cubic");
    report.line("verdict", words, "cubic stiffness, hardening", "Wigren & Schoukens 2013", Some(named.is_some_and(|(k, _)| k > 0.0)));
    for (what, path, published) in [
        ("mass", "bodies.mass", 5.375e-6),
        ("stiffness", "elements.spring.stiffness", 0.9903),
        ("damping", "elements.damping.damping", 2.2546e-4),
        ("cubic stiffness", "elements.spring.cubic", 3.949),
    ] {
        let value = model.values_at(path).ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN);
        report.figure(what, value);
        report.line(
            what,
            format!("{value:.4e}"),
            format!("{published:.4e}"),
            "regression on spectral derivatives of the same record",
            None,
        );
    }
    let all = |model: &Model| -> Result<[f64; 3], StudyError> {
        let multisine = errors(model, u, y, REST, end)?;
        let arrow = errors(model, u, y, 0, ARROW.end)?;
        Ok([rms(&multisine[split + INIT - REST..]), rms(&arrow[ARROW]), rms(&arrow[ARROW_WITHIN])].map(|x| 1e3 * x))
    };
    let ours = all(&model)?;
    let linear = all(&found
        .search
        .nominal
        .structure
        .model(&found.problem, &found.search.nominal.fit.values)
        .ok_or_else(|| StudyError::Diagnosis("the refitted linear model cannot be simulated".to_string()))?)?;
    for (i, what) in ["multisine", "arrow, whole", "arrow, within"].iter().enumerate() {
        let published = OTHERS.map(|(name, errors)| format!("{name} {:.3}", errors[i])).join(", ");
        let best = OTHERS.iter().map(|(_, errors)| errors[i]).fold(f64::INFINITY, f64::min);
        // Where amplitudes go beyond those fitted a named law must hold better than a flexible one; where they do not, it need not.
        let bar = (*what == "arrow, whole").then_some(ours[i] <= best);
        report.figure(what, ours[i]);
        let measured = format!("{:.3} mV (linear, refitted: {:.2})", ours[i], linear[i]);
        report.line(&format!("RMSE, {what}"), measured, published, "Champneys et al. 2024, arXiv 2405.10779", bar);
    }
    report.notes.push(
        "The simulation starts at rest before each signal and is never told what was measured; the benchmark hands the first 50 samples over."
            .to_string(),
    );
    Ok(report)
}

/// Measured less simulated from rest, row by row.
fn errors(model: &Model, u: &[f64], y: &[f64], from: usize, to: usize) -> Result<Vec<f64>, StudyError> {
    let failed = |e: &dyn std::fmt::Display| StudyError::Diagnosis(e.to_string());
    let simulated = simulate(model, &[&u[from..to]], 1.0 / RATE, &Options::default()).map_err(|e| failed(&e))?;
    let predicted = simulated.first().ok_or_else(|| StudyError::Diagnosis("the model has no output".to_string()))?;
    Ok(predicted.iter().zip(&y[from..to]).map(|(p, m)| m - p).collect())
}
