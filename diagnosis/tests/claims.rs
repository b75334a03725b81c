//! What is claimed and what is not. Covers errors that are no effect of the device, parameters that a refit has to find, and a law that is there although
//! more remains.

use backdrive_diagnosis::diagnose::diagnose;
use backdrive_diagnosis::options;
use backdrive_diagnosis::output_error::error_budget::Source;
use backdrive_diagnosis::output_error::hold;
use backdrive_diagnosis::output_error::work::Limit;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_diagnosis::search::search;
use backdrive_diagnosis::verdict::{NextExperiment, Parameter, Verdict, Word, timing, verdict};
use backdrive_plant::excitation::Excitation;
use backdrive_plant::model::{Hold, Model};
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::{Options, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

/// How an input runs, at a time in s.
type Course = Box<dyn Fn(f64) -> f64>;

/// A measured signal: the samples and white noise.
fn noisy(clean: &[f64], noise_sd: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    clean.iter().map(|y| y + noise_sd * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, random)).collect()
}

/// Recordings of `truth` under these excitations, held against `nominal`; the last one is held out. `input_noise` is on what is recorded of the first
/// input, not on what drives the device; inputs of the truth beyond those of the nominal model are not recorded.
struct Bench<'b> {
    truth: &'b str,
    nominal: &'b str,
    noise_sd: f64,
    input_noise: f64,
    excitations: Vec<Vec<Course>>,
}

impl Bench<'_> {
    fn problem(&self, seed: u64) -> Problem {
        let (truth, nominal) = (Model::from_toml(self.truth, "truth").unwrap(), Model::from_toml(self.nominal, "nominal").unwrap());
        let period = 1e-3;
        let one = |(i, inputs): (usize, &Vec<Course>)| {
            let t: Vec<f64> = (0..4000).map(|k| f64::from(k) * period).collect();
            let driven: Vec<Vec<f64>> = inputs.iter().map(|f| t.iter().map(|t| f(*t)).collect()).collect();
            let mut random = ChaCha8Rng::seed_from_u64(100 * seed + i as u64);
            let columns = simulate(&truth, &driven, period, &Options::default()).unwrap();
            let mut signals = vec![(nominal.inputs[0].name.clone(), noisy(&driven[0], self.input_noise, &mut random))];
            for (output, clean) in nominal.outputs.iter().zip(&columns) {
                signals.push((output.name.clone(), noisy(clean, self.noise_sd, &mut random)));
            }
            Record::new(&Recording::new(format!("{i}"), t, signals).unwrap(), &nominal, Vec::new()).unwrap()
        };
        let mut fit: Vec<Record> = self.excitations.iter().enumerate().map(one).collect();
        let held_out = fit.split_off(fit.len() - 1);
        Problem::new(self.nominal.to_string(), "nominal.toml".into(), nominal, fit, held_out, Initial::Rest).unwrap()
    }

    fn said(&self, seed: u64) -> Verdict {
        let problem = self.problem(seed);
        let found = search(&problem, &options::Options::default(), Limit::default(), &|_| {}).unwrap();
        verdict(&problem, &found, &timing(&problem, &found), None, Limit::default()).unwrap().0
    }
}

/// Sweeps of a size, and a sum of sines; in Hz.
fn sweeps(size: f64, from: f64, to: f64) -> Vec<Vec<Course>> {
    let sweep =
        move |scale: f64, top: f64| -> Course { Box::new(move |t| scale * size * (TAU * (from + 0.5 * (top - from) * t / 4.0) * t).sin()) };
    let sines =
        move |t: f64| size * (0.5 * (TAU * 1.3 * from * t).sin() + 0.4 * (TAU * 0.31 * to * t).sin() - 0.3 * (TAU * 0.11 * to * t).sin());
    vec![vec![sweep(1.0, to)], vec![sweep(0.5, 0.6 * to)], vec![Box::new(sines)]]
}

/// A mass that a spring ties to a measured motion, whose force is measured there.
const RIG: &str = r#"
name = "rig"
motion = "translation"
[bodies]
ram = 0.001
disc = 20.0
[[elements]]
name = "rod"
kind = "spring"
between = ["ram", "disc"]
stiffness = 8e5
[[elements]]
name = "oil"
kind = "damper"
between = ["disc", "ground"]
damping = 900.0
[[inputs]]
name = "place"
kind = "motion"
on = "ram"
[[outputs]]
name = "force"
kind = "reaction"
of = "ram"
"#;

#[test]
fn noise_of_a_motion_that_drives_the_model_is_no_physics() {
    // Through the rod it is a force of 0.12 N, half as much again as the noise of the gauge.
    let bench = Bench { truth: RIG, nominal: RIG, noise_sd: 0.08, input_noise: 1.5e-7, excitations: sweeps(1e-4, 1.0, 60.0) };
    for seed in 0..3 {
        let said = bench.said(seed);
        assert!(said.word.is_structure_right() && said.findings.is_empty(), "{said:#?}");
        let driving = said.error_budget.iter().find(|e| e.source == Source::DrivingMotion).unwrap();
        assert!((0.6..1.4).contains(&driving.noise_sd), "{driving:?}");
    }
}

/// Two masses on springs, pushed at the one and read at the other.
const CHAIN: &str = r#"
name = "chain"
motion = "translation"
[bodies]
a = 0.085
b = 0.224
[[elements]]
name = "joint"
kind = "spring"
between = ["a", "b"]
stiffness = 980.0
[[elements]]
name = "joint_loss"
kind = "damper"
between = ["a", "b"]
damping = 1.7
[[elements]]
name = "anchor"
kind = "spring"
between = ["b", "ground"]
stiffness = 2700.0
[[elements]]
name = "oil"
kind = "damper"
between = ["b", "ground"]
damping = 6.3
[[inputs]]
name = "push"
kind = "force"
on = "a"
[[outputs]]
name = "place"
kind = "position"
of = "b"
"#;

#[test]
fn one_wrong_number_among_many_that_go_together_is_found() {
    let truth = CHAIN.replace("b = 0.224", "b = 0.316");
    let bench = Bench { truth: &truth, nominal: CHAIN, noise_sd: 7e-6, input_noise: 0.0, excitations: sweeps(2.0, 0.5, 40.0) };
    for seed in 0..2 {
        let said = bench.said(seed);
        assert_eq!(said.word, Word::Parameters, "{said:#?}");
        assert!(said.remaining.unwrap().noise_sd.unwrap() < 1.05);
        let held = &said.held_out;
        assert!(held.nrmse_after.unwrap() < 1.1 * held.noise_floor.unwrap(), "{held:?}");
    }
}

#[test]
fn what_is_late_by_a_small_share_of_a_sample_is_timing_and_no_physics() {
    // Of a sample period of 1 ms.
    for (delay, is_timing) in [("2e-5", true), ("2e-3", false)] {
        let truth = CHAIN.replace("on = \"a\"\n", &format!("on = \"a\"\ndelay = {delay}\n"));
        let bench = Bench { truth: &truth, nominal: CHAIN, noise_sd: 2e-6, input_noise: 0.0, excitations: sweeps(2.0, 0.5, 40.0) };
        let said = bench.said(1);
        assert_eq!(said.findings.is_empty(), is_timing, "{delay}: {said:#?}");
        assert_eq!(said.word.is_structure_right(), is_timing, "{delay}: {said:#?}");
        // It is reported, unless stated parameters have absorbed it.
        assert!(said.audit.iter().all(|remark| remark.what == "timing") && (is_timing || said.audit.is_empty()), "{:#?}", said.audit);
    }
}

#[test]
fn dry_friction_is_claimed_although_more_remains() {
    // A disturbance that nobody measured, tied to nothing: no model predicts it.
    let truth = CHAIN.replace(
        "[[inputs]]\n",
        "[[elements]]\nname = \"rub\"\nkind = \"coulomb\"\nbetween = [\"b\", \"ground\"]\nforce = 0.9\n[[inputs]]\n",
    ) + "[[inputs]]\nname = \"draught\"\nkind = \"force\"\non = \"b\"\n";
    let mut excitations = sweeps(4.0, 0.5, 12.0);
    for (i, inputs) in excitations.iter_mut().enumerate() {
        let (a, b) = (3.3 + 1.1 * i as f64, 0.7 + 0.13 * i as f64);
        inputs.push(Box::new(move |t| 0.08 * (TAU * a * t).sin() * (TAU * b * t).cos()));
    }
    let bench = Bench { truth: &truth, nominal: CHAIN, noise_sd: 2e-6, input_noise: 0.0, excitations };
    let said = bench.said(1);
    assert!(matches!(said.word, Word::Missing), "{said:#?}");
    let first = &said.findings[0];
    assert_eq!(first.physics, "coulomb", "{said:#?}");
    let Parameter::One(force) = &first.parameters["force"] else { panic!("{first:#?}") };
    assert!((force.value - 0.9).abs() < 0.09, "{force:?}");
    // The remaining residual is reported with it, and what to do about it.
    let left = said.remaining.as_ref().unwrap();
    assert!(left.noise_sd.unwrap() > 3.0 && left.shows.is_some(), "{left:#?}");
    assert!(said.next_experiment.is_some());
}

#[test]
fn an_input_that_runs_on_between_its_samples_is_no_missing_physics() {
    let truth = CHAIN.replace("on = \"a\"\n", "on = \"a\"\nhold = \"linear\"\n");
    let bench = Bench { truth: &truth, nominal: CHAIN, noise_sd: 5e-7, input_noise: 0.0, excitations: sweeps(2.0, 0.5, 60.0) };
    let done = diagnose(bench.problem(1), &options::Options::default(), None, &|_| {}).unwrap();
    assert!(done.verdict.word.is_structure_right() && done.verdict.findings.is_empty(), "{:#?}", done.verdict);
    assert!(done.remarks.iter().any(|remark| remark.about == "hold" && remark.signal == "push"), "{:#?}", done.remarks);
    // The model's text simulates as the model was simulated here.
    let written = Model::from_toml(&done.problem.text, "written").unwrap();
    assert_eq!((written.inputs[0].hold, done.problem.model.inputs[0].hold), (Hold::Linear, Hold::Linear));
    // What the file states is not asked for again.
    let stated = CHAIN.replace("on = \"a\"\n", "on = \"a\"\nhold = \"linear\"\n");
    let problem = Bench { nominal: &stated, ..bench }.problem(1);
    assert!(hold::assumed(&problem).is_empty());
}

#[test]
fn a_body_in_a_joint_is_found_where_stiffness_and_inertia_have_absorbed_it() {
    let truth =
        CHAIN.replace("b = 0.224\n", "b = 0.224\nw = 0.05\n").replace("between = [\"a\", \"b\"]", "between = [\"a\", \"w\"]").replace(
            "[[inputs]]\n",
            "[[elements]]\nname = \"bolt\"\nkind = \"spring\"\nbetween = [\"w\", \"b\"]\nstiffness = 800.0\n\
             [[elements]]\nname = \"bolt_loss\"\nkind = \"damper\"\nbetween = [\"w\", \"b\"]\ndamping = 0.3\n[[inputs]]\n",
        );
    let bench = Bench { truth: &truth, nominal: CHAIN, noise_sd: 2e-6, input_noise: 0.0, excitations: sweeps(2.0, 0.5, 60.0) };
    let said = bench.said(1);
    let first = said.findings.first().unwrap_or_else(|| panic!("{said:#?}"));
    assert_eq!((first.physics.as_str(), said.findings.len()), ("series_compliance", 1), "{said:#?}");
    let ends = first.place.to_string();
    assert!(ends == "a-b" || ends == "b-a", "{ends}");
    // Either spring of the joint may be called the one that was left out.
    let Parameter::One(stiffness) = &first.parameters["stiffness"] else { panic!("{first:#?}") };
    let [Some(low), Some(high)] = stiffness.ci95 else { panic!("{stiffness:?}") };
    assert!([800.0, 980.0].iter().any(|k| (low..high).contains(k) && (stiffness.value - k).abs() < 0.1 * k), "{stiffness:?}");
    assert!(said.remaining.unwrap().noise_sd.unwrap() < 1.1);
}

const PUSHED: &str = r#"
name = "pushed"
motion = "translation"
[bodies]
carriage = 0.5
[[elements]]
name = "drag"
kind = "damper"
between = ["carriage", "ground"]
damping = 4.0
[[inputs]]
name = "push"
kind = "force"
on = "carriage"
[[outputs]]
name = "speed"
kind = "velocity"
of = "carriage"
"#;

/// While a body only moves one way, dry friction and a constant force are one parameter; once it also moves back they are not.
#[test]
fn what_one_direction_cannot_tell_is_ambiguous_until_the_experiment_that_was_proposed() {
    let truth = format!("{PUSHED}\n[[elements]]\nname = \"rub\"\nkind = \"coulomb\"\nbetween = [\"carriage\", \"ground\"]\nforce = 0.6\n");
    let push = |f: f64| -> Vec<Course> {
        vec![Box::new(move |t| if t < 0.08 { 12.0 } else { 3.0 + 0.3 * (TAU * f * t).sin() + 0.2 * (TAU * 2.3 * f * t).sin() })]
    };
    let bench =
        Bench { truth: &truth, nominal: PUSHED, noise_sd: 1e-3, input_noise: 0.0, excitations: vec![push(1.0), push(1.7), push(1.3)] };
    let first = diagnose(bench.problem(5), &options::Options::default(), None, &|_| {}).unwrap();
    let said = &first.verdict;
    println!("{} {:?}", said.sentence, said.next_experiment);
    assert_eq!(said.word, Word::Ambiguous, "{}", said.sentence);
    let finding = &said.findings[0];
    let named: Vec<&str> =
        std::iter::once(&finding.physics).chain(finding.alternatives.iter().map(|a| &a.physics)).map(String::as_str).collect();
    assert!(named.contains(&"coulomb") && named.contains(&"bias") && finding.confidence < 0.6, "{finding:?}");
    let Some(NextExperiment::Planned(plan)) = &said.next_experiment else { panic!("{:?}", said.next_experiment) };
    assert!(plan.sensor.is_none() && plan.separation_sd.is_some_and(|sd| sd >= 1.5), "{plan:?}");

    // The same excitation applied twice: once to fit, once held out.
    let excitation: Excitation = plan.excitation.parse().unwrap();
    let played = excitation.samples(plan.rate_hz).unwrap();
    let mut problem = bench.problem(5);
    for seed in [71, 72] {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let device = Model::from_toml(&truth, "truth").unwrap();
        let clean = simulate(&device, std::slice::from_ref(&played), 1.0 / plan.rate_hz, &Options::default()).unwrap();
        let t = (0..played.len()).map(|k| k as f64 / plan.rate_hz).collect();
        let signals = vec![("push".to_string(), played.clone()), ("speed".to_string(), noisy(&clean[0], 1e-3, &mut random))];
        let record = Record::new(&Recording::new(format!("next-{seed}"), t, signals).unwrap(), &problem.model, Vec::new()).unwrap();
        if seed == 71 { problem.fit.push(record) } else { problem.held_out.push(record) }
    }
    let wider =
        Problem::new(PUSHED.to_string(), "nominal.toml".into(), problem.model, problem.fit, problem.held_out, Initial::Rest).unwrap();
    let second = diagnose(wider, &options::Options::default(), None, &|_| {}).unwrap().verdict;
    println!("{}", second.sentence);
    assert_eq!((second.word, second.findings[0].physics.as_str()), (Word::Missing, "coulomb"), "{}", second.sentence);
    assert!(second.findings[0].confidence > finding.confidence);
}

#[test]
fn a_velocity_in_steps_is_a_mean_over_a_sample_and_the_budget_says_so() {
    // The fastest motion turns by 0.63 rad in a sample: the mean over one is off by a twenty-fourth of the square of that.
    let (omega, step) = (TAU * 100.0, 1e-4);
    let text = format!(
        "name = 'cart'\n[bodies]\ncart = 1.0\n[[elements]]\nkind = 'damper'\nbetween = ['cart', 'ground']\ndamping = 5.0\n\
         [[inputs]]\nname = 'f'\nkind = 'force'\non = 'cart'\nhold = 'linear'\n\
         [[outputs]]\nname = 'v'\nkind = 'velocity'\nof = 'cart'\nresolution = {step}\n"
    );
    let excitation = |size: f64| -> Vec<Course> { vec![Box::new(move |t| size * omega * (omega * t).sin())] };
    let bench = Bench {
        truth: &text,
        nominal: &text,
        noise_sd: 1e-3,
        input_noise: 0.0,
        excitations: vec![excitation(0.1), excitation(0.2), excitation(0.15)],
    };
    let said = bench.said(1);
    assert!(said.findings.is_empty(), "{said:#?}");
    let budgeted = said.error_budget.iter().find(|e| e.source == Source::Differencing).unwrap();
    // Amplitudes of 0.1 and 0.2 m/s: the rms of their mean square over noise of 1 mm/s.
    let turn = omega * 1e-3;
    let expected = (0.5 * (0.1f64.powi(2) + 0.2f64.powi(2)) / 2.0).sqrt() * turn * turn / 24.0 / 1e-3;
    assert!((budgeted.noise_sd / expected - 1.0).abs() < 0.15, "{budgeted:?}, expected {expected}");
}
