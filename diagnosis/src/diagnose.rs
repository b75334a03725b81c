//! A diagnosis from its problem to its verdict: the audit, the search, the force located, what is claimed, and each record by itself.

use crate::audit::{Remark, Weight, audit, without_contradicted};
use crate::belief::choice::chosen;
use crate::belief::compare::unseen;
use crate::belief::contenders::with_contenders;
use crate::belief::decision::without_what_may_be_nothing;
use crate::belief::per_record::{PerRecord, fit_each};
use crate::belief::released_parameters::hold_with_released_parameters;
use crate::equation_error::{OnForces, inverse, search_on_forces, with_model};
use crate::locate::{self, Location, locate};
use crate::options::Options;
use crate::output_error::candidate::price;
use crate::output_error::structure::Structure;
use crate::output_error::work::{Budget, Limit};
use crate::output_error::{hold, observed};
use crate::recordings::problem::Problem;
use crate::recordings::thinned::thinned;
use crate::search::{Search, SearchError, search};
use crate::tuning::tuning;
use crate::verdict::{Files, Verdict, VerdictError, timing, verdict};
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
    options: &Options,
    stop: Option<&AtomicBool>,
    report: &(dyn Fn(&str) + Sync),
) -> Result<Diagnosis, DiagnosisError> {
    let limit = options.limit(stop);
    report("looking at the recordings");
    let mut remarks = audit(&problem);
    let (problem, dead) = problem.without_dead_outputs();
    for signal in dead {
        remarks.retain(|r| !(r.about == "constant" && r.signal == signal));
        let text = "is constant while others change: it is excluded from every fit and from the verdict".to_string();
        remarks.push(Remark { weight: Weight::Caution, records: Vec::new(), signal, about: "constant", text });
    }
    let (problem, contradicted) = without_contradicted(problem);
    // A comparison with the signal's own position is stronger evidence than one with a model.
    remarks.retain(|r| !(matches!(r.about, "sign" | "unit") && contradicted.iter().any(|c| c.signal == r.signal)));
    remarks.extend(contradicted);
    let (problem, search) = searched(problem, options, limit, report, &mut remarks)?;
    remarks.extend(search.forces.as_ref().map(of_band));
    remarks.extend(search.forces.iter().flat_map(|forces| &forces.same_force).map(|text| of_same_force(text)));
    remarks.extend(timing(&problem, &search));
    report("locating the missing force");
    let location = located(&problem, &search);
    report("deciding");
    let (verdict, files) = verdict(&problem, &search, &remarks, location.as_ref(), limit)?;
    report("fitting each record alone");
    let per_record = fit_each(&problem, &search.nominal, &search.noise_sd, &Budget::new(tuning().search.per_record, limit));
    Ok(Diagnosis { problem, remarks, search, location, verdict, files, per_record })
}

/// Searches on forces where they are known along the motion, else by simulation. Where the laws on forces leave much, the set is simulated as well. Of a device that
/// forces drive, forces are asked where the simulation does not reach the sensor noise and drifts, or names no law. The motion of a body that a spring holds does
/// not drift: there it has more to say than the force, which near a resonance is a small difference.
fn searched(
    problem: Problem,
    options: &Options,
    limit: Limit,
    report: &(dyn Fn(&str) + Sync),
    remarks: &mut Vec<Remark>,
) -> Result<(Problem, Search), SearchError> {
    let is_beyond = |search: &Search| search.forces.as_ref().is_some_and(|forces| forces.is_beyond);
    let direct = match search_on_forces(&problem, options, limit, report) {
        Some(found) if !is_beyond(&found.1) => return Ok(found),
        direct => direct,
    };
    let turned = inverse(&problem);
    let beside = observed::observed(&problem);
    let drifts = problem.drifts();
    let mut of_simulation = Vec::new();
    let simulated = by_simulation(problem, options, limit, report, &mut of_simulation)?;
    let forces_say_more = !is_at_noise(&simulated) && (drifts || !explains(&simulated));
    let on_forces = match (direct, turned) {
        (Some(found), _) => Some(found),
        (None, Some(turned)) if forces_say_more => search_on_forces(&turned, options, limit, report),
        (None, _) => None,
    };
    // Of a device that drifts a free simulation adds up all errors; beside an observer each shows where and when it acts.
    let mut of_motion = Vec::new();
    let along = match beside.filter(|_| forces_say_more) {
        Some(beside) => {
            report("simulating beside the recorded motion");
            Some(by_simulation(beside, options, limit, report, &mut of_motion)?)
        }
        None => None,
    };
    let sharper = tuning().equation_error.sharper;
    let before = on_forces.filter(|found| left_beside(&simulated, found).is_none_or(|share| share >= sharper));
    let wins = |found: &(Problem, Search)| {
        let least = if before.is_some() { 1.0 / sharper } else { 1.0 };
        explains(found) && left_beside(before.as_ref().unwrap_or(&simulated), found).is_none_or(|share| share > least)
    };
    if let Some(found) = along.filter(wins) {
        remarks.extend(of_motion);
        return Ok(found);
    }
    match before {
        Some(found) => Ok(found),
        None => {
            remarks.extend(of_simulation);
            Ok(simulated)
        }
    }
}

/// Whether what a search chose leaves nothing but noise.
fn is_at_noise((_, search): &(Problem, Search)) -> bool {
    chosen(search).levels.iter().all(|level| *level < tuning().noise.unexplained)
}

/// Whether a search names a law at all.
fn explains((_, search): &(Problem, Search)) -> bool {
    !chosen(search).structure.added.is_empty()
}

/// What a model leaves of the measured force of held-out recordings, in what a search along the measured motion leaves. Both are compared in the band of that one:
/// beyond it a motion's steps and noise, differentiated twice, count as noise of the force and hide what either leaves. `None` where either cannot be simulated.
fn left_beside(other: &(Problem, Search), along: &(Problem, Search)) -> Option<f64> {
    let (problem, found) = along;
    let left = |problem: &Problem, structure: &Structure, values: &[f64]| {
        let records = if problem.held_out.is_empty() { &problem.fit } else { &problem.held_out };
        Some(unseen(problem, records, structure, values, &found.noise_sd)?.mean_square.sqrt())
    };
    let (own, best) = (chosen(found), chosen(&other.1));
    let other = match problem.inverse {
        None => left(problem, &best.structure, &best.fit.values),
        // A model that was fitted on other signals: moved along the motion, as it stands.
        Some(_) => best.structure.model(&other.0, &best.fit.values).and_then(|model| {
            let moved = observed::with_model(problem, &model).or_else(|| with_model(problem, &model))?;
            left(&moved, &Structure::new(&moved, &moved.fit, Vec::new()), &[])
        }),
    };
    Some(other? / left(problem, &own.structure, &own.fit.values)?)
}

/// What a reader has to know of a search on forces.
fn of_band(forces: &OnForces) -> Remark {
    let bands = forces.bands_hz.iter().map(|hz| format!("{hz}")).collect::<Vec<_>>().join(", ");
    let text = format!(
        "motion and force are both recorded, so every law was held against the force along the motion, both low-passed (below {bands} Hz), and judged by stretches that \
         were left out; numbers, errors and plots are those below {} Hz, and what no law explains there counts as noise",
        forces.corner_hz
    );
    Remark { weight: Weight::Note, records: Vec::new(), signal: String::new(), about: "band", text }
}

/// That a law that was found is the same force as another one.
fn of_same_force(text: &str) -> Remark {
    Remark { weight: Weight::Caution, records: Vec::new(), signal: String::new(), about: "same_force", text: text.to_string() }
}

/// Searches by simulation of the whole model.
fn by_simulation(
    problem: Problem,
    options: &Options,
    limit: Limit,
    report: &(dyn Fn(&str) + Sync),
    remarks: &mut Vec<Remark>,
) -> Result<(Problem, Search), SearchError> {
    let (problem, fewer) = thinned(problem);
    remarks.extend(fewer);
    let (problem, search) = with_inputs_as_they_run(problem, options, limit, report, remarks)?;
    report("fitting what could stand in its place");
    let mut search = with_contenders(&problem, search, &options.without, &Budget::new(tuning().experiment.contender_work, limit));
    hold_with_released_parameters(&problem, &mut search, limit);
    without_what_may_be_nothing(&problem, &mut search);
    Ok((problem, search))
}

/// Searches; where the recordings say that an input which the model file does not call held runs on between its samples, once more with it so. That is kept where it
/// explains them better.
fn with_inputs_as_they_run(
    problem: Problem,
    options: &Options,
    limit: Limit,
    report: &(dyn Fn(&str) + Sync),
    remarks: &mut Vec<Remark>,
) -> Result<(Problem, Search), SearchError> {
    let first = search(&problem, options, limit, report)?;
    let running: Vec<usize> = first.holds.iter().filter(|told| told.runs_on()).map(|told| told.input).collect();
    if running.is_empty() {
        return Ok((problem, first));
    }
    report("once more with inputs that run on between their samples");
    let other = hold::linear(&problem, &running);
    let again = search(&other, options, limit, report)?;
    let least = |search: &Search| {
        let all = search.found.iter().chain(std::iter::once(&search.nominal));
        all.map(|c| price(c, search.samples, first.nominal.correlation_time)).fold(f64::INFINITY, f64::min)
    };
    if least(&again) >= least(&first) {
        return Ok((problem, first));
    }
    for input in running {
        let signal = problem.model.inputs.get(input).map_or_else(String::new, |i| i.name.clone());
        let text = "runs linearly between its samples in these recordings, and is not held, which is the default. It was simulated so; set hold = \"linear\" in the \
                    model file"
            .to_string();
        remarks.push(Remark { weight: Weight::Caution, records: Vec::new(), signal, about: "hold", text });
    }
    Ok((other, again))
}

/// The latent force that the refitted nominal model needs.
fn located(problem: &Problem, search: &Search) -> Option<Location> {
    let nominal = &search.nominal;
    let model = nominal.structure.model(problem, &nominal.fit.values)?;
    let records = nominal.structure.with_unknown(problem, &problem.fit, &nominal.fit.values);
    let runs: Vec<locate::Run> = records.iter().map(locate::Run::from).collect();
    locate(&model, &runs, &search.noise_sd, &locate::Options::quick()).ok()
}
