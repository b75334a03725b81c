//! Joints whose truth is known: what is found of them, what is not claimed, and what is refused.

use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::verdict::Word;
use backdrive_plant::model::Model;
use backdrive_plant::servo::{Number, Numbers};
use backdrive_servo::diagnose::diagnose;
use backdrive_servo::problem::{Joint, Problem};
use backdrive_servo::record::Record;
use backdrive_servo::simulate::simulate;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

const STEP: f64 = 2.0 * std::f64::consts::PI / 4096.0;

fn base() -> Numbers {
    let mut n = Numbers::default();
    n[Number::Delay] = 0.015;
    n[Number::Inertia] = 9e-4;
    n[Number::Damping] = 0.06;
    n[Number::Offset] = 0.004;
    n
}

/// Six motions of 20 s at 50 Hz: sums of sines, ramps and steps.
fn commands() -> Vec<Vec<f64>> {
    let sines = |seed: f64| {
        move |t: f64| {
            let one = |a: f64, f: f64, p: f64| a * ((std::f64::consts::TAU * f * t + p).sin() - p.sin());
            one(0.25, 0.21 + 0.05 * seed, seed) + one(0.12, 0.73 + 0.03 * seed, 2.0 * seed) + one(0.05, 1.41, 3.0 * seed)
        }
    };
    let ramps = |t: f64| 0.2 * (2.0 * (t / 10.0 - (t / 10.0 + 0.5).floor())).abs() - 0.05;
    let steps = |t: f64| [0.0, 0.1, -0.2, 0.5, 0.3, -0.4, 0.0, 0.8][(t / 2.5) as usize % 8];
    let at = |of: &dyn Fn(f64) -> f64| (0..1000).map(|i| of(0.02 * f64::from(i))).collect::<Vec<f64>>();
    vec![at(&sines(1.0)), at(&sines(2.0)), at(&ramps), at(&steps), at(&sines(3.0)), at(&|t| 1.5 * ramps(t + 1.0))]
}

/// The joint as an encoder measures it; finer substeps than any fit takes.
fn joint(numbers: &Numbers) -> Joint {
    let record = |(i, command): (usize, Vec<f64>)| {
        let t: Vec<f64> = (0..command.len()).map(|i| 0.02 * i as f64).collect();
        let start = command[0] + numbers[Number::Offset];
        let mut record = Record { name: format!("{i}.csv"), position: vec![start; t.len()], t, command, gravity: Vec::new() };
        record.position = simulate(numbers, &record, 40).iter().map(|q| (q / STEP).round() * STEP).collect();
        record
    };
    let mut fit: Vec<Record> = commands().into_iter().enumerate().map(record).collect();
    let held_out = fit.split_off(5);
    Joint { name: "elbow".to_string(), fit, held_out, given: None, is_weighed: false }
}

fn problem(joint: Joint) -> Problem {
    Problem { model: Model { name: "test".to_string(), ..Model::default() }, joints: vec![joint], notes: Vec::new() }
}

#[test]
fn a_joint_without_anything_has_no_finding() {
    let found = diagnose(&problem(joint(&base())), &Options::default(), None, &|_| ()).unwrap();
    let named: Vec<&str> = found.verdict.findings.iter().map(|f| f.physics.as_str()).collect();
    assert!(named.is_empty(), "{named:?}");
    let numbers = found.model.servos[0].numbers;
    assert!((numbers[Number::Delay] - 0.015).abs() < 3e-3 && (numbers[Number::Damping] - 0.06).abs() < 5e-3, "{numbers:?}");
    let errors = found.verdict.servo.unwrap().joints[0].errors;
    assert!(errors.diagnosed.unwrap() < 0.02, "{errors:?}");
}

#[test]
fn dry_friction_is_found_with_its_size_and_its_rival_is_named() {
    let mut truth = base();
    truth[Number::Friction] = 0.02;
    let found = diagnose(&problem(joint(&truth)), &Options::default(), None, &|_| ()).unwrap();
    let first = &found.verdict.findings[0];
    assert!(first.physics == "coulomb" && first.confidence < 0.9, "{first:?}");
    assert!((found.model.servos[0].numbers[Number::Friction] - 0.02).abs() < 0.003, "{:?}", found.model.servos[0].numbers);
    let after = found.verdict.servo.as_ref().unwrap().joints[0].errors;
    assert!(after.diagnosed.unwrap() < 0.5 * after.refit.unwrap(), "{after:?}");
    let text = found.model.to_toml();
    assert_eq!(Model::from_toml(&text, "model").unwrap().servos, found.model.servos, "{text}");
}

#[test]
fn dry_friction_and_a_limit_of_the_torque_are_found_together() {
    let mut truth = base();
    truth[Number::Friction] = 0.03;
    truth[Number::Limit] = 0.08;
    let found = diagnose(&problem(joint(&truth)), &Options::default(), None, &|_| ()).unwrap();
    let added = &found.answers[0].found.best.added;
    assert!(added.contains(&"coulomb") && added.contains(&"saturation"), "{added:?}");
    let numbers = found.model.servos[0].numbers;
    assert!((numbers[Number::Friction] - 0.03).abs() < 0.003, "{numbers:?}");
    // Delay, damping and limit share what the limit slows down; the top speed is determined.
    let top = |n: &Numbers| (n[Number::Limit] - n[Number::Friction]) / n[Number::Damping];
    assert!((top(&numbers) / top(&truth) - 1.0).abs() < 0.02, "{numbers:?}");
}

#[test]
fn a_search_that_is_cut_short_says_so_and_gives_no_green_answer() {
    let mut truth = base();
    truth[Number::Friction] = 0.02;
    let stop = AtomicBool::new(true);
    let impatient = Options { patience: Some(Duration::ZERO), ..Options::default() };
    for (options, stop, why) in [(Options::default(), Some(&stop), "interrupted"), (impatient, None, "--patience")] {
        let found = diagnose(&problem(joint(&truth)), &options, stop, &|_| ()).unwrap();
        assert_eq!(found.verdict.word, Word::CannotTell);
        assert!(found.verdict.searched.is_some_and(|s| s.cut_short) && found.notes.iter().any(|n| n.contains(why)));
    }
}

#[test]
fn a_joint_that_rests_under_a_load_does_not_creep() {
    let mut numbers = base();
    numbers[Number::Friction] = 0.05;
    numbers[Number::MomentCos] = 0.03;
    let t: Vec<f64> = (0..1000).map(|i| 0.02 * f64::from(i)).collect();
    let record = Record { name: "rest".to_string(), command: vec![0.0; 1000], position: vec![0.0; 1000], t, gravity: Vec::new() };
    let simulated = simulate(&numbers, &record, 3);
    assert!(simulated.iter().all(|q| *q == 0.0), "{:?}", simulated.last());
}

#[test]
fn a_motion_that_repeats_itself_is_not_taken_for_a_late_one() {
    let mut joint = joint(&base());
    for record in joint.fit.iter_mut().chain(&mut joint.held_out) {
        record.t = (0..4000).map(|i| 0.02 * f64::from(i)).collect();
        record.command = record.t.iter().map(|t| 0.3 * (1.7 * t).sin()).collect();
        record.position = vec![0.0; 4000];
        record.position = simulate(&base(), record, 40);
    }
    assert_eq!(backdrive_servo::inputs::looked_at(&joint).unwrap(), backdrive_servo::inputs::Use::Good);
}

fn refused(change: impl Fn(&mut Record)) -> String {
    let mut joint = joint(&base());
    joint.fit.iter_mut().chain(&mut joint.held_out).for_each(change);
    diagnose(&problem(joint), &Options::default(), None, &|_| ()).map(|f| f.verdict.sentence).unwrap_err().to_string()
}

#[test]
fn what_is_no_command_is_refused_in_one_sentence() {
    let equal = refused(|r| r.command.clone_from(&r.position));
    assert!(equal.contains("is the position itself"), "{equal}");
    let ahead = refused(|r| {
        let last = *r.position.last().unwrap();
        r.command = r.position[1..].iter().copied().chain([last]).collect();
    });
    assert!(ahead.contains("position of 1 samples later"), "{ahead}");
    let constant = refused(|r| r.command.fill(0.3));
    assert!(constant.contains("its command is constant"), "{constant}");
    let still = refused(|r| r.position.fill(0.3));
    assert!(still.contains("never moves"), "{still}");
    let degrees = refused(|r| r.command.iter_mut().for_each(|c| *c = c.to_degrees()));
    assert!(degrees.contains("it is in degrees"), "{degrees}");
    let velocity = refused(|r| {
        let next = r.command[1..].iter().copied().chain([*r.command.last().unwrap()]).collect::<Vec<f64>>();
        r.command = next.iter().zip(&r.command).map(|(b, a)| (b - a) / 0.02).collect();
    });
    assert!(velocity.contains("is a goal velocity"), "{velocity}");
    let late = refused(|r| r.command.rotate_right(150));
    assert!(late.contains("lags the position") || late.contains("lags by more than that"), "{late}");
    for message in [equal, constant, still, degrees, velocity, late] {
        assert!(!message.contains('\n') && message.len() < 300, "{message}");
    }
}
