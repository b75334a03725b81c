//! A model's parameters refitted to recordings, its structure unchanged.

use crate::error::PredictError;
use backdrive_diagnosis::audit::without_contradicted;
use backdrive_diagnosis::belief::compare::{Quality, predictions, qualities};
use backdrive_diagnosis::belief::intervals::Uncertainty;
use backdrive_diagnosis::belief::parameters::{Pair, Row, correlated, refitted_text, rows};
use backdrive_diagnosis::belief::per_record::{PerRecord, fit_each};
use backdrive_diagnosis::options::Options as Asked;
use backdrive_diagnosis::output_error::structure::{FreeParameter, Role, Structure};
use backdrive_diagnosis::output_error::work::{Budget, Limit};
use backdrive_diagnosis::physics::PHYSICS;
use backdrive_diagnosis::recordings::problem::Problem;
use backdrive_diagnosis::search::{Search, search};
use backdrive_sets::{Recordings, open};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Correlations from here on are named.
const CORRELATED: f64 = 0.9;

/// What is refitted, and how long.
#[derive(Debug, Clone)]
pub struct Options {
    /// The model file.
    pub model: PathBuf,
    /// The recordings.
    pub set: Recordings,
    /// The grip that holds the model; `none` for no hand.
    pub grip: Option<PathBuf>,
    /// Recorded inputs that may have no place in the model.
    pub ignored: Vec<String>,
    /// How much is computed at most, as a multiple of the default.
    pub effort: f64,
    /// A limit on the clock.
    pub patience: Duration,
}

/// A model and its recordings, ready to be fitted.
pub struct Fit {
    /// The model, what is fitted and what is held out.
    pub problem: Problem,
    /// Files that were read.
    pub files: Vec<PathBuf>,
    /// What a person should know of the recordings: a sentence each.
    pub notes: Vec<String>,
    asked: Asked,
}

/// The result of a fit.
pub struct Fitted {
    /// The parameters.
    pub rows: Vec<Row>,
    /// Pairs of them that the recordings tell apart badly.
    pub pairs: Vec<Pair>,
    /// How well the model as given does on each recording.
    pub given: Vec<Quality>,
    /// The same of the refitted one.
    pub fitted: Vec<Quality>,
    /// The parameters fitted to each recording by itself.
    pub per_record: PerRecord,
    /// Names of the parameters that the recordings do not determine.
    pub kept: Vec<String>,
    /// Text of the refitted model's file.
    pub model: String,
}

impl Fit {
    /// Reads the model and the recordings.
    ///
    /// # Errors
    /// A file is missing or wrong, or the recordings do not suit the model.
    pub fn read(options: &Options) -> Result<Fit, PredictError> {
        let opened = open::open(&options.set, Some(&options.model), options.grip.as_deref(), &options.ignored)?;
        let (problem, contradicted) = without_contradicted(opened.problem);
        let notes = opened.notes.into_iter().chain(contradicted.iter().map(|remark| remark.to_string())).collect();
        // With every effect withheld a search is the refit of the nominal model alone.
        let without: Vec<String> = PHYSICS.iter().map(|p| p.name.to_string()).collect();
        let asked = Asked { without, effort: Some(options.effort), patience: Some(options.patience), ..Asked::default() };
        Ok(Fit { problem, files: opened.files, notes, asked })
    }

    /// About how long the fit takes at most.
    pub fn expected(&self) -> Duration {
        self.asked.expected()
    }

    /// Fits. `report` hears the stages of the work; `stop` ends it with the parameters reached until then.
    ///
    /// # Errors
    /// The model cannot be simulated on the recordings.
    pub fn run(&self, stop: &AtomicBool, report: &(dyn Fn(&str) + Sync)) -> Result<Fitted, PredictError> {
        refitted(&self.problem, &self.asked, self.asked.limit(Some(stop)), report)
    }
}

/// How often parameters that the recordings do not determine are taken out and the rest is fitted again, at most.
const ROUNDS: usize = 3;

fn refitted(problem: &Problem, asked: &Asked, limit: Limit, report: &(dyn Fn(&str) + Sync)) -> Result<Fitted, PredictError> {
    let refit = |problem: &Problem| search(problem, asked, limit, report).map_err(PredictError::input);
    let Search { mut nominal, noise_sd, .. } = refit(problem)?;
    report("fitting each record alone");
    let per_record = fit_each(problem, &nominal, &noise_sd, &Budget::new(asked.work(), limit));
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
        report("fitting the determined parameters");
        nominal = refit(&free)?.nominal;
        spread = Uncertainty::of(&nominal);
    }
    let mut all: Vec<Row> = rows(&free, &nominal, &spread).into_iter().filter(|r| !kept.iter().any(|k| k.name == r.name)).collect();
    all.extend(kept.iter().map(|row| Row { value: row.given.unwrap_or(row.value), at_bound: false, moved_sd: None, ..row.clone() }));
    all.sort_by_key(|row| problem.stated.iter().position(|s| row.name.starts_with(&s.path)).unwrap_or(usize::MAX));
    // Edits name no kept parameter, so the kept ones remain unchanged in the text.
    let model = match free.stated.iter().all(|s| kept.iter().any(|k| k.name == s.path)) {
        true => problem.text.clone(),
        false => refitted_text(&free, &nominal, &spread).map_err(PredictError::input)?,
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
