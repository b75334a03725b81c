//! One call from logs of an arm to a verdict and its files.

use crate::arms::audit::audit;
use crate::arms::consistent::consistent;
use crate::arms::coupled::coupled_by_many;
use crate::arms::drawn::{Drawn, drawn};
use crate::arms::error::ArmError;
use crate::arms::excitation::RATE;
use crate::arms::experiment::{Plan, REPEATS, plan};
use crate::arms::fit::Fit;
use crate::arms::judge::{AGAINST, Judged, each, gains, judge};
use crate::arms::place::place;
use crate::arms::problem::Problem;
use crate::arms::regression::Data;
use crate::arms::search::{MOST, Search, search};
use crate::arms::verdict::{Parts, verdict};
use crate::arms::weighing::{added, rare};
use crate::arms::written::{Reading, model_of};
use crate::audit::Weight;
use crate::hypothesis::Place;
use crate::options::Options;
use crate::verdict::{NextExperiment, Planned, PlannedPayload, Remark, Verdict};
use backdrive_plant::model::Model;
use std::sync::atomic::AtomicBool;

/// Name of the file of the next experiment.
pub const EXPERIMENT_FILE: &str = "next-motion.csv";

/// An effect that was fitted in full in a round of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Its name.
    pub physics: String,
    /// Where.
    pub place: Place,
    /// By how much it raised twice the log evidence.
    pub worth: f64,
    /// By how much better it predicted held-out segments, in standard errors of that; `None` where this is not known.
    pub unseen: Option<f64>,
    /// Whether it was taken up in that round.
    pub taken: bool,
}

/// What was found, as a file and as texts of files.
#[derive(Debug, Clone)]
pub struct Found {
    /// The verdict.
    pub verdict: Verdict,
    /// The diagnosed model.
    pub model: String,
    /// The motion to record next, as CSV.
    pub experiment: String,
    /// What a reader should know besides.
    pub notes: Vec<String>,
    /// What the search tried, in its order.
    pub tried: Vec<Tried>,
    /// Curves for a report.
    pub drawn: Drawn,
}

/// Diagnoses an arm. Once `stop` is set, or the patience that was asked for ends, the search ends with what was found until then, and the verdict states
/// this; `report` hears what is being done.
///
/// # Errors
/// Where a log is of no use, or the robot cannot be computed.
pub fn diagnose(
    problem: &Problem,
    options: &Options,
    stop: Option<&AtomicBool>,
    report: &(dyn Fn(&str) + Sync),
) -> Result<Found, ArmError> {
    let limit = options.limit_as_asked(stop);
    let most = options.effects.unwrap_or(MOST);
    report("looking at the logs of the arm");
    let mut data = Data::new(problem, options.corner_hz, false)?;
    let mut remarks = audit(problem, &data);
    if let Some(bad) = remarks.iter().find(|r| r.weight == Weight::Unusable) {
        return Err(ArmError::Log { log: bad.place.clone(), message: bad.message.clone() });
    }
    report("diagnosing the arm");
    let mut found = search(&mut data, &without(options), most, limit)?;
    let cut_short = limit.is_over();
    remarks.extend(load_remarks(&data, &found));
    let mut whole = Data::new(problem, options.corner_hz, true)?;
    for fit in [&mut found.as_given, &mut found.refit, &mut found.best] {
        *fit = consistent(&data, fit, &found.weights).ok_or_else(|| {
            ArmError::Robot("no physically feasible inertial parameters were found near those of the regression".to_string())
        })?;
    }
    whole.see(&data.parameters(&found.best))?;
    for fit in [&mut found.as_given, &mut found.refit, &mut found.best] {
        slip_of_whole(&whole, fit);
    }
    let (model, mut notes) = model_of(&data, &found.best)?;
    let (nominal, _) = model_of(&data, &found.refit)?;
    notes.extend(problem.notes.iter().cloned().chain(data.notes_along()));
    report("simulating the arm in closed loop");
    let gains = gains(&data, &model).unwrap_or_default();
    let simulated = |model: &Model, fit: &Fit| judge(&data, model, &Reading::of(&data, fit), &gains);
    let loops = [simulated(&nominal, &found.refit), simulated(&model, &found.best)];
    // Each is a fit and a simulation more: an interrupted diagnosis ends without them.
    let judged = match cut_short {
        true => vec![None; added(&found.best.structure).len()],
        false => each(&data, &found, &gains, loops[1].as_ref()),
    };
    for (index, judged) in added(&found.best.structure).into_iter().zip(&judged) {
        let Some(ratio) = judged.as_ref().map(Judged::ratio).filter(|r| *r > AGAINST) else { continue };
        let term = &found.best.structure.terms[index];
        notes.push(format!(
            "in closed-loop simulation the model needs {:.0} % more correction with {} {} than without it, so the finding is not claimed",
            100.0 * (ratio - 1.0),
            term.physics.facts().words,
            crate::verdict::words::place(&place(&data, term))
        ));
    }
    notes.extend(coupled_by_many(problem, &found.best.structure));
    if data.most_tolerance == 0 {
        notes.push(format!(
            "{} has no motor, so its friction is known only relative to its inertia. Much of another joint's torque is unexplained, so \
             the file's inertia is used",
            problem.passive().join(", ")
        ));
    }
    if cut_short {
        let by = if limit.was_stopped() { "interrupted" } else { "cut off by the clock (--patience)" };
        notes.push(format!("the search was {by}: other missing effects were not fully searched for"));
    }
    if rare(&found.best.structure) >= most {
        notes.push(format!(
            "the search ended at {} effects, the limit of --effects, besides those of every joint: more may be missing",
            most
        ));
    }
    report("planning the next motion");
    let plan = plan(&data, &found)?;
    let next = next(&plan, problem);
    let drawn = drawn(&data, &whole, &found, &plan.excitation);
    let tried = found.tried.iter().map(|t| tried_of(&data, t)).collect();
    let verdict =
        verdict(Parts { data: &data, whole: &whole, search: &found, audit: remarks, loops, judged, next: Some(next), cut_short })?;
    Ok(Found { verdict, model: model.to_toml(), experiment: plan.excitation.csv(problem), notes, tried, drawn })
}

/// Effects that are not to be considered, with those that contain them as a special case.
fn without(options: &Options) -> Vec<String> {
    let mut out = options.without.clone();
    if options.without.iter().any(|name| name == "coulomb") {
        // Both are dry friction of one level in a limit of their shape: no displacement, or far higher speeds than occur.
        out.extend(["dahl", "stribeck"].map(str::to_string));
    }
    out
}

fn tried_of(data: &Data, tried: &crate::arms::search::Tried) -> Tried {
    Tried {
        physics: tried.term.physics.facts().name.to_string(),
        place: place(data, &tried.term),
        worth: tried.worth,
        unseen: tried.gain.map(|g| g.in_errors()),
        taken: tried.taken,
    }
}

/// The displacement over which friction turns, of rows at rest too: there it shows.
fn slip_of_whole(whole: &Data, fit: &mut Fit) {
    for joint in 0..whole.problem.joints.len() {
        let left = |fit: &Fit| whole.mean_square(&whole.residual_of(fit), joint, false);
        let first = whole.first_slip(joint);
        let mut best = (left(fit), fit.structure.slip[joint]);
        for step in -4..=5 {
            let slip = first * 2f64.powi(step);
            let mut other = fit.clone();
            other.structure.slip[joint] = slip;
            let there = left(&other);
            if there < best.0 {
                best = (there, slip);
            }
        }
        fit.structure.slip[joint] = best.1;
    }
}

/// Joints whose load hardly changes: load-dependent friction cannot be distinguished from friction that does not depend on load.
fn load_remarks(data: &Data, found: &Search) -> Vec<Remark> {
    let remark = |j: usize| Remark {
        what: "load".to_string(),
        place: data.problem.joints[j].clone(),
        message: "carries nearly the same load everywhere: these logs do not show whether its friction grows with the load; the next \
                  motion is planned to show it"
            .to_string(),
        weight: Weight::Caution,
    };
    (0..data.problem.joints.len()).filter(|j| found.under_one_load.contains(j)).map(remark).collect()
}

fn next(plan: &Plan, problem: &Problem) -> NextExperiment {
    let seconds = plan.excitation.seconds;
    let mut sentence = format!("Track {EXPERIMENT_FILE} {REPEATS} times");
    let mut payload = None;
    if let Some((link, known)) = &plan.payload {
        let [x, y, z] = [known.at.x, known.at.y, known.at.z];
        let link = problem.robot.links.get(*link).map_or(String::new(), |l| l.name.clone());
        sentence += &format!(
            " with {} kg fastened to link \"{link}\", its centre at ({x}, {y}, {z}) m of that link's frame, and state it for each of the \
             logs in the set ([files.\"LOG.csv\"] payload = {{ mass = {}, at = [{x:?}, {y:?}, {z:?}] }})",
            known.mass, known.mass
        );
        payload = Some(Box::new(PlannedPayload { mass_kg: known.mass, at_m: [x, y, z], link }));
    }
    sentence += ", and hold one of them out. ";
    let passive = problem.passive();
    if !passive.is_empty() {
        sentence += &format!("It moves the joints with a motor; leave {} free, and log its position. ", passive.join(", "));
    }
    let between: Vec<String> = plan.between.iter().map(|[a, b]| format!("{a} from {b}")).collect();
    sentence += &match (plan.separation, plan.without_payload) {
        (Some(apart), without) => {
            let without = without.map_or(String::new(), |w| format!(" (without the payload by {w:.1})"));
            let little = if apart < 3.0 { "; that is little, so repeat the motion more often" } else { "" };
            let apart = if apart > 100.0 {
                "more than 100 standard deviations".to_string()
            } else {
                format!("{apart:.1} standard deviations or more")
            };
            format!("Of the random motions tried it separates best {}: by {apart}{without}{little}.", between.join(", and "))
        }
        (None, _) => format!(
            "Of the random motions tried it determines the inertial parameters and friction best (condition of the regressor {:.0}).",
            plan.excitation.condition
        ),
    };
    NextExperiment::Planned(Planned {
        file: EXPERIMENT_FILE.to_string(),
        input: if passive.is_empty() { "all joints" } else { "all joints with a motor" }.to_string(),
        excitation: format!("Fourier series of 5 harmonics, {seconds} s a period, within the joints' limits"),
        sentence,
        between: if between.is_empty() { problem.joints.clone() } else { plan.between.iter().flatten().cloned().collect() },
        separation_sd: plan.separation.map(|s| (s * 10.0).round() / 10.0),
        level_floors: None,
        output: "torque of every joint".to_string(),
        repeats: REPEATS,
        duration_s: Some(seconds),
        rate_hz: RATE,
        sensor: None,
        payload,
    })
}
