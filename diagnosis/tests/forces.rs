//! Motion and force both recorded: laws are named from the forces along the motion, also where the motion is known to a step and the drive rests.

use backdrive_diagnosis::diagnose::diagnose;
use backdrive_diagnosis::options::Options;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_diagnosis::verdict::{Parameter, Verdict, Word};
use backdrive_plant::model::Model;
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const NOMINAL: &str = r#"
name = "lever"
motion = "rotation"
[bodies]
lever = 0.02
[[elements]]
name = "viscous"
kind = "damper"
between = ["lever", "ground"]
damping = 0.05
[[inputs]]
name = "angle"
kind = "motion"
on = "lever"
[[outputs]]
name = "torque"
kind = "reaction"
of = "lever"
"#;

const RATE: f64 = 500.0;

/// An angle and its first two derivatives.
type Motion = Box<dyn Fn(f64) -> [f64; 3]>;

/// A sum of waves: amplitude in rad, frequency in Hz, phase.
fn waves(all: &'static [(f64, f64, f64)]) -> Motion {
    Box::new(move |t| {
        all.iter().fold([0.0; 3], |[q, v, a], (amplitude, hz, phase)| {
            let w = std::f64::consts::TAU * hz;
            let (sin, cos) = (w * t + phase).sin_cos();
            [q + amplitude * sin, v + amplitude * w * cos, a - amplitude * w * w * sin]
        })
    })
}

/// Diagnosis of recordings of 12 s. Each begins with a rest of `rest_s` seconds, in which the torque and the motion are exactly constant.
fn said(hidden: impl Fn([f64; 3]) -> f64, noise: f64, rest_s: f64, step: f64) -> Verdict {
    let model = Model::from_toml(NOMINAL, "lever.toml").unwrap();
    let motions: [Motion; 3] = [
        waves(&[(0.5, 0.31, 0.0), (0.2, 0.83, 1.0), (0.05, 2.1, 2.0)]),
        waves(&[(0.6, 0.23, 0.5), (0.15, 1.1, 0.0), (0.04, 2.9, 1.0)]),
        waves(&[(0.55, 0.27, 2.0), (0.18, 0.95, 0.3), (0.05, 2.4, 0.7)]),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let records: Vec<Record> = motions
        .iter()
        .enumerate()
        .map(|(index, motion)| {
            let t: Vec<f64> = (0..6000).map(|k| f64::from(k) / RATE).collect();
            let (mut angle, mut torque, mut slow) = (Vec::new(), Vec::new(), 0.0);
            for time in &t {
                // Out of a rest it speeds up in about a second.
                let since = (time - rest_s).max(0.0);
                let [warped, rate, change] = match rest_s > 0.0 {
                    true => [since * since / (since + 1.0), since * (since + 2.0) / (since + 1.0).powi(2), 2.0 / (since + 1.0).powi(3)],
                    false => [*time, 1.0, 0.0],
                };
                let [q, v, a] = motion(warped);
                let [q, v, a] = if *time < rest_s { [q, 0.0, 0.0] } else { [q, v * rate, a * rate * rate + v * change] };
                // What a machine has beside its laws is slow as well as fast.
                let fresh: f64 = StandardNormal.sample(&mut random);
                slow = 0.98 * slow + 0.2 * fresh;
                let noise = noise * (0.7 * slow + 0.7 * fresh);
                angle.push((q / step).round() * step);
                torque.push(if *time < rest_s { 0.0 } else { 0.02 * a + 0.05 * v + hidden([q, v, a]) + noise });
            }
            let signals = vec![("angle".to_string(), angle), ("torque".to_string(), torque)];
            Record::new(&Recording::new(format!("{index}.csv"), t, signals).unwrap(), &model, Vec::new()).unwrap()
        })
        .collect();
    let (fit, held_out) = (records[..2].to_vec(), records[2..].to_vec());
    let problem = Problem::new(NOMINAL.to_string(), "lever.toml".into(), model, fit, held_out, Initial::Free).unwrap();
    diagnose(problem, &Options::default(), None, &|_| ()).unwrap().verdict
}

fn number(verdict: &Verdict, physics: &str, key: &str) -> f64 {
    let finding = verdict.findings.iter().find(|f| f.physics == physics).unwrap_or_else(|| panic!("no {physics}: {:?}", verdict.findings));
    match &finding.parameters[key] {
        Parameter::One(one) => one.value,
        Parameter::List(list) => list.value[0],
    }
}

#[test]
fn friction_and_a_ripple_are_named_from_forces_with_their_numbers() {
    let ripple = |q: f64| 0.06 * (std::f64::consts::TAU * q / 0.21 + 0.4).sin();
    let verdict = said(|[q, v, _]| 0.1 * v.signum() + ripple(q), 0.02, 0.0, 1e-4);
    assert!(matches!(verdict.word, Word::Missing | Word::Ambiguous), "{}", verdict.sentence);
    assert_eq!(verdict.findings.len(), 2, "{:?}", verdict.findings);
    assert!((number(&verdict, "coulomb", "force") - 0.1).abs() < 0.01);
    assert!((number(&verdict, "cogging", "amplitude").abs() - 0.06).abs() < 0.01);
    assert!((number(&verdict, "cogging", "period") - 0.21).abs() < 0.005);
    assert!(verdict.findings.iter().all(|f| f.family_confidence > 0.9), "{:?}", verdict.findings);
    let errors = &verdict.held_out;
    assert!(errors.nrmse_after.unwrap() < 0.5 * errors.nrmse_before.unwrap(), "{errors:?}");
}

#[test]
fn friction_beside_a_spring_of_unknown_zero_is_not_told_from_friction_by_direction() {
    // 0.08 and 0.12 N m by direction are 0.1 N m and a constant of 0.02 N m, which is where the spring has its zero.
    let by_direction = |v: f64| if v > 0.0 { 0.08 } else { -0.12 };
    for constant in [0.0, 0.02] {
        let verdict = said(move |[q, v, _]| by_direction(v) + constant + 0.5 * q, 0.02, 0.0, 1e-4);
        assert!((number(&verdict, "coulomb", "force") - 0.1).abs() < 0.01);
        assert!((number(&verdict, "spring", "stiffness") - 0.5).abs() < 0.05);
        let friction = verdict.findings.iter().find(|f| f.physics == "coulomb").unwrap();
        assert!(friction.confidence <= 0.5 && friction.family_confidence > 0.9, "{friction:?}");
        assert!(verdict.audit.iter().any(|remark| remark.what == "same_force"), "{:?}", verdict.audit);
    }
    // Without a spring a constant is seen.
    let verdict = said(move |[_, v, _]| by_direction(v), 0.02, 0.0, 1e-4);
    let friction = verdict.findings.iter().find(|f| f.physics == "asymmetric_coulomb").unwrap_or_else(|| panic!("{:?}", verdict.findings));
    assert!(friction.family_confidence > 0.9 && verdict.audit.iter().all(|remark| remark.what != "same_force"), "{friction:?}");
}

#[test]
fn a_drive_that_logs_zeros_while_it_rests_hides_nothing() {
    let verdict = said(|[_, v, _]| 0.1 * v.signum(), 0.02, 2.0, 1e-4);
    // A torque of 0 at rest may as well be a friction that is lower there: the level at speed is known.
    let finding = &verdict.findings[0];
    let key = if finding.physics == "coulomb" { "force" } else { "coulomb" };
    assert_eq!(finding.family, Some(backdrive_diagnosis::hypothesis::Family::Friction), "{:?}", verdict.findings);
    assert!((number(&verdict, &finding.physics, key) - 0.1).abs() < 0.01, "{:?}", verdict.findings);
    assert!(verdict.findings[0].family_confidence > 0.9, "{:?}", verdict.findings);
}

#[test]
fn a_device_that_lacks_nothing_is_left_alone_whatever_the_step_of_its_encoder() {
    for step in [1e-5, 1e-3] {
        let verdict = said(|_| 0.0, 0.01, 0.0, step);
        assert!(verdict.findings.is_empty(), "step {step}: {} {:?}", verdict.sentence, verdict.findings);
    }
}
