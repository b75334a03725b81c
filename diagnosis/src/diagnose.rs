//! A diagnosis from its problem to its verdict: the audit, the search, the force located, what is claimed, and each record by itself.

use crate::audit::{Remark, audit};
use crate::locate::{self, Location, locate};
use crate::per_record::{PerRecord, fit_each};
use crate::problem::Problem;
use crate::search::{Search, SearchError, Settings, search};
use crate::tuning::tuning;
use crate::verdict::{Files, Verdict, VerdictError, timing, verdict};
use crate::work::Budget;
use std::sync::atomic::AtomicBool;

/// Everything that was found.
pub struct Diagnosis {
    /// The model and its recordings.
    pub problem: Problem,
    /// What the recordings say of themselves.
    pub remarks: Vec<Remark>,
    /// Structures and their fits.
    pub search: Search,
    /// The latent force that the refitted nominal model needs, at every place; `None` where it cannot be had.
    pub location: Option<Location>,
    /// What follows.
    pub verdict: Verdict,
    /// The files beside it.
    pub files: Files,
    /// The refitted nominal model fitted to each record by itself.
    pub per_record: PerRecord,
}

/// Why there is no diagnosis.
#[derive(Debug, thiserror::Error)]
pub enum DiagnosisError {
    /// The nominal model cannot be simulated on the recordings.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// What was found cannot be written into the model's text.
    #[error(transparent)]
    Verdict(#[from] VerdictError),
}

/// Diagnoses. Once `stop` is set it comes to an end with what was found until then; `report` hears what is being done.
///
/// # Errors
/// When the nominal model cannot be simulated on the recordings, or what was found cannot be written into its text.
pub fn diagnose(
    problem: Problem,
    settings: &Settings,
    stop: Option<&AtomicBool>,
    report: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis, DiagnosisError> {
    let limit = settings.limit(stop);
    report("looking at the recordings");
    let mut remarks = audit(&problem);
    let search = search(&problem, settings, limit, report)?;
    remarks.extend(timing(&problem, &search));
    report("locating the missing force");
    let location = located(&problem, &search);
    report("deciding");
    let (verdict, files) = verdict(&problem, &search, &remarks, location.as_ref(), limit)?;
    report("fitting each record by itself");
    let per_record = fit_each(&problem, &search.nominal, &search.noise_sd, &Budget::new(tuning().search.per_record, limit));
    Ok(Diagnosis { problem, remarks, search, location, verdict, files, per_record })
}

/// The latent force that the refitted nominal model needs.
fn located(problem: &Problem, search: &Search) -> Option<Location> {
    let nominal = &search.nominal;
    let model = nominal.structure.model(problem, &nominal.fit.values)?;
    let records = nominal.structure.with_unknown(problem, &problem.fit, &nominal.fit.values);
    let runs: Vec<locate::Run> = records.iter().map(locate::Run::from).collect();
    locate(&model, &runs, &search.noise_sd, &locate::Options::quick()).ok()
}
