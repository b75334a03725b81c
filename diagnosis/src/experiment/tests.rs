//! Experiments chosen for devices of known effects, and what they then show.

use super::separate::separate_fitted;
use super::*;
use crate::belief::intervals::Uncertainty;
use crate::hypothesis::{Hypothesis, Run, Scales};
use crate::output_error::candidate::{Candidate, candidate};
use crate::output_error::evaluator::Evaluator;
use crate::output_error::fit::Fit;
use crate::output_error::structure::{Role, Structure};
use crate::output_error::work::Budget;
use crate::physics;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::excitation::load_experiments;
use backdrive_plant::model::Model;
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::{Options, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const PERIOD: f64 = 1e-3;

const MASS: &str = r#"
name = "mass"
motion = "translation"
[bodies]
mass = 0.2
[[elements]]
name = "spring"
kind = "spring"
between = ["mass", "ground"]
stiffness = 200.0
[[inputs]]
name = "force"
kind = "force"
on = "mass"
[[outputs]]
name = "position"
kind = "position"
of = "mass"
"#;

const RUB: &str = "\n[[elements]]\nname = \"rub\"\nkind = \"coulomb\"\nbetween = [\"mass\", \"ground\"]\nforce = 0.15\n";

fn soon() -> Budget<'static> {
    Budget::default()
}

/// What `truth` does under some inputs, with noise on its outputs, as a recording of `nominal`.
fn record(truth: &Model, nominal: &Model, columns: &[Vec<f64>], noise: f64, seed: u64) -> Record {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let clean = simulate(truth, columns, PERIOD, &Options::default()).unwrap();
    let t: Vec<f64> = (0..columns[0].len()).map(|k| k as f64 * PERIOD).collect();
    let mut signals: Vec<(String, Vec<f64>)> = nominal.inputs.iter().map(|i| i.name.clone()).zip(columns.iter().cloned()).collect();
    for (output, y) in nominal.outputs.iter().zip(clean) {
        let y = y.iter().map(|y| {
            let e: f64 = StandardNormal.sample(&mut random);
            y + noise * e
        });
        signals.push((output.name.clone(), y.collect()));
    }
    Record::new(&Recording::new(format!("{seed}"), t, signals).unwrap(), nominal, Vec::new()).unwrap()
}

/// A sine that rises within half a second.
fn sine(amplitude: f64, hz: f64, seconds: f64) -> Vec<f64> {
    let rise = |t: f64| if t < 0.5 { 0.5 - 0.5 * (TAU * t).cos() } else { 1.0 };
    (0..(seconds / PERIOD) as usize).map(|k| k as f64 * PERIOD).map(|t| rise(t) * amplitude * (TAU * hz * t).sin()).collect()
}

/// A problem of one recording: `nominal` is held against what `truth` does.
fn problem(nominal: &str, truth: &str, column: Vec<f64>, noise: f64) -> Problem {
    let model = Model::from_toml(nominal, "nominal").unwrap();
    let truth = Model::from_toml(truth, "truth").unwrap();
    let record = record(&truth, &model, &[column], noise, 1);
    let mut problem = Problem::new(nominal.to_string(), "nominal.toml".into(), model, vec![record], Vec::new(), Initial::Rest).unwrap();
    problem.noise_sd = vec![noise; problem.model.outputs.len()];
    problem
}

fn hypotheses(problem: &Problem) -> Vec<Hypothesis> {
    let runs: Vec<Run> = problem.fit.iter().map(Run::from).collect();
    physics::all(&problem.model, &Scales::of(&problem.model, &runs).unwrap())
}

/// The nominal model with some of its hypotheses, fitted.
fn fitted(problem: &Problem, ids: &[&str]) -> (Structure, Fit) {
    let all = hypotheses(problem);
    let find = |id: &&str| all.iter().find(|h| h.id == *id).unwrap_or_else(|| panic!("no {id}")).clone();
    let added: Vec<Hypothesis> = ids.iter().map(find).collect();
    let structure = Structure::new(problem, &problem.fit, added.clone());
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let starts: Vec<Vec<f64>> = (0..2)
        .map(|s| {
            structure.values(problem, &given, &added.iter().map(|h| h.starts[s.min(h.starts.len() - 1)].clone()).collect::<Vec<_>>(), &[])
        })
        .collect();
    let fit = Evaluator::new(problem).best_of(&structure, &starts, tuning().fit.to_the_end).unwrap();
    (structure, fit)
}

/// The columns that an excitation file makes for a model: read from a file, as anybody would.
fn columns(text: &str, model: &Model) -> Vec<Vec<f64>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("next.toml");
    std::fs::write(&path, text).unwrap();
    let experiments = load_experiments(&path).unwrap_or_else(|e| panic!("{e}\n{text}"));
    assert_eq!(experiments.len(), 1, "{text}");
    experiments[0].columns_for(model, 1.0 / PERIOD).unwrap()
}

#[test]
fn dry_and_viscous_friction_are_told_apart_by_as_much_as_was_said() {
    let noise = 3e-3;
    for (truth, rival) in [("coulomb@mass-ground", "damper@mass-ground"), ("damper@mass-ground", "coulomb@mass-ground")] {
        let mut problem = problem(MASS, &format!("{MASS}{RUB}"), sine(0.7, 1.0, 4.0), noise);
        let (right, wrong) = (fitted(&problem, &[truth]), fitted(&problem, &[rival]));
        let alike = (right.1.cost - wrong.1.cost).abs();
        let began = std::time::Instant::now();
        let found = separate_fitted(&problem, &[(&right.0, &right.1), (&wrong.0, &wrong.1)], &problem.noise_sd, &soon()).unwrap();
        println!("{:.2} s, costs apart by {alike:.1}: {found:#?}", began.elapsed().as_secs_f64());
        assert!(alike < 0.3 * found.separation.powi(2), "the recording tells them apart already: {alike} of {}", found.separation.powi(2));
        assert!(found.separation > 5.0, "{found:?}");
        assert!(found.duration <= 4.2, "{}", found.duration);

        // Made with one of them, the experiment costs the other as much as was said.
        let device = right.0.model(&problem, &right.1.values).unwrap();
        let driven = columns(&found.text, &problem.model);
        problem.fit.push(record(&device, &problem.model, &driven, noise, 7));
        let evaluator = Evaluator::new(&problem);
        let cost = |s: &(Structure, Fit)| evaluator.fit(&s.0, &s.1.values, tuning().fit.to_the_end).unwrap().cost;
        let seen = cost(&wrong) - cost(&right);
        let said = found.separation.powi(2);
        println!("{truth}: said {said:.0}, seen {seen:.0}");
        assert!(seen > 0.5 * said - 4.0 * found.separation && seen > 25.0, "{truth}: said {said}, seen {seen}");
        assert!(seen < 6.0 * said, "{truth}: said {said}, seen {seen}");
    }
}

#[test]
fn the_file_plays_and_stays_within_what_was_recorded() {
    let problem = problem(MASS, &format!("{MASS}{RUB}"), sine(0.7, 1.0, 4.0), 1e-3);
    let (a, b) = (fitted(&problem, &["coulomb@mass-ground"]), fitted(&problem, &["damper@mass-ground"]));
    let found = separate_fitted(&problem, &[(&a.0, &a.1), (&b.0, &b.1)], &problem.noise_sd, &soon()).unwrap();
    let model = a.0.model(&problem, &a.1.values).unwrap();
    let driven = columns(&found.text, &model);
    assert!((driven[0].len() as f64 * PERIOD - found.duration).abs() < 2.0 * PERIOD);
    assert!(driven[0].iter().all(|u| u.abs() <= 0.701), "beyond the recorded force");
    let y = simulate(&model, &driven, PERIOD, &Options::default()).unwrap().remove(0);
    let shown = problem.fit[0].outputs[0].as_ref().unwrap().iter().fold(0.0f64, |a, y| a.max(y.abs()));
    assert!(y.iter().all(|y| y.is_finite() && y.abs() <= 1.5 * shown), "beyond the recorded motion");
    assert!(found.separation > 5.0 && found.sentence.contains("coulomb"));
    let line: backdrive_plant::excitation::Excitation = found.excitation.parse().unwrap();
    assert_eq!(line.samples(1.0 / PERIOD).unwrap(), driven[0], "the file and the line are the same excitation");
}

#[test]
fn what_is_mechanically_the_same_has_no_experiment() {
    let damped = format!("{MASS}\n[[elements]]\nname = \"oil\"\nkind = \"damper\"\nbetween = [\"mass\", \"ground\"]\ndamping = 0.8\n");
    let problem = problem(MASS, &damped, sine(0.7, 2.0, 3.0), 1e-5);
    let (a, b) = (fitted(&problem, &["back_emf@force"]), fitted(&problem, &["damper@mass-ground"]));
    let said = separate_fitted(&problem, &[(&a.0, &a.1), (&b.0, &b.1)], &problem.noise_sd, &soon()).unwrap_err().to_string();
    println!("{said}");
    assert!(said.contains("measure the motor's current") && said.contains("does not help"), "{said}");
    assert!(separate_fitted(&problem, &[(&a.0, &a.1)], &problem.noise_sd, &soon()).is_err());
}

const TWO: &str = r#"
name = "two"
motion = "translation"
[bodies]
motor = 0.1
load = 0.3
[[elements]]
name = "belt"
kind = "spring"
between = ["motor", "load"]
stiffness = 900.0
[[elements]]
name = "loss"
kind = "damper"
between = ["motor", "load"]
damping = 2.0
[[elements]]
name = "anchor"
kind = "spring"
between = ["load", "ground"]
stiffness = 60.0
[[inputs]]
name = "force"
kind = "force"
on = "motor"
[[outputs]]
name = "position"
kind = "position"
of = "motor"
"#;

#[test]
fn the_sensor_that_would_help_is_named() {
    let late = TWO.replace("on = \"motor\"", "on = \"motor\"\ndelay = 0.004");
    let problem = problem(TWO, &late, (0..4000).map(|k| (1e-5 * f64::from(k * k)).sin() * 2.0).collect(), 2e-5);
    let (a, b) = (fitted(&problem, &["delay@force"]), fitted(&problem, &["delay@position"]));
    let plan = separate_fitted(&problem, &[(&a.0, &a.1), (&b.0, &b.1)], &problem.noise_sd, &soon()).unwrap();
    println!("{plan:#?}");
    assert!(plan.sentence.contains("measuring the") && plan.separation >= tuning().experiment.wanted, "{plan:?}");
    // A program can add it: an output that is not there yet, of a body or of an element that is.
    let sensor = plan.sensor.unwrap();
    let named = |name: &Option<String>, all: &[&str]| name.as_ref().is_some_and(|name| all.contains(&name.as_str()));
    let is_motion = ["position", "velocity"].contains(&sensor.kind.as_str()) && named(&sensor.of, &["motor", "load"]);
    assert!(is_motion || sensor.kind == "force" && named(&sensor.element, &["belt", "loss", "anchor"]), "{sensor:?}");
    assert!(sensor.noise_sd > 0.0 && (sensor.kind.as_str(), sensor.of.as_deref()) != ("position", Some("motor")), "{sensor:?}");
    assert_eq!(columns(&plan.text, &problem.model).len(), 1, "{}", plan.text);
}

/// A candidate as a search has it.
fn as_candidate(problem: &Problem, (structure, fit): (Structure, Fit)) -> Candidate {
    candidate(&Evaluator::new(problem), structure, fit)
}

#[test]
fn a_law_that_contains_another_is_told_from_it_by_what_the_other_cannot_imitate() {
    // Pushed one way only: asymmetric friction is dry friction there, and the parameter of its other side keeps its start value.
    let push: Vec<f64> = (0..3000).map(|k| if k < 40 { 3.0 } else { 0.6 + 0.1 * (0.02 * f64::from(k)).sin() }).collect();
    let free = MASS.replace("kind = \"spring\"", "kind = \"damper\"").replace("stiffness = 200.0", "damping = 0.8");
    let rubbing = format!("{free}{RUB}");
    let problem = problem(&free, &rubbing, push, 1e-4);
    let simple = as_candidate(&problem, fitted(&problem, &["coulomb@mass-ground"]));
    let mut rich = as_candidate(&problem, fitted(&problem, &["asymmetric_coulomb@mass-ground"]));
    let back = rich.structure.free.len() - 1;
    rich.fit.values[back] = 0.4 * simple.fit.values[simple.fit.values.len() - 1];
    let plan = confirm(&problem, [&simple, &rich], true, &problem.noise_sd, &soon()).unwrap();
    println!("{plan:#?}");
    assert!(
        plan.separation >= tuning().experiment.wanted && plan.repeats == 1 && plan.sentence.contains("the simpler one refitted"),
        "{plan:?}"
    );
    // As equals they are not separated: the richer one imitates the other in any experiment.
    let equals = confirm(&problem, [&simple, &rich], false, &problem.noise_sd, &soon());
    assert!(equals.is_err(), "{equals:#?}");
    // And where the richer one is the simpler one, there is nothing to tell.
    let shared = simple.fit.values.len() - 1;
    rich.fit.values[..shared].copy_from_slice(&simple.fit.values[..shared]);
    rich.fit.values[back] = simple.fit.values[simple.fit.values.len() - 1];
    rich.fit.values[back - 1] = rich.fit.values[back];
    assert!(confirm(&problem, [&simple, &rich], true, &problem.noise_sd, &soon()).is_err());
}

#[test]
fn what_slow_motion_hides_is_excited() {
    let problem = problem(MASS, MASS, sine(0.7, 0.4, 5.0), 3e-3);
    let (structure, fit) = fitted(&problem, &["damper@mass-ground"]);
    let mass = structure.free.iter().position(|n| matches!(n.role, Role::Stated(i) if problem.stated[i].path == "bodies.mass")).unwrap();
    let excited = |numbers: &[usize], told: &[f64]| excite(&problem, &structure, &fit.values, numbers, told, &problem.noise_sd, &soon());
    let candidate = as_candidate(&problem, (structure.clone(), fit.clone()));
    let told = Uncertainty::of(&candidate).deviation;
    let found = excited(&[mass], &told).unwrap();
    println!("{found:#?}");
    assert!(found.separation > 8.0 && found.sentence.contains("bodies.mass"), "{found:?}");
    // The reported deviation decides whether a parameter is open, and how well an experiment would determine it.
    let known = excited(&[mass], &vec![0.04; told.len()]).map(|plan| plan.sentence).unwrap_err();
    assert!(known.to_string().contains("a standard deviation of 5 % or less"), "{known}");
    let wider = excited(&[mass], &told.iter().map(|sd| 3.0 * sd).collect::<Vec<f64>>()).unwrap();
    let percent = |plan: &Experiment| -> f64 {
        let (before, _) = plan.sentence.split_once(" %").expect("an accuracy");
        before.rsplit(' ').next().and_then(|number| number.parse().ok()).expect("a number")
    };
    assert_eq!(wider.excitation, found.excitation);
    assert!((percent(&wider) / percent(&found) / 3.0 - 1.0).abs() < 0.1, "{} {}", wider.sentence, found.sentence);
    // A refit to it knows the mass as well as was said.
    let mut wider = problem.clone();
    wider.fit.push(record(&Model::from_toml(MASS, "").unwrap(), &problem.model, &columns(&found.text, &problem.model), 3e-3, 3));
    let again = fitted(&wider, &[]);
    let value = again.1.values[mass];
    assert!((value / 0.2 - 1.0).abs() < 4.0 / found.separation, "{value}");
    assert!(excited(&[], &told).is_err());
}

const MOVED: &str = r#"
name = "moved"
motion = "translation"
[bodies]
handle = 0.05
load = 0.3
[[elements]]
name = "belt"
kind = "spring"
between = ["handle", "load"]
stiffness = 900.0
[[elements]]
name = "loss"
kind = "damper"
between = ["handle", "load"]
damping = 2.0
[[inputs]]
name = "motion"
kind = "motion"
on = "handle"
[[outputs]]
name = "force"
kind = "reaction"
of = "handle"
"#;

#[test]
fn a_motion_is_smooth_and_no_faster_than_recorded() {
    let truth = format!("{MOVED}{}", RUB.replace("mass", "load").replace("0.15", "0.3"));
    let column = sine(0.01, 1.5, 4.0);
    let problem = problem(MOVED, &truth, column.clone(), 0.15);
    let (a, b) = (fitted(&problem, &["coulomb@load-ground"]), fitted(&problem, &["damper@load-ground"]));
    let found = separate_fitted(&problem, &[(&a.0, &a.1), (&b.0, &b.1)], &problem.noise_sd, &soon()).unwrap();
    println!("{found:#?}");
    let driven = columns(&found.text, &problem.model).remove(0);
    let fastest = |u: &[f64]| u.windows(2).fold(0.0f64, |a, w| a.max((w[1] - w[0]).abs() / PERIOD));
    let hardest = |u: &[f64]| u.windows(3).fold(0.0f64, |a, w| a.max((w[2] - 2.0 * w[1] + w[0]).abs() / (PERIOD * PERIOD)));
    assert!(driven.iter().all(|x| x.abs() <= 0.01005));
    assert!(fastest(&driven) <= 1.02 * fastest(&column), "{} against {}", fastest(&driven), fastest(&column));
    assert!(hardest(&driven) <= 1.1 * hardest(&column), "{} against {}", hardest(&driven), hardest(&column));
}
