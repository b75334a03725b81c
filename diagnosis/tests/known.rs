//! Devices with known effects: a missing one is named, and nothing is named where nothing is missing.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_diagnosis::belief::compare::unseen;
use backdrive_diagnosis::belief::intervals::Uncertainty;
use backdrive_diagnosis::hypothesis::Place;
use backdrive_diagnosis::options;
use backdrive_diagnosis::output_error::evaluator::Evaluator;
use backdrive_diagnosis::output_error::structure::Structure;
use backdrive_diagnosis::output_error::work::Limit;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_diagnosis::search::search;
use backdrive_diagnosis::tuning::tuning;
use backdrive_diagnosis::verdict::{Files, Finding, Parameter, Verdict, Word, verdict};
use backdrive_plant::model::Model;
use backdrive_plant::recording::Recording;
use backdrive_plant::set::{Condition, Initial};
use backdrive_plant::stepper::{Options, simulate};
use naming::assert_names;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const NOMINAL: &str = r#"
name = "two"   # a motor and a load
motion = "translation"
[bodies]
motor = 0.1
load = 0.4
[[elements]]
name = "belt"
kind = "spring"
between = ["motor", "load"]
stiffness = 900.0  # from the data sheet
[[elements]]
name = "belt_damping"
kind = "damper"
between = ["motor", "load"]
damping = 1.5
[[elements]]
name = "anchor"
kind = "spring"
between = ["load", "ground"]
stiffness = 60.0
[[elements]]
name = "air"
kind = "damper"
between = ["load", "ground"]
damping = 0.8
[[inputs]]
name = "force"
kind = "force"
on = "motor"
[[outputs]]
name = "position"
kind = "position"
of = "motor"
resolution = 1e-5
"#;

const COULOMB: &str = "\n[[elements]]\nname = \"rub\"\nkind = \"coulomb\"\nbetween = [\"load\", \"ground\"]\nforce = 0.6\n";

fn recorded(truth: &str, seed: u64) -> Problem {
    let model = Model::from_toml(truth, "truth").unwrap();
    let nominal = Model::from_toml(NOMINAL, "nominal").unwrap();
    let period = 1e-3;
    let shapes: [&dyn Fn(f64) -> f64; 3] = [
        &|t| 3.0 * (2.0 * std::f64::consts::PI * (0.3 + 0.9 * t) * t).sin(),
        &|t| 4.0 * (2.0 * std::f64::consts::PI * 0.7 * t).sin() + 2.0 * (2.0 * std::f64::consts::PI * 3.1 * t).sin(),
        &|t| 5.0 * ((t * 0.8).fract() * 4.0 - 2.0).abs() - 5.0,
    ];
    let records: Vec<Record> = shapes
        .iter()
        .enumerate()
        .map(|(i, shape)| {
            let t: Vec<f64> = (0..4000).map(|k| k as f64 * period).collect();
            let u: Vec<f64> = t.iter().map(|t| shape(*t)).collect();
            let mut random = ChaCha8Rng::seed_from_u64(seed * 10 + i as u64);
            let clean = simulate(&model, std::slice::from_ref(&u), period, &Options::default()).unwrap().remove(0);
            let y = clean
                .iter()
                .map(|y| {
                    let e: f64 = StandardNormal.sample(&mut random);
                    ((y + 2e-5 * e) / 1e-5).round() * 1e-5
                })
                .collect();
            let recording = Recording::new(format!("{i}"), t, vec![("force".into(), u), ("position".into(), y)]).unwrap();
            Record::new(&recording, &nominal, Vec::new()).unwrap()
        })
        .collect();
    let (fit, held_out) = (records[..2].to_vec(), records[2..].to_vec());
    Problem::new(NOMINAL.to_string(), "nominal.toml".into(), nominal, fit, held_out, Initial::Rest).unwrap()
}

#[test]
fn refitted_numbers_lie_in_their_intervals() {
    let truth = NOMINAL.replace("900.0", "1100.0").replace("damping = 0.8", "damping = 1.0");
    let problem = recorded(&truth, 1);
    let evaluator = Evaluator::new(&problem);
    let structure = Structure::new(&problem, &problem.fit, Vec::new());
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let fit = evaluator.fit(&structure, &structure.values(&problem, &given, &[], &[]), tuning().fit.to_the_end).unwrap();
    let level = (fit.cost / fit.residuals.len() as f64).sqrt();
    assert!(level < 1.1, "{level} floors");
    let candidate = backdrive_diagnosis::output_error::candidate::Candidate {
        structure,
        fit,
        correlation_time: 1.0,
        whiteness_statistic: 0.0,
        levels: vec![level],
        blocks: Vec::new(),
        may_be_nothing: false,
        unseen: None,
        released: None,
    };
    let spread = Uncertainty::measured(&evaluator, &candidate);
    for (path, true_value) in [("elements.belt.stiffness", 1100.0), ("elements.air.damping", 1.0), ("bodies.load", 0.4)] {
        let index = problem.stated.iter().position(|s| s.path == path).unwrap();
        let value = candidate.fit.values[index];
        let [low, high] = spread.interval(&candidate, index);
        let half = 0.5 * (high - low);
        assert!((value - true_value).abs() < 1.7 * half, "{path}: {value} in {low}..{high}");
        assert!(half < 0.05 * true_value, "{path}: {low}..{high}");
    }
}

/// Verdict and files of a search on a problem.
fn said(problem: &Problem, options: &options::Options) -> (Verdict, Files) {
    let found = search(problem, options, Limit::default(), &|_| {}).unwrap();
    verdict(problem, &found, &[], None, Limit::default()).unwrap()
}

/// The value of a finding's parameter that is no list.
fn value(finding: &Finding, key: &str) -> Option<f64> {
    match finding.parameters.get(key)? {
        Parameter::One(estimate) => Some(estimate.value),
        Parameter::List(_) => None,
    }
}

fn at_load(finding: &Finding) -> bool {
    finding.place == Place::Between("load".to_string(), "ground".to_string())
}

#[test]
fn a_force_limit_that_was_left_out_is_named() {
    let problem = recorded(&NOMINAL.replace("on = \"motor\"\n", "on = \"motor\"\nsaturation = 3.7\n"), 5);
    let (said, _) = said(&problem, &options::Options::default());
    assert_eq!(said.word, Word::Missing, "{said:#?}");
    let [only] = said.findings.as_slice() else { panic!("{said:#?}") };
    assert_eq!((only.physics.as_str(), &only.place), ("saturation", &Place::Signal("force".to_string())), "{only:#?}");
    let limit = value(only, "saturation").unwrap();
    assert!((limit - 3.7).abs() < 0.01, "{limit}");
}

#[test]
fn dry_friction_that_was_left_out_is_named() {
    let problem = recorded(&format!("{NOMINAL}{COULOMB}"), 2);
    let (said, files) = said(&problem, &options::Options::default());
    assert_eq!(said.word, Word::Missing, "{said:#?}");
    let first = &said.findings[0];
    assert_eq!((first.physics.as_str(), at_load(first)), ("coulomb", true), "{said:#?}");
    let force = value(first, "force").unwrap();
    assert!((force - 0.6).abs() < 0.02, "{force}");
    let held = &said.held_out;
    assert!(held.nrmse_after.unwrap() < 1.2 * held.noise_floor.unwrap(), "{held:?}");
    // One output: pooled over recordings its error lies between those of each, and their mean is the average.
    let each: Vec<f64> = held.per_record.iter().map(|one| one.nrmse_after.unwrap()).collect();
    let pooled = held.pooled_after.as_ref().unwrap()["position"];
    let (low, high) = each.iter().fold((f64::INFINITY, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
    assert!((low..=high).contains(&pooled), "{held:?}");
    let mean = each.iter().sum::<f64>() / each.len() as f64;
    assert!((mean / held.nrmse_after.unwrap() - 1.0).abs() < 1e-5 && each.len() == problem.held_out.len(), "{held:?}");
    assert_names(&files.model, &["# a motor and a load"]);
    Model::from_toml(&files.model, "after").unwrap();
}

#[test]
fn two_effects_at_once_are_both_named() {
    let late = NOMINAL.replace("on = \"motor\"\n", "on = \"motor\"\ndelay = 0.004\n");
    let problem = recorded(&format!("{late}{COULOMB}"), 8);
    let (said, _) = said(&problem, &options::Options::default());
    assert_eq!((said.word, said.findings.len()), (Word::Missing, 2), "{said:#?}");
    assert!(said.findings.iter().any(|f| f.physics == "delay"), "{:#?}", said.findings);
    // Dry friction, by whichever law has Coulomb's as a limit: on a slow machine there is no time to try the simplest last.
    let friction = said.findings.iter().find(|f| at_load(f)).unwrap();
    let level = ["force", "coulomb", "positive"].iter().find_map(|key| value(friction, key)).unwrap();
    assert!((level - 0.6).abs() < 0.03, "{} {level}", friction.physics);
}

#[test]
fn without_the_true_law_no_other_is_claimed_surely() {
    let problem = recorded(&format!("{NOMINAL}{COULOMB}"), 9);
    let (said, _) = said(&problem, &options::Options { without: vec!["coulomb".to_string()], ..options::Options::default() });
    let sure = said.findings.first().map_or(0.0, |f| f.confidence);
    // Dahl's law contains Coulomb's and is withheld with it, so nothing of the library is right.
    assert!(matches!(said.word, Word::Unexplained | Word::Ambiguous) || sure < 0.5, "{said:#?}");
}

#[test]
fn wrong_numbers_alone_are_no_physics() {
    let problem = recorded(&NOMINAL.replace("900.0", "1300.0").replace("load = 0.4", "load = 0.33"), 3);
    let (said, _) = said(&problem, &options::Options::default());
    assert_eq!(said.word, Word::Parameters, "{said:#?}");
}

#[test]
fn a_right_model_lacks_nothing() {
    for seed in 4..7 {
        let (said, _) = said(&recorded(NOMINAL, seed), &options::Options::default());
        assert_eq!(said.word, Word::NothingMissing, "{said:#?}");
    }
}

#[test]
fn a_drift_in_what_no_fit_has_seen_counts_but_once() {
    let mut problem = recorded(NOMINAL, 5);
    let structure = Structure::new(&problem, &problem.fit, Vec::new());
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let values = structure.values(&problem, &given, &[], &[]);
    // As noise and encoder steps make it.
    let noise_sd = vec![2.02e-5];
    let held = |problem: &Problem| unseen(problem, &problem.held_out, &structure, &values, &noise_sd).unwrap();
    let noise = held(&problem);
    assert!(noise.mean_square < 1.2 && noise.correlation_time < 1.3, "{noise:?}");
    // Half a period of a wave of six noise standard deviations over the whole of the recording: one observation, or a few.
    let samples = problem.held_out[0].outputs[0].as_mut().unwrap();
    let length = samples.len() as f64;
    samples.iter_mut().enumerate().for_each(|(i, y)| *y += 6.0 * noise_sd[0] * (std::f64::consts::PI * i as f64 / length).cos());
    let drifting = held(&problem);
    assert!((drifting.mean_square / 19.0 - 1.0).abs() < 0.1, "{drifting:?}");
    let independent = length / drifting.correlation_time;
    assert!(independent < 6.0, "{independent}");
}

const SLIDE: &str = r#"
name = "slide"   # moved as measured, the force on it recorded
motion = "translation"
[bodies]
slide = 2.0
[[elements]]
name = "oil"
kind = "damper"
between = ["slide", "ground"]
damping = 30.0
[[inputs]]
name = "place"
kind = "motion"
on = "slide"
[[outputs]]
name = "pull"
kind = "reaction"
of = "slide"
"#;

const RIPPLE: &str = "\n[[elements]]\nname = \"teeth\"\nkind = \"cogging\"\nbetween = [\"slide\", \"ground\"]\namplitude = 0.8\nperiod = 4e-3\nphase = 0.5\n";

/// The slide with teeth, moved to and fro; in the two held-out recordings its encoder counts from another zero.
fn switched_on_again(condition: Option<Condition>) -> Problem {
    let truth = Model::from_toml(&format!("{SLIDE}{RIPPLE}"), "truth").unwrap();
    let nominal = Model::from_toml(SLIDE, "nominal").unwrap();
    let period = 1e-3;
    let one = |i: usize| {
        let t: Vec<f64> = (0..3000).map(|k| k as f64 * period).collect();
        let way = [0.02, 0.015, 0.018, 0.013][i];
        let place: Vec<f64> = t.iter().map(|t| way * (1.0 - (std::f64::consts::TAU * 0.4 * (1.0 + 0.2 * i as f64) * t).cos())).collect();
        let mut random = ChaCha8Rng::seed_from_u64(40 + i as u64);
        let pull = simulate(&truth, std::slice::from_ref(&place), period, &Options::default()).unwrap().remove(0);
        let noisy = |y: &f64| {
            let e: f64 = StandardNormal.sample(&mut random);
            y + 0.02 * e
        };
        let pull: Vec<f64> = pull.iter().map(noisy).collect();
        // Half a ripple off.
        let counted = place.iter().map(|x| if i < 2 { *x } else { x + 1.9e-3 }).collect();
        let recording = Recording::new(format!("{i}"), t, vec![("place".into(), counted), ("pull".into(), pull)]).unwrap();
        let own = condition.clone().filter(|_| i >= 2).map(|c| ("inputs.place.offset".to_string(), c));
        Record::new(&recording, &nominal, own.into_iter().collect()).unwrap()
    };
    let records: Vec<Record> = (0..4).map(one).collect();
    let (fit, held_out) = (records[..2].to_vec(), records[2..].to_vec());
    Problem::new(SLIDE.to_string(), "slide.toml".into(), nominal, fit, held_out, Initial::Rest).unwrap()
}

#[test]
fn where_an_encoder_counts_from_is_a_number_of_its_session() {
    let verdict_of = |condition: Option<Condition>| said(&switched_on_again(condition), &options::Options::default()).0;
    let is_ripple = |said: &Verdict| said.findings.first().is_some_and(|f| f.physics == "cogging");
    // Where the set does not say so, the recordings that no fit has seen speak against a ripple.
    assert!(!is_ripple(&verdict_of(None)));
    let said = verdict_of(Some(Condition::Shared(0)));
    assert!(said.word == Word::Missing && is_ripple(&said), "{said:#?}");
    let period = value(&said.findings[0], "period").unwrap();
    assert!((period / 4e-3 - 1.0).abs() < 1e-3, "{period}");
    assert!(said.held_out.nrmse_after.unwrap() < 1.1 * said.held_out.noise_floor.unwrap(), "{said:#?}");

    // One parameter for the session, and one each where files are free by themselves.
    for (condition, own) in [(Condition::Shared(0), 1), (Condition::Free, 2)] {
        let problem = switched_on_again(Some(condition));
        let structure = Structure::new(&problem, &problem.held_out, Vec::new());
        assert_eq!(structure.free.iter().filter(|n| n.records.is_some()).count(), own);
    }
}
