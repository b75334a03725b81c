//! Arms whose torque is known: what is in their logs is found, at its joint, with its size; nothing is found where nothing is.

use crate::common::{AS_STATED, Beside, set};
use backdrive_diagnosis::arms::diagnose::{Found, diagnose};
use backdrive_diagnosis::arms::judge::{AGAINST, each, gains, judge};
use backdrive_diagnosis::arms::physics::{At, Physics};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::regression::Data;
use backdrive_diagnosis::arms::search::{Search, search};
use backdrive_diagnosis::arms::weighing::added;
use backdrive_diagnosis::arms::written::{Reading, model_of};
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::output_error::work::Limit;
use backdrive_diagnosis::verdict::{Finding, Parameter, Word};
use backdrive_plant::model::Model;
use backdrive_plant::set::RecordingSet;
use rand::{RngExt, SeedableRng};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

fn found(beside: &Beside) -> Found {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), beside, "", |_| {});
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    diagnose(&problem, &Options::default(), None, &|_| ()).unwrap()
}

fn number(finding: &Finding, key: &str) -> (f64, f64, f64) {
    match &finding.parameters[key] {
        Parameter::One(e) => (e.value, e.ci95[0].unwrap(), e.ci95[1].unwrap()),
        Parameter::List(_) => panic!("{key} is a list"),
    }
}

#[test]
fn where_nothing_is_missing_nothing_is_found() {
    let found = found(&AS_STATED);
    assert!(found.verdict.findings.is_empty() && found.verdict.word.is_structure_right(), "{:?}", found.verdict);
    // The file of the diagnosed model reads, and has its robot.
    assert!(Model::from_toml(&found.model, "diagnosed").unwrap().arm.is_some());
}

#[test]
fn dry_friction_is_named_at_its_joint() {
    let found = found(&Beside { dry: [0.2, 0.3], ..AS_STATED });
    let [finding] = found.verdict.findings.as_slice() else { panic!("{:?}", found.verdict.findings) };
    assert_eq!((found.verdict.word, finding.physics.as_str()), (Word::Missing, "coulomb"));
    assert_eq!(finding.place, Place::Between("elbow".to_string(), "ground".to_string()));
    let (value, low, high) = number(finding, "force");
    assert!((value - 0.3).abs() < 0.01 && low < 0.3 && 0.3 < high + 0.003, "{value} {low} {high}");
    // In closed loop, with the simulated sticking, it helps too, and the file that is written has it.
    let arm = found.verdict.arm.as_ref().unwrap();
    let elbow = &arm.joints[1];
    assert!(elbow.loop_diagnosed.unwrap() < 0.5 * elbow.loop_refit.unwrap(), "{elbow:?}");
    let model = Model::from_toml(&found.model, "diagnosed").unwrap();
    assert!(model.elements.iter().any(|e| e.law.kind().name == "coulomb" && model.place_name(e.between[0]) == "elbow"));
}

/// Torque that no law explains, at both joints: noise of 0.15 s correlation, larger than the sensor's.
fn coloured(columns: &mut [Vec<f64>; 7]) {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64((1e6 * columns[1][0].abs()) as u64);
    for (torque, size) in [(5, 0.12), (6, 0.06)] {
        let mut state: f64 = 0.0;
        for sample in &mut columns[torque] {
            state = 0.97 * state + 0.25 * size * random.random_range(-1.7..1.7);
            *sample += state;
        }
    }
}

#[test]
fn laws_are_named_at_their_joint_in_noise_that_is_slow_and_larger_than_the_sensors() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &AS_STATED, "", |columns| {
        coloured(columns);
        let drag: Vec<f64> = columns[4].iter().map(|v| 0.3 * v * v.abs()).collect();
        columns[6].iter_mut().zip(drag).for_each(|(torque, drag)| *torque += drag);
    });
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let found = diagnose(&problem, &Options::default(), None, &|_| ()).unwrap();
    let [finding] = found.verdict.findings.as_slice() else { panic!("{:?}", found.verdict.findings) };
    assert_eq!((finding.physics.as_str(), &finding.place), ("quadratic_drag", &Place::Between("elbow".to_string(), "ground".to_string())));
    assert!(finding.confidence > 0.5 && finding.family_confidence >= finding.confidence, "{finding:?}");
    let (value, low, high) = number(finding, "coefficient");
    assert!((value / 0.3 - 1.0).abs() < 0.25 && low < 0.3 && 0.3 < high, "{value} {low} {high}");
}

#[test]
fn noise_that_is_slow_is_no_finding() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &AS_STATED, "", coloured);
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let found = diagnose(&problem, &Options::default(), None, &|_| ()).unwrap();
    assert!(found.verdict.findings.iter().all(|f| f.confidence < 0.5), "{:?}", found.verdict.findings);
}

#[test]
fn where_no_rare_effect_may_be_added_common_ones_are() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let mut data = Data::new(&problem, None, false).unwrap();
    let found = search(&mut data, &[], 0, Limit::default()).unwrap();
    let at: Vec<_> = added(&found.best.structure)
        .into_iter()
        .map(|i| (found.best.structure.terms[i].physics, found.best.structure.terms[i].at))
        .collect();
    assert_eq!(at, [(Physics::Coulomb, At::Joint(1))]);
    // What is withheld does not come back that way.
    let mut data = Data::new(&problem, None, false).unwrap();
    let found = search(&mut data, &["coulomb".to_string()], 0, Limit::default()).unwrap();
    assert!(found.best.structure.terms.iter().all(|t| t.given.is_some() || t.physics != Physics::Coulomb));
}

#[test]
fn friction_that_grows_with_the_load_is_told_from_one_that_does_not() {
    let found = found(&Beside { by_load: [0.15, 0.0], ..AS_STATED });
    let finding = &found.verdict.findings[0];
    assert_eq!(finding.physics, "load_friction");
    assert_eq!(finding.place, Place::Between("shoulder".to_string(), "ground".to_string()));
    assert!((number(finding, "coefficient").0 - 0.15).abs() < 0.01);
    assert!((number(finding, "force").0 - 0.2).abs() < 0.05);
    let model = Model::from_toml(&found.model, "diagnosed").unwrap();
    assert!(model.elements.iter().any(|e| e.law.kind().name == "load_friction"), "{}", found.model);
}

#[test]
fn a_wrong_torque_constant_is_named_at_its_signal() {
    let found = found(&Beside { gain: [1.0, 1.2], ..AS_STATED });
    let finding = &found.verdict.findings[0];
    assert_eq!((finding.physics.as_str(), &finding.place), ("gain", &Place::Signal("elbow.torque".to_string())));
    assert!((number(finding, "gain").0 - 1.2).abs() < 0.01);
}

#[test]
fn a_soft_gear_is_named_with_its_stiffness_and_written_as_a_motor_of_its_own() {
    // The elbow's link would swing at some 3 Hz on it.
    let found = found(&Beside { soft: [0.0, 1.0 / 12.0], ..AS_STATED });
    let finding = &found.verdict.findings[0];
    assert_eq!(finding.physics, "series_compliance", "{:?}", found.verdict.findings);
    assert_eq!(finding.place, Place::Between("elbow".to_string(), "elbow.rotor".to_string()));
    let (value, low, high) = number(finding, "stiffness");
    assert!((value - 12.0).abs() < 2.0 && low < 12.0 && 12.0 < high, "{value} {low} {high}");
    let model = Model::from_toml(&found.model, "diagnosed").unwrap();
    let gear = model.elements.iter().find(|e| e.law.kind().name == "spring").expect("a spring");
    let ends: Vec<&str> = gear.between.iter().map(|end| model.place_name(*end)).collect();
    assert_eq!(ends, ["elbow.rotor", "elbow"]);
}

#[test]
fn a_simulation_in_closed_loop_speaks_against_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let mut data = Data::new(&problem, None, false).unwrap();
    let mut found = search(&mut data, &[], 8, Limit::default()).unwrap();
    let ratio = |found: &Search| {
        let (model, _) = model_of(&data, &found.best).unwrap();
        let gains = gains(&data, &model).unwrap();
        let with = judge(&data, &model, &Reading::of(&data, &found.best), &gains).unwrap();
        each(&data, found, &gains, Some(&with))[0].as_ref().unwrap().ratio()
    };
    let right = ratio(&found);
    assert!(right < 0.5, "{right}");
    // The same friction at the elbow, three times as large.
    let index = added(&found.best.structure)[0];
    assert_eq!(found.best.structure.terms[index].physics, Physics::Coulomb);
    let place = found.best.places[index].start;
    found.best.values[place] *= 3.0;
    let wrong = ratio(&found);
    assert!(wrong > AGAINST, "{wrong}");
}

#[test]
fn the_loop_of_the_judge_is_no_stiffer_than_a_rotor_alone_bears() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &Beside { soft: [0.0, 1.0 / 12.0], ..AS_STATED }, "", |_| {});
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let mut data = Data::new(&problem, None, false).unwrap();
    let found = search(&mut data, &[], 8, Limit::default()).unwrap();
    let (mut model, _) = model_of(&data, &found.best).unwrap();
    let rotor = model.bodies.iter().position(|body| body.name == "elbow.rotor").expect("a motor before the soft gear");
    let mut of = |inertia: f64| {
        model.bodies[rotor].inertia = inertia;
        gains(&data, &model).unwrap()
    };
    // A heavy rotor bears what the link bears; of a light one the loop takes half the speed within a sample, at most.
    let (heavy, light) = (of(10.0), of(1e-4));
    assert_eq!(heavy[0], light[0]);
    let share = light[1][1] * data.rates.period() / 1e-4;
    assert!((share - 0.5).abs() < 1e-9 && light[1][1] < 0.1 * heavy[1][1], "{share}: {light:?} {heavy:?}");
    assert!((light[1][0] / light[1][1] - heavy[1][0] / heavy[1][1]).abs() < 1e-9, "the same natural frequency of the loop's own");
}

#[test]
fn an_interrupted_search_says_so_and_gives_no_green_answer() {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &Beside { dry: [0.2, 0.3], ..AS_STATED }, "", |_| {});
    let problem = Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap();
    let stop = AtomicBool::new(true);
    let impatient = Options { patience: Some(Duration::ZERO), ..Options::default() };
    for (options, stop, why) in [(Options::default(), Some(&stop), "interrupted"), (impatient, None, "--patience")] {
        let found = diagnose(&problem, &options, stop, &|_| ()).unwrap();
        assert_eq!(found.verdict.word, Word::CannotTell);
        assert!(found.verdict.searched.as_ref().is_some_and(|s| s.cut_short) && found.notes.iter().any(|n| n.contains(why)));
    }
}
