//! The next experiment: of the motions that were drawn the one with the most information on what the logs leave open, with a known payload where it
//! takes one.
//!
//! A question has an answer, the structure that was found, and a rival. The torque that the answer's own term makes along a motion is what the rival has
//! to compensate with all its parameters, which are known as well as logs and motion together determine them. The part that it cannot compensate, in
//! standard deviations of the residuals, is the separation. It is the noncentrality of Atkinson & Fedorov (The design of experiments for discriminating
//! between two rival models, Biometrika 62(1), 1975) for models that are linear in their parameters.

use crate::arms::error::ArmError;
use crate::arms::excitation::{Excitation, draw};
use crate::arms::fit::{Structure, Weights};
use crate::arms::gram::Gram;
use crate::arms::log::Log;
use crate::arms::one_load::{ENOUGH, Exchanged, exchanged};
use crate::arms::physics::{At, Physics, Term, several_payloads};
use crate::arms::place::place;
use crate::arms::problem::Problem;
use crate::arms::regression::Data;
use crate::arms::search::Search;
use crate::arms::sure::ALIKE;
use crate::arms::weighing::added;
use crate::verdict::words as said;
use backdrive_plant::robot::Payload;
use nalgebra::Vector3;

/// Motions that are evaluated in detail, those that show the inertial parameters best.
const CLOSELY: usize = 12;
/// Rate at which they are evaluated, Hz.
const RATE: f64 = 50.0;
/// Times that the motion is to be recorded; one of them is held out.
pub const REPEATS: u32 = 3;
/// How many times as far a payload has to bring explanations apart to be worth fastening it.
const WORTH: f64 = 1.5;
/// The payload that is asked for, as a share of the last body's mass.
const PAYLOAD: f64 = 0.3;
/// Torque that a motion may take, in times of what the logs show, where the file has no limit.
const ABOVE_LOGS: f64 = 1.5;
/// What logs leave open.
#[derive(Debug, Clone)]
struct Question {
    /// The terms of the answer that the rival does without, with their parameters.
    terms: Vec<(Term, Vec<f64>)>,
    /// The rival.
    rival: Structure,
    /// Both in words.
    between: [String; 2],
}

/// What to record next.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The motion.
    pub excitation: Excitation,
    /// The pairs that it separates, question by question; empty where nothing is open.
    pub between: Vec<[String; 2]>,
    /// By how much it separates what it separates least, standard deviations, with all that is recorded but one playing.
    pub separation: Option<f64>,
    /// The same without a payload, where one is asked for.
    pub without_payload: Option<f64>,
    /// The payload that is asked for, with the index of its link.
    pub payload: Option<(usize, Payload)>,
}

/// For each joint with friction that is of one level, or in proportion to the load, but not both: the question whether it is the other one, where the
/// logs do not decide it.
fn of_load(data: &Data, search: &Search) -> Vec<(usize, Question)> {
    let best = &search.best;
    let of_joint = |j: usize| {
        let Exchanged { index, rival } = exchanged(data, best, &search.weights, j)?;
        let between = [named(data, &best.structure.terms[index]), named(data, &rival.terms[index])];
        let terms = vec![(best.structure.terms[index].clone(), best.values[best.places[index].clone()].to_vec())];
        Some((j, Question { terms, rival, between }))
    };
    (0..data.problem.joints.len()).filter_map(of_joint).collect()
}

fn named(data: &Data, term: &Term) -> String {
    format!("{} {}", term.physics.facts().words, said::place(&place(data, term)))
}

/// What is open: rivals that score nearly as well, and friction under a load that does not change.
fn questions(data: &Data, search: &Search) -> Vec<Question> {
    let best = &search.best;
    let of = |index: usize| (best.structure.terms[index].clone(), best.values[best.places[index].clone()].to_vec());
    let mut out = Vec::new();
    for (order, index) in added(&best.structure).into_iter().enumerate() {
        for rival in search.rivals.get(order).into_iter().flatten().filter(|r| r.above < ALIKE) {
            let between = [named(data, &best.structure.terms[index]), named(data, &rival.term)];
            out.push(Question { terms: vec![of(index)], rival: rival.structure.clone(), between });
        }
    }
    for (_, question) in of_load(data, search) {
        if !out.iter().any(|q| q.between == question.between) {
            out.push(question);
        }
    }
    if out.is_empty() && best.structure.tolerance >= 2 && !several_payloads(&data.motions[..data.fit_count]) {
        // Where inertial parameters are as free as that, all torques may be read by a wrong factor as well.
        let terms = vec![(Term::new(Physics::Gain, At::Base, Vec::new()), vec![0.05])];
        let between = ["all torque constants wrong by 5 %".to_string(), "all masses wrong by 5 %".to_string()];
        out.push(Question { terms, rival: best.structure.clone(), between });
    }
    out
}

/// Plans it.
///
/// # Errors
/// Where the robot cannot be computed.
pub fn plan(data: &Data, search: &Search) -> Result<Plan, ArmError> {
    let problem = data.problem;
    let drawn = draw(problem, &largest_torque(problem))?;
    let questions = questions(data, search);
    let logs: Vec<Option<Gram>> = questions.iter().map(|q| data.gram(&q.rival, &q.terms, &search.weights, 1.0)).collect();
    let payload = payload_of(data, search);
    let mut best: [Option<(f64, usize)>; 2] = [None, None];
    let close = if questions.is_empty() { 0 } else { CLOSELY };
    for (number, excitation) in drawn.iter().enumerate().take(close) {
        for (loaded, there) in best.iter_mut().enumerate() {
            if loaded == 1 && payload.is_none() {
                continue;
            }
            let carried = payload.clone().filter(|_| loaded == 1);
            let separation = separation(data, search, excitation, carried, &questions, &logs)?;
            if there.is_none_or(|(s, _)| separation > s) {
                *there = Some((separation, number));
            }
        }
    }
    let between = questions.into_iter().map(|q| q.between).collect();
    let plan = |number: usize, separation, without_payload, payload| Plan {
        excitation: drawn[number].clone(),
        between,
        separation,
        without_payload,
        payload,
    };
    Ok(match best {
        [Some((plain, _)), Some((loaded, number))] if plain < ENOUGH && loaded > WORTH * plain => {
            plan(number, Some(loaded), Some(plain), payload)
        }
        [Some((plain, number)), _] => plan(number, Some(plain), None, None),
        _ => plan(0, None, None, None),
    })
}

/// By how much a motion separates what it separates least.
fn separation(
    data: &Data,
    search: &Search,
    excitation: &Excitation,
    payload: Option<(usize, Payload)>,
    questions: &[Question],
    logs: &[Option<Gram>],
) -> Result<f64, ArmError> {
    let planned = as_logged(data.problem, excitation, payload);
    let mut new = Data::new(&planned, Some(data.rates.corner), false)?;
    new.see(&data.seen)?;
    new.fill_torque(&search.best);
    let rows = data.rates.row_period() / new.rates.row_period();
    // What scatters stays as long, whatever the rate of the rows.
    let weights = Weights { sd: search.weights.sd.clone(), time: search.weights.time.iter().map(|t| (t * rows).max(1.0)).collect() };
    let mut least = f64::INFINITY;
    for (question, old) in questions.iter().zip(logs) {
        let there = new.gram(&question.rival, &question.terms, &weights, f64::from(REPEATS - 1));
        let (Some(old), Some(there)) = (old, there) else { continue };
        least = least.min((old.with(&there).left() - old.left()).max(0.0).sqrt());
    }
    Ok(if least.is_finite() { least } else { 0.0 })
}

/// The problem whose only log is the planned motion; its torque is still to be filled in.
fn as_logged(problem: &Problem, excitation: &Excitation, payload: Option<(usize, Payload)>) -> Problem {
    let motion = excitation.motion(problem, RATE);
    let log = Log {
        name: "planned".to_string(),
        t: (0..motion.len()).map(|i| i as f64 / RATE).collect(),
        velocity: vec![None; motion.position.len()],
        torque: vec![vec![0.0; motion.len()]; motion.position.len()],
        position: motion.position,
        payload,
    };
    Problem { fit: vec![log], held_out: Vec::new(), ..problem.clone() }
}

/// Of each joint the torque that a motion may take: what the file allows, else somewhat more than the logs show.
fn largest_torque(problem: &Problem) -> Vec<f64> {
    let of = |(j, coordinate): (usize, &backdrive_plant::robot::Coordinate)| {
        let effort = problem.robot.joints.get(coordinate.joint).and_then(|joint| joint.limits.effort).filter(|e| *e > 0.0);
        let shown = problem.fit.iter().chain(&problem.held_out).flat_map(|l| l.torque[j].iter()).fold(0.0f64, |m, x| m.max(x.abs()));
        effort.map_or(ABOVE_LOGS * shown, |e| 0.9 * e)
    };
    problem.tree.coordinates().iter().enumerate().map(of).collect()
}

/// A mass that is a good share of the last body's, at the tip or, where the file has none, at the body's centre of mass.
fn payload_of(data: &Data, search: &Search) -> Option<(usize, Payload)> {
    let bodies = &data.problem.bodies;
    let body = *data.parameters(&search.best).last()?;
    let link = *bodies.link.last()?;
    let wanted = PAYLOAD * body[0];
    if !(wanted.is_finite() && wanted > 0.0) {
        return None;
    }
    let digit = 10f64.powf(wanted.log10().floor() - 1.0);
    let mass = (wanted / digit).round() * digit;
    let at = bodies.tip.unwrap_or_else(|| Vector3::new(body[1], body[2], body[3]) / body[0]).map(|x| (x * 1e3).round() / 1e3);
    Some((link, Payload { mass, at, link: None }))
}
