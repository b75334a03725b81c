//! Re-simulation of the sessions: both levers with their diagnosed models, coupled by the law that was recovered, in the held-out records.
//!
//! Three ways, from the one that gives least to the one that gives most. The motion of a hand that is only a torque has to be integrated twice, so
//! the error of the friction makes it drift wherever no spring holds the levers. A hand is no torque, but a spring and a damper that are moved.

use super::environment::Environment;
use super::record::{ENDS, Record, mean};
use super::sessions::{Judged, laws_without};
use crate::StudyError;
use crate::table::Report;
use backdrive_plant::model::{Hold, Input, InputKind, Model, Output, OutputKind};
use backdrive_plant::stepper::{Options, Plant, Segment, simulate};
use backdrive_signal::derivative;
use backdrive_stability::coupling::{Law, Running, Seen};

/// Stiffness and damping of a hand at the arm of 75 mm, N m/rad and N m s/rad: the comfortable grasp of `plant/grips/normal.toml`
/// (Kuchenbecker and Niemeyer 2005), 400 N/m and 23 N s/m.
const GRIP: [f64; 2] = [400.0 * ARM * ARM, 23.0 * ARM * ARM];
/// m
const ARM: f64 = 0.075;
/// Share of the variance that is wanted.
const WANTED: f64 = 0.9;

/// The diagnosed levers: moved along their measured motion, they give the torque that was needed.
pub(super) struct Levers {
    pub(super) master: Model,
    pub(super) slave: Model,
}

/// A lever that is pushed, from one that is moved: its inertia and its elements, nothing of its sensors.
fn pushed(moved: &Model) -> Model {
    Model {
        inputs: vec![Input::ideal("torque", InputKind::Force, 0, Hold::Zero)],
        outputs: vec![Output {
            name: "position".to_string(),
            kind: OutputKind::Position(0),
            gain: 1.0,
            delay: 0.0,
            offset: 0.0,
            resolution: 0.0,
            noise: 0.0,
        }],
        axes: Vec::new(),
        ..moved.clone()
    }
}

/// The lever alone along its recorded motion: the torque that something had to push it with.
fn needed(lever: &Model, motion: &[f64], period_s: f64) -> Result<Vec<f64>, StudyError> {
    let alone = Model {
        inputs: vec![Input::ideal("position", InputKind::Motion, 0, Hold::Cubic)],
        outputs: vec![Output { kind: OutputKind::Reaction(0), ..pushed(lever).outputs[0].clone() }],
        axes: Vec::new(),
        ..lever.clone()
    };
    let mut told = simulate(&alone, &[motion], period_s, &Options::default()).map_err(|e| StudyError::Diagnosis(e.to_string()))?;
    Ok(told.pop().unwrap_or_default())
}

/// Who moves the master, and what the slave meets.
struct Given {
    /// Torque on the master besides its motor's, N m.
    hand: Vec<f64>,
    /// Stiffness and damping of the hand about the recorded motion; zero for a hand that is only a torque.
    grip: [f64; 2],
    /// `None` for the recorded torque.
    environment: Option<Environment>,
    /// Torque on the slave besides its motor's, N m, where it is as recorded; what its gauge is off by.
    contact: Vec<f64>,
    /// Whether the master is moved along its recorded motion.
    master_moved: bool,
}

/// Positions of both levers in the rows between the ends.
fn run(levers: &Levers, laws: &[Law; 2], record: &Record, given: &Given) -> Result<[Vec<f64>; 2], StudyError> {
    let failed = |e: &dyn std::fmt::Display| StudyError::Diagnosis(format!("{}: {e}", record.name));
    let period = record.period_s;
    let models = [pushed(&levers.master), pushed(&levers.slave)];
    let plant = |model: &Model| Plant::new(model, period, &Options::default()).map_err(|e| failed(&e));
    let (mut master, mut slave) = (plant(&models[0])?, plant(&models[1])?);
    let speeds = [derivative(&record.master, period), derivative(&record.slave, period)];
    let at = |column: &[f64], row: usize| column.get(row).copied().unwrap_or(0.0);
    master.set_motion(0, at(&record.master, ENDS), at(&speeds[0], ENDS));
    slave.set_motion(0, at(&record.slave, ENDS), at(&speeds[1], ENDS));
    let mut running = laws.each_ref().map(|law| Running::new(law, period));
    // The filters of speeds and the delays know what was before.
    for row in 0..ENDS {
        let seen = |own: &[f64], other: &[f64]| Seen { own: at(own, row), other: at(other, row), ..Seen::default() };
        running[0].step(seen(&record.master, &record.slave));
        running[1].step(seen(&record.slave, &record.master));
    }
    let (mut xm, mut xs) = (Vec::new(), Vec::new());
    for row in ENDS..record.master.len().saturating_sub(ENDS) {
        let m = if given.master_moved { at(&record.master, row) } else { master.position(0) };
        let s = slave.position(0);
        xm.push(m);
        xs.push(s);
        let motor = running[0].step(Seen { own: m, other: s, ..Seen::default() });
        let follows = running[1].step(Seen { own: s, other: m, ..Seen::default() });
        let [stiffness, damping] = given.grip;
        let hand = at(&given.hand, row) + stiffness * (at(&record.master, row) - m) + damping * (at(&speeds[0], row) - master.velocity(0));
        let meets = given.environment.map_or(0.0, |e| e.torque(s, slave.velocity(0)));
        if !given.master_moved {
            master.step(&[Segment::held(motor + hand)]);
        }
        slave.step(&[Segment::held(follows + meets + at(&given.contact, row))]);
    }
    Ok([xm, xs])
}

/// Share of the variance of a recorded signal that a simulated one follows; below zero where it does worse than a constant.
fn followed(simulated: &[f64], recorded: &[f64]) -> f64 {
    let left: Vec<f64> = simulated.iter().zip(recorded).map(|(a, b)| a - b).collect();
    let variance = |x: &[f64]| {
        let about = mean(x);
        mean(&x.iter().map(|v| (v - about).powi(2)).collect::<Vec<f64>>())
    };
    1.0 - variance(&left) / variance(recorded)
}

/// Re-simulation of the held-out records, three ways.
pub(super) fn again(report: &mut Report, records: &[Record], judged: &[Judged], levers: &Levers, hand_gain: f64) -> Result<(), StudyError> {
    let of_kind = |kind: &str| records.iter().filter(|r| r.name.starts_with("a_") && r.name.contains(kind)).collect::<Vec<&Record>>();
    let environments: Vec<(&str, Option<Environment>)> =
        ["spring", "foam", "rigid"].iter().map(|k| (*k, Environment::fit(&of_kind(k)))).collect();
    let mut results: Vec<(String, [f64; 4])> = Vec::new();
    for record in records.iter().filter(|r| !r.name.starts_with("a_")) {
        let Some(laws) = laws_without(judged, &record.name) else { continue };
        // A strain gauge has no zero of its own: in the mean, what pushed is what was needed.
        let sum = |a: &[f64], b: &[f64], gain: f64| a.iter().zip(b).map(|(a, b)| a + gain * b).collect::<Vec<f64>>();
        let zero = |needed: &[f64], pushed: &[f64]| {
            let inner = |x: &[f64]| mean(x.get(ENDS..x.len().saturating_sub(ENDS)).unwrap_or_default());
            inner(needed) - inner(pushed)
        };
        let hand: Vec<f64> = record.hand.iter().map(|f| f / hand_gain).collect();
        let master_zero = zero(&needed(&levers.master, &record.master, record.period_s)?, &sum(&record.master_motor, &hand, 1.0));
        let slave_needed = needed(&levers.slave, &record.slave, record.period_s)?;
        let slave_zero = zero(&slave_needed, &sum(&record.slave_motor, &record.contact, 1.0));
        let hand: Vec<f64> = hand.iter().map(|f| f + master_zero).collect();
        let contact: Vec<f64> = record.contact.iter().map(|f| f + slave_zero).collect();
        let kind = environments.iter().find(|(kind, _)| record.name.contains(kind));
        let environment = kind.and_then(|(_, e)| *e).and_then(|e| e.placed(record));
        let meets = environment.map(|e| e.along(record));
        let rest_zero = meets.map_or(slave_zero, |meets| zero(&slave_needed, &sum(&record.slave_motor, &meets, 1.0)));
        let rest = vec![rest_zero; record.contact.len()];
        // Where nothing is met the recorded torque is what there is: the gauge's noise.
        let outside = || if environment.is_some() { rest.clone() } else { contact.clone() };
        let inner = |x: &[f64]| x.get(ENDS..x.len().saturating_sub(ENDS)).unwrap_or_default().to_vec();
        let (xm, xs) = (inner(&record.master), inner(&record.slave));
        let torque = Given { hand: hand.clone(), grip: [0.0; 2], environment, contact: outside(), master_moved: false };
        let grip = Given { hand: hand.clone(), grip: GRIP, environment, contact: outside(), master_moved: false };
        let moved = Given { hand, grip: [0.0; 2], environment: None, contact, master_moved: true };
        let strict = run(levers, &laws, record, &torque)?;
        let held = run(levers, &laws, record, &grip)?;
        let behind = run(levers, &laws, record, &moved)?;
        let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        let values = [
            followed(&strict[0], &xm),
            followed(&held[0], &xm),
            followed(&behind[1], &xs),
            followed(&difference(&behind[0], &behind[1]), &difference(&xm, &xs)),
        ];
        results.push((record.name.clone(), values));
    }
    told(report, &results);
    for (kind, environment) in environments.iter().filter_map(|(k, e)| Some((k, (*e)?))) {
        report.line(
            &format!("environment {kind}, from the records with gains a"),
            format!("{:.2} N m/rad, {:.1} mN m s/rad", environment.stiffness, 1e3 * environment.damping),
            "unpublished",
            "least squares where it is touched",
            None,
        );
    }
    Ok(())
}

fn told(report: &mut Report, results: &[(String, [f64; 4])]) {
    let ways: [(&str, &str, bool); 4] = [
        (
            "master, hand a torque",
            "run again, the hand only its recorded torque, the environment a spring: of the master's variance followed",
            true,
        ),
        ("master, hand a grip", "the same, the hand a comfortable grip (400 N/m) about what it wanted: of the master's variance", true),
        ("slave behind the master", "the slave behind the recorded master: of the slave's variance", true),
        ("difference behind the master", "the slave behind the recorded master: of the variance of the difference of the positions", false),
    ];
    for (i, (figure, what, has_bar)) in ways.iter().enumerate() {
        let all: Vec<f64> = results.iter().filter_map(|r| r.1.get(i).copied()).collect();
        let enough = all.iter().filter(|v| **v >= WANTED).count();
        let mut sorted = all.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN);
        report.figure(&format!("followed: {figure}"), median);
        report.figure(&format!("followed enough: {figure}"), enough as f64 / all.len().max(1) as f64);
        report.line(
            what,
            format!("median {:.1} %; at least {:.0} % in {enough} of {}", 100.0 * median, 100.0 * WANTED, all.len()),
            "at least 90 %",
            "wanted, in records that no fit has seen",
            has_bar.then_some(enough == all.len()),
        );
    }
    let each: Vec<String> =
        results.iter().map(|(name, v)| format!("{name}: {}", v.map(|v| format!("{:.1}", 100.0 * v)).join(", "))).collect();
    report.notes.push(format!("Variance followed of each record, in percent, in the order of these four lines. {}.", each.join("; ")));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lever() -> Model {
        Model::from_toml(
            "name = 'lever'\nmotion = 'rotation'\n[bodies]\nlever = 1.0e-3\n[[elements]]\nname = 'bearing'\nkind = 'damper'\nbetween = ['lever', 'ground']\n\
             damping = 0.01\n[[elements]]\nname = 'dry'\nkind = 'coulomb'\nbetween = ['lever', 'ground']\nforce = 0.02\n[[inputs]]\nname = 'position'\n\
             kind = 'motion'\non = 'lever'\n[[outputs]]\nname = 'torque'\nkind = 'reaction'\nof = 'lever'\n",
            "lever.toml",
        )
        .unwrap()
    }

    #[test]
    fn a_session_that_was_made_with_these_levers_and_laws_is_followed_whole() {
        let levers = Levers { master: lever(), slave: lever() };
        let law = |stiffness: f64| Law {
            terms: vec![
                (backdrive_stability::coupling::Term::Position, stiffness),
                (backdrive_stability::coupling::Term::Rate, 0.006 * stiffness),
            ],
            offset: 0.0,
            filter_s: 1.2e-3,
            delay_s: 0.0,
            force_delay_s: 0.0,
            sure_speed: 1e-3,
            limit: None,
        };
        let n = 6000;
        let t = |row: usize| row as f64 * 5e-4;
        let spring = Environment { stiffness: 3.0, damping: 0.01, place: -0.02 };
        let blank = Record {
            name: "b_spring".to_string(),
            period_s: 5e-4,
            master: vec![0.0; n],
            slave: vec![0.0; n],
            hand: (0..n).map(|row| 0.2 * (5.0 * t(row)).sin()).collect(),
            contact: vec![0.0; n],
            master_motor: vec![0.0; n],
            slave_motor: vec![0.0; n],
        };
        let given =
            || Given { hand: blank.hand.clone(), grip: [0.0; 2], environment: Some(spring), contact: Vec::new(), master_moved: false };
        let laws = [law(15.0), law(15.0)];
        let [xm, xs] = run(&levers, &laws, &blank, &given()).unwrap();
        let padded = |x: &[f64]| [vec![0.0; ENDS], x.to_vec(), vec![0.0; ENDS]].concat();
        let recorded = Record { master: padded(&xm), slave: padded(&xs), ..blank.clone() };
        // With a grip about the same motion nothing changes, and a softer coupling is seen.
        let held = run(&levers, &laws, &recorded, &Given { grip: GRIP, ..given() }).unwrap();
        assert!(followed(&held[0], &xm) > 0.999, "{}", followed(&held[0], &xm));
        let soft = run(&levers, &[law(0.5), law(0.5)], &recorded, &given()).unwrap();
        assert!(followed(&soft[0], &xm) < 0.98, "{}", followed(&soft[0], &xm));
        // What was needed to move the master as it moved is what moved it: the hand and the motor, in the mean of a whole period.
        let pushes = needed(&levers.master, &recorded.master, 5e-4).unwrap();
        assert!(pushes.iter().all(|f| f.is_finite()) && pushes.len() == n);
    }
}
