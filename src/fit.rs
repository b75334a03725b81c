//! `backdrive fit`: a model's parameters refitted to recordings, its structure unchanged.

use crate::cli;
use crate::columns::columns;
use crate::diagnose::answer::to_do;
use crate::diagnose::next::simulated;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::offered::{Builder, Step};
use crate::output;
use crate::progress;
use crate::servo_runs;
use backdrive_diagnosis::audit::without_contradicted;
use backdrive_diagnosis::belief::compare::{Quality, predictions, qualities};
use backdrive_diagnosis::belief::intervals::Uncertainty;
use backdrive_diagnosis::belief::parameters::{Pair, Row, correlated, refitted_text, rows};
use backdrive_diagnosis::belief::per_record::{PerRecord, fit_each};
use backdrive_diagnosis::output_error::structure::{FreeParameter, Role, Structure};
use backdrive_diagnosis::output_error::work::{Budget, Limit};
use backdrive_diagnosis::physics::PHYSICS;
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::search::{Search, Settings, search};
use backdrive_pages::parts::file_name;
use backdrive_plant::model::Model;
use backdrive_report::{number, percent};
use backdrive_sets::open;
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Correlations from here on are named.
const CORRELATED: f64 = 0.9;

/// The result of a fit.
struct Fitted {
    rows: Vec<Row>,
    pairs: Vec<Pair>,
    given: Vec<Quality>,
    fitted: Vec<Quality>,
    per_record: PerRecord,
    /// Names of the parameters that the recordings do not determine.
    kept: Vec<String>,
    model: String,
}

/// Fits, writes, and prints the confidence intervals of the parameters.
pub fn fit(options: &cli::Fit) -> Result<u8, Failure> {
    let model = Model::load(&options.model)?;
    if !model.servos.is_empty() {
        return servo_runs::fit(options);
    }
    if model.arm.is_some() {
        let model = options.model.display();
        return Err(Failure::input(format!(
            "{model}: [robot]: fit takes models of one axis; the numbers of an arm are refitted by `backdrive diagnose`"
        )));
    }
    let stop = interrupt::heard()?;
    let opened = || open::open(&options.set, Some(&options.model), options.grip.as_deref(), &options.ignore_signal);
    let opened = progress::busy("reading the recordings", opened)?;
    if let Some(out) = &options.out {
        open::not_onto(out, &opened.files, options.overwrite)?;
    }
    for note in &opened.notes {
        output::note(format_args!("note: {note}"));
    }
    let (problem, contradicted) = without_contradicted(opened.problem);
    for remark in contradicted {
        output::note(format_args!("note: {remark}"));
    }
    let patience = Duration::from_secs_f64(options.patience);
    let without: Vec<String> = PHYSICS.iter().map(|p| p.name.to_string()).collect();
    // With every effect withheld a search is the refit of the nominal model alone.
    let settings = Settings { without, effort: options.effort, patience, ..Settings::default() };
    let limit = settings.limit(Some(&stop));
    let fitted = progress::about(settings.expected(), |report| fitted(&problem, &settings, limit, report))?;
    if let Some(out) = &options.out {
        output::file(out, &fitted.model)?;
    }
    let steps = next(options, &opened.files, &fitted);
    let disagree = !fitted.per_record.disagreements().is_empty();
    if options.json {
        let all = json!({
            "model": problem.model.name,
            "numbers": fitted.rows,
            "correlations": fitted.pairs,
            "given": fitted.given,
            "fitted": fitted.fitted,
            "records": fitted.per_record,
            "agree": fitted.per_record.agree(),
            "kept": fitted.kept,
            "compared": fitted.per_record.compared(),
            "next": steps,
        });
        output::json(&all)?;
    } else {
        output::line(text(&problem, &fitted))?;
        to_do(&steps)?;
    }
    if let Some(out) = &options.out {
        let kept = match fitted.kept.len() {
            0 => String::new(),
            1 => format!("; {} is not determined by the recordings and keeps its nominal value", fitted.kept[0]),
            n => format!("; {n} parameters are not determined by the recordings and keep their nominal values: {}", fitted.kept.join(", ")),
        };
        output::note(format_args!("wrote {}{kept}", out.display()));
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; the parameters are those reached until then".to_string() });
    }
    Ok(if disagree { code::NEGATIVE } else { 0 })
}

/// What to do with the parameters, the most useful first.
fn next(options: &cli::Fit, files: &[PathBuf], fitted: &Fitted) -> Vec<Step> {
    let mut steps = Vec::new();
    let agree = fitted.per_record.disagreements().is_empty();
    match &options.out {
        None => {
            let stem = options.model.file_stem().map_or_else(|| "model".to_string(), |stem| stem.to_string_lossy().into_owned());
            let again = Builder::again().without("--json", false).option_writes("--out", Path::new(&format!("{stem}.fitted.toml")));
            steps.push(Step::new(
                "Write the model with these numbers: the same command with a file.",
                [again.build().filter(|c| c.is("fit"))],
            ));
        }
        Some(out) if agree => steps.push(Step::new(
            "Look at what the refitted model predicts of a recording.",
            [simulated(out, files, Path::new("fitted-predicted.csv"))],
        )),
        Some(_) => {}
    }
    let asked = Builder::verb("diagnose");
    let asked = options.set.iter().fold(asked, |asked, path| asked.reads(path)).option_reads("--model", &options.model);
    let asked = match &options.grip {
        Some(none) if none.as_os_str() == "none" => asked.option("--grip", "none"),
        Some(grip) => asked.option_reads("--grip", grip),
        None => asked,
    };
    let asked = options.ignore_signal.iter().fold(asked, |asked, signal| asked.word("--ignore-signal").word(signal));
    let text = match agree {
        true => "Find out whether the device has physics that its model leaves out.",
        false => "The records disagree, so that no numbers make this structure the device: find out which physics its model leaves out.",
    };
    let asked = asked.option_writes("--out", Path::new("diagnosis")).build();
    steps.insert(if agree { steps.len() } else { 0 }, Step::new(text, [asked]));
    steps
}

/// How often parameters that the recordings do not determine are taken out and the rest is fitted again, at most.
const ROUNDS: usize = 3;

fn fitted(problem: &Problem, settings: &Settings, limit: Limit, report: &(dyn Fn(&str) + Sync)) -> Result<Fitted, Failure> {
    let refit = |problem: &Problem| search(problem, settings, limit, report).map_err(Failure::input);
    let Search { mut nominal, noise_sd, .. } = refit(problem)?;
    report("fitting each record by itself");
    let per_record = fit_each(problem, &nominal, &noise_sd, &Budget::new(settings.work(), limit));
    let stated: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let given = quality(problem, &nominal.structure, &nominal.structure.values(problem, &stated, &[], &[]), &noise_sd);
    // What the recordings do not determine keeps its nominal value, and the rest is fitted around it: written as fitted, such parameters
    // would be arbitrary, and put back alone they would take the fit of the others along.
    let (mut free, mut kept) = (problem.clone(), Vec::new());
    let mut spread = Uncertainty::of(&nominal);
    for _ in 0..ROUNDS {
        let found = rows(&free, &nominal, &spread);
        let loose = |(number, row): (&FreeParameter, &Row)| match number.role {
            Role::Stated(i) if !row.determined => Some((i, row.clone())),
            _ => None,
        };
        let loose: Vec<(usize, Row)> = nominal.structure.free.iter().zip(&found).filter_map(loose).collect();
        if loose.is_empty() || loose.len() == free.stated.len() && free.stated.len() == nominal.structure.free.len() {
            kept.extend(loose.into_iter().map(|l| l.1));
            break;
        }
        let mut index = 0;
        free.stated.retain(|_| {
            index += 1;
            !loose.iter().any(|(i, _)| i + 1 == index)
        });
        kept.extend(loose.into_iter().map(|l| l.1));
        report("fitting what is determined");
        nominal = refit(&free)?.nominal;
        spread = Uncertainty::of(&nominal);
    }
    let mut all: Vec<Row> = rows(&free, &nominal, &spread).into_iter().filter(|r| !kept.iter().any(|k| k.name == r.name)).collect();
    all.extend(kept.iter().map(|row| Row { value: row.given.unwrap_or(row.value), at_bound: false, moved_sd: None, ..row.clone() }));
    all.sort_by_key(|row| problem.stated.iter().position(|s| row.name.starts_with(&s.path)).unwrap_or(usize::MAX));
    // Edits name no kept parameter, so the kept ones remain unchanged in the text.
    let model = match free.stated.iter().all(|s| kept.iter().any(|k| k.name == s.path)) {
        true => problem.text.clone(),
        false => refitted_text(&free, &nominal, &spread).map_err(Failure::input)?,
    };
    Ok(Fitted {
        rows: all,
        pairs: correlated(&free, &nominal, &spread, CORRELATED),
        given,
        fitted: quality(&free, &nominal.structure, &nominal.fit.values, &noise_sd),
        per_record,
        kept: kept.into_iter().map(|k| k.name).collect(),
        model,
    })
}

/// How well a structure with these values does on every recording.
fn quality(problem: &Problem, structure: &Structure, values: &[f64], noise_sd: &[f64]) -> Vec<Quality> {
    let of = |records: &[_], seen| {
        predictions(problem, records, structure, values).map(|p| qualities(problem, records, &p, noise_sd, seen)).unwrap_or_default()
    };
    let mut all = of(&problem.fit, true);
    all.extend(of(&problem.held_out, false));
    all
}

/// A few tables for a person.
fn text(problem: &Problem, fitted: &Fitted) -> String {
    let mut table = vec![["parameter", "unit", "given", "fitted", "std. error", "95 % interval", "moved (sd)"].map(String::from).to_vec()];
    for row in &fitted.rows {
        let (error, interval) = match row.determined {
            true => (number(row.standard_error), format!("{} to {}", number(row.ci95[0]), number(row.ci95[1]))),
            false => ("–".to_string(), "not determined: kept as given".to_string()),
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
    let mut table = vec![["record", "output", "nrmse as given", "fitted", "in noise sd", ""].map(String::from).to_vec()];
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
        let mut header = vec!["parameter, by record".to_string()];
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
            row.push(if enough { backdrive_diagnosis::verdict::words::share(across.p_value) } else { "–".to_string() });
            table.push(row);
        }
        out.push_str(&columns(&table));
    }
    let _ = writeln!(out, "\n{}: {}", problem.model.name, fits.sentence());
    out.trim_end().to_string()
}
