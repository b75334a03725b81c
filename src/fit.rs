//! `backdrive fit`: a model's numbers refitted to recordings, its structure as it is.

use crate::cli;
use crate::columns::columns;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::output;
use crate::progress;
use crate::recordings::{self, file_name};
use backdrive_diagnosis::clock::Moment;
use backdrive_diagnosis::compare::{Quality, predictions, qualities};
use backdrive_diagnosis::hypothesis::PHYSICS;
use backdrive_diagnosis::intervals::Spread;
use backdrive_diagnosis::numbers::{Pair, Row, correlated, refitted_text, rows};
use backdrive_diagnosis::per_record::{PerRecord, fit_each};
use backdrive_diagnosis::problem::Problem;
use backdrive_diagnosis::search::{Search, Settings, search};
use backdrive_report::{number, percent};
use serde_json::json;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Correlations from here on are named.
const CORRELATED: f64 = 0.9;

/// What a fit says.
struct Fitted {
    rows: Vec<Row>,
    pairs: Vec<Pair>,
    given: Vec<Quality>,
    fitted: Vec<Quality>,
    per_record: PerRecord,
    model: String,
}

/// Fits, writes, and says how sure the numbers are.
pub fn fit(options: &cli::Fit) -> Result<u8, Failure> {
    let stop = interrupt::heard()?;
    let opened = recordings::open(&options.set, Some(&options.model), options.grip.as_deref())?;
    for note in &opened.notes {
        output::note(format_args!("note: {note}"));
    }
    let problem = opened.problem;
    let patience = Duration::from_secs_f64(options.patience);
    let fitted = progress::at_most(patience, |report| fitted(&problem, patience, &stop, report))?;
    if let Some(out) = &options.out {
        output::file(out, &fitted.model)?;
    }
    let disagree = !fitted.per_record.disagreements().is_empty();
    if options.json {
        let all = json!({
            "model": problem.model.name,
            "numbers": fitted.rows,
            "correlations": fitted.pairs,
            "given": fitted.given,
            "fitted": fitted.fitted,
            "records": fitted.per_record,
            "agree": !disagree,
        });
        output::json(&all)?;
    } else {
        output::line(text(&problem, &fitted))?;
    }
    if let Some(out) = &options.out {
        output::note(format_args!("wrote {}", out.display()));
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; the numbers are those reached until then".to_string() });
    }
    Ok(if disagree { code::NEGATIVE } else { 0 })
}

fn fitted(problem: &Problem, patience: Duration, stop: &AtomicBool, report: &(dyn Fn(&str) + Sync)) -> Result<Fitted, Failure> {
    let until = Moment::now() + patience;
    // With every physics withheld a search is the refit of the nominal model alone.
    let without = PHYSICS.iter().map(|p| p.name.to_string()).collect();
    let settings = Settings { without, patience, ..Settings::default() };
    let Search { nominal, floor, .. } = search(problem, &settings, Some(stop), report).map_err(Failure::input)?;
    report("fitting each record by itself");
    let per_record = fit_each(problem, &nominal, &floor, Some(stop), Some(until));
    let spread = Spread::of(&nominal);
    let stated: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let given = nominal.structure.values(problem, &stated, &[], &[]);
    let quality = |values: &[f64]| -> Vec<Quality> {
        let of = |records: &[_], seen| {
            predictions(problem, records, &nominal.structure, values)
                .map(|p| qualities(problem, records, &p, &floor, seen))
                .unwrap_or_default()
        };
        let mut all = of(&problem.fit, true);
        all.extend(of(&problem.held_out, false));
        all
    };
    Ok(Fitted {
        rows: rows(problem, &nominal, &spread),
        pairs: correlated(problem, &nominal, &spread, CORRELATED),
        given: quality(&given),
        fitted: quality(&nominal.fit.values),
        per_record,
        model: refitted_text(problem, &nominal, &spread).map_err(Failure::input)?,
    })
}

/// A few tables for a person.
fn text(problem: &Problem, fitted: &Fitted) -> String {
    let mut table = vec![["number", "unit", "given", "fitted", "std. error", "95 % interval", "moved (sd)"].map(String::from).to_vec()];
    for row in &fitted.rows {
        let (error, interval) = match row.determined {
            true => (number(row.standard_error), format!("{} to {}", number(row.ci95[0]), number(row.ci95[1]))),
            false => ("–".to_string(), "not determined".to_string()),
        };
        let moved = row.moved_sd.filter(|s| s.is_finite() && row.determined).map_or("–".to_string(), |s| format!("{s:.1}"));
        let value = if row.at_bound { format!("{} (at its bound)", number(row.value)) } else { number(row.value) };
        table.push(vec![row.name.clone(), row.unit.clone(), row.given.map_or("–".to_string(), number), value, error, interval, moved]);
    }
    let mut out = columns(&table);
    for pair in &fitted.pairs {
        let _ = writeln!(
            out,
            "correlated: {} with {} ({:.3}): the recordings tell them apart badly",
            pair.first, pair.second, pair.correlation
        );
    }
    let _ = writeln!(out);
    let mut table = vec![["record", "output", "nrmse as given", "fitted", "in noises", ""].map(String::from).to_vec()];
    for (q, given) in fitted.fitted.iter().zip(&fitted.given) {
        let seen = if q.fitted { "fitted" } else { "held out" };
        table.push(vec![
            file_name(&q.record).to_string(),
            q.output.clone(),
            percent(given.nrmse),
            percent(q.nrmse),
            number(q.floors),
            seen.to_string(),
        ]);
    }
    out.push_str(&columns(&table));
    let fits = &fitted.per_record;
    if fits.records.len() > 1 {
        let _ = writeln!(out);
        let mut header = vec!["number, by record".to_string()];
        header.extend(fits.records.iter().map(|r| file_name(r).to_string()));
        header.push("chance".to_string());
        let mut table = vec![header];
        for across in &fits.numbers {
            let mut row = vec![across.name.clone()];
            row.extend(across.own.iter().map(|own| match own.determined {
                true => format!("{} ± {}", number(own.value), number(0.5 * (own.ci95[1] - own.ci95[0]))),
                false => "–".to_string(),
            }));
            let enough = across.own.iter().filter(|o| o.determined).count() > 1;
            row.push(if enough { number(across.p_value) } else { "–".to_string() });
            table.push(row);
        }
        out.push_str(&columns(&table));
    }
    let _ = writeln!(out, "\n{}: {}", problem.model.name, fits.sentence());
    out.trim_end().to_string()
}
