//! `backdrive fit`: a model's parameters refitted to recordings, its structure unchanged. The work is that of [`backdrive_predict::fit`].

use crate::cli;
use crate::columns::columns;
use crate::diagnose::answer::to_do;
use crate::diagnose::next::simulated;
use crate::failure::{Failure, code};
use crate::interrupt;
use crate::offered::{Builder, Step};
use crate::output;
use crate::progress;
use crate::servo_runs::ServoRefit;
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_pages::parts::file_name;
use backdrive_plant::model::Model;
use backdrive_predict::fit::{Fit, Fitted, Options};
use backdrive_report::{number, percent};
use backdrive_sets::open;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Fits, writes, and prints the confidence intervals of the parameters.
pub fn fit(options: &cli::Fit) -> Result<u8, Failure> {
    let asked = Options {
        model: options.model.clone(),
        set: options.set.clone().into(),
        grip: options.grip.clone(),
        ignored: options.ignore_signal.clone(),
        effort: options.effort,
        patience: Duration::from_secs_f64(options.patience),
    };
    let stop = interrupt::heard()?;
    let done = Refit::of(&asked, options.out.as_deref(), options.overwrite, &stop)?;
    if let Some(out) = &options.out {
        output::file(out, done.model())?;
    }
    match &done {
        Refit::Servo(joints) if options.json => output::json(&joints.json())?,
        Refit::Servo(joints) => joints.told(options.out.as_deref())?,
        Refit::OneAxis(both) => {
            let (fit, fitted) = both.as_ref();
            let steps = next(options, &fit.files, fitted);
            if options.json {
                let mut all = done.json();
                all["next"] = serde_json::to_value(&steps).map_err(Failure::input)?;
                output::json(&all)?;
            } else {
                output::line(text(&fit.problem, fitted))?;
                to_do(&steps)?;
            }
            if let Some(out) = &options.out {
                output::note(format_args!("wrote {}{}", out.display(), kept(fitted)));
            }
        }
    }
    if stop.load(Ordering::SeqCst) {
        return Err(Failure { code: code::INTERRUPTED, message: "stopped; the parameters are those reached until then".to_string() });
    }
    Ok(done.code())
}

/// A refit, by the kind of the device.
pub enum Refit {
    /// A network of one axis: what was fitted, and the result.
    OneAxis(Box<(Fit, Fitted)>),
    /// Joints that position servos drive.
    Servo(Box<ServoRefit>),
}

impl Refit {
    /// Refits a model. `out` is a file that the caller writes afterwards: it may not be one that is read, the model with `overwrite` excepted.
    ///
    /// # Errors
    /// A file is missing or wrong, or the recordings do not suit the model.
    pub fn of(asked: &Options, out: Option<&Path>, overwrite: bool, stop: &AtomicBool) -> Result<Refit, Failure> {
        let model = Model::load(&asked.model)?;
        if !model.servos.is_empty() {
            return ServoRefit::of(asked, out, overwrite).map(|joints| Refit::Servo(Box::new(joints)));
        }
        if model.arm.is_some() {
            let model = asked.model.display();
            return Err(Failure::input(format!(
                "{model}: [robot]: fit takes models of one axis; the numbers of an arm are refitted by `backdrive diagnose`"
            )));
        }
        let fit = progress::busy("reading the recordings", || Fit::read(asked))?;
        if let Some(out) = out {
            open::not_onto(out, &fit.files, overwrite)?;
        }
        fit.notes.iter().for_each(|note| output::note(format_args!("note: {note}")));
        let fitted = progress::about(fit.expected(), |report| fit.run(stop, report))?;
        Ok(Refit::OneAxis(Box::new((fit, fitted))))
    }

    /// The text of the refitted model's file.
    pub fn model(&self) -> String {
        match self {
            Refit::OneAxis(both) => both.1.model.clone(),
            Refit::Servo(joints) => joints.model(),
        }
    }

    /// The result for programs.
    pub fn json(&self) -> Value {
        match self {
            Refit::OneAxis(both) => {
                let (fit, fitted) = both.as_ref();
                json!({
                    "model": fit.problem.model.name,
                    "numbers": fitted.rows,
                    "correlations": fitted.pairs,
                    "given": fitted.given,
                    "fitted": fitted.fitted,
                    "records": fitted.per_record,
                    "agree": fitted.per_record.agree(),
                    "kept": fitted.kept,
                    "compared": fitted.per_record.compared(),
                })
            }
            Refit::Servo(joints) => joints.json(),
        }
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        match self {
            Refit::OneAxis(both) if !both.1.per_record.disagreements().is_empty() => code::NEGATIVE,
            Refit::OneAxis(_) | Refit::Servo(_) => 0,
        }
    }
}

/// What of the parameters is not determined, as the end of a sentence.
fn kept(fitted: &Fitted) -> String {
    match fitted.kept.len() {
        0 => String::new(),
        1 => format!("; {} is not determined by the recordings and keeps its nominal value", fitted.kept[0]),
        n => format!("; {n} parameters are not determined by the recordings and keep their nominal values: {}", fitted.kept.join(", ")),
    }
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
                "Write the model with these parameters: the same command with a file.",
                [again.build().filter(|c| c.is("fit"))],
            ));
        }
        Some(out) if agree => steps
            .push(Step::new("Compare the refitted model with a recording.", [simulated(out, files, Path::new("fitted-predicted.csv"))])),
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
        true => "Find out whether the model leaves out an effect.",
        false => "The records disagree, so no parameters fit them all with this structure: find out which effect the model leaves out.",
    };
    let asked = asked.option_writes("--out", Path::new("diagnosis")).build();
    steps.insert(if agree { steps.len() } else { 0 }, Step::new(text, [asked]));
    steps
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
        let _ =
            writeln!(out, "correlated: {} with {} ({:.3}): the recordings hardly separate them", pair.first, pair.second, pair.correlation);
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
