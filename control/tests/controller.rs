//! The laws against the equations that they were derived from.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_control::controller::*;
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_msgs::Sample;
use backdrive_plant::model::Model;
use naming::assert_names;
use std::f64::consts::TAU;

fn axis(friction: &str) -> Model {
    let text = format!(
        "motion = \"rotation\"\n[bodies]\nscrew = 0.005\n[[elements]]\nname = \"friction\"\nbetween = [\"screw\", \"ground\"]\n{friction}\n\
         [[elements]]\nname = \"viscous\"\nkind = \"damper\"\nbetween = [\"screw\", \"ground\"]\ndamping = 0.01\n\
         [[inputs]]\nname = \"torque\"\nkind = \"force\"\non = \"screw\"\n[[outputs]]\nname = \"angle\"\nkind = \"position\"\nof = \"screw\"\n\
         [[axes]]\nname = \"turn\"\nuser = \"screw\"\nfeedback = \"torque\"\nmeasured = \"angle\"\n"
    );
    Model::from_toml(&text, "axis.toml").unwrap()
}

const PREISACH: &str = "kind = \"preisach_lugre\"\nstiffness = 20.0\ndamping = 0.02\ncoulomb = 0.26\nstatic = 0.3\nvelocity = 0.5\n\
                        break_away = 0.195\nloop_force = 0.35\nloop_slope = 20.0\ngate = 0.45";
const LUGRE: &str = "kind = \"lugre\"\nstiffness = 20.0\ndamping = 0.02\ncoulomb = 0.26\nstatic = 0.3\nvelocity = 0.5";

const GAINS: backstepping::Gains = backstepping::Gains {
    surface: 40.0,
    stabilising: 20.0,
    reaching: 60.0,
    switching: 5.0,
    boundary: 0.0,
    adaptation: [50.0, 2e-3, 1e-3],
    start: 1.0,
};

/// A repeatable number from -1 to 1.
fn number(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    2.0 * (*state >> 11) as f64 / (1u64 << 53) as f64 - 1.0
}

/// States all over presliding and sliding, with the bristles that the model has there.
fn states(model: &Model) -> Vec<(Reference, State, Bristles)> {
    let mut known = AxisModel::new(model, 0).unwrap();
    let (mut seed, mut at) = (3, 0.0);
    (0..2000)
        .map(|k| {
            let to = at + if k % 40 < 30 { 0.02 } else { 0.5 } * number(&mut seed);
            known.advance(at, to, 1e-2);
            let state = State { position: to, velocity: (to - at) / 1e-2 };
            at = to;
            let reference = Reference {
                position: at + 0.1 * number(&mut seed),
                velocity: state.velocity + 2.0 * number(&mut seed),
                acceleration: 50.0 * number(&mut seed),
            };
            (reference, state, known.bristles(state.velocity).unwrap())
        })
        .collect()
}

/// q'' of eqs (17) and (18) under a force, with these true parameters.
fn acceleration(u: f64, v: f64, b: &Bristles, truth: &backstepping::Estimates) -> f64 {
    let h = b.force / b.stiffness;
    (u - truth.stiffness * h - truth.viscous * v + truth.damping * b.leak * b.force) / 0.005
}

/// S' = k ξ1' + ξ2', with ξ2' = q_r'' - q'' + c ξ1'.
fn surface_rate(reference: &Reference, state: &State, q2: f64) -> f64 {
    let error_rate = reference.velocity - state.velocity;
    GAINS.surface * error_rate + reference.acceleration - q2 + GAINS.stabilising * error_rate
}

#[test]
fn with_the_true_numbers_the_surface_obeys_its_reaching_law() {
    for friction in [PREISACH, LUGRE] {
        let model = axis(friction);
        let law = Backstepping::new(GAINS, AxisModel::new(&model, 0).unwrap()).unwrap();
        let truth = law.estimates();
        assert_eq!((truth.stiffness, truth.damping, truth.viscous), (20.0, 0.02, 0.03));
        for (reference, state, bristles) in states(&model) {
            let u = law.command(&reference, &state, &bristles, &truth);
            let surface = law.surface(&reference, &state);
            let rate = surface_rate(&reference, &state, acceleration(u, state.velocity, &bristles, &truth));
            let wanted = -GAINS.reaching * surface - GAINS.switching * surface.signum();
            assert!((rate - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "{rate} {wanted}");
        }
    }
}

#[test]
fn lyapunovs_function_falls_with_the_minus_sign_of_the_third_law_and_not_without() {
    let model = axis(PREISACH);
    let law = Backstepping::new(GAINS, AxisModel::new(&model, 0).unwrap()).unwrap();
    let truth = law.estimates();
    let (mut seed, mut rises_with_plus) = (11, 0);
    for (reference, state, bristles) in states(&model) {
        let mut off = || 1.0 + 0.8 * number(&mut seed);
        let hats =
            backstepping::Estimates { stiffness: truth.stiffness * off(), damping: truth.damping * off(), viscous: truth.viscous * off() };
        let u = law.command(&reference, &state, &bristles, &hats);
        let surface = law.surface(&reference, &state);
        let rate = surface_rate(&reference, &state, acceleration(u, state.velocity, &bristles, &truth));
        let rates = law.rates(surface, state.velocity, &bristles);
        let [g0, g1, g12] = GAINS.adaptation;
        // V = S²/2 + Σ (σ - σ^)²/(2 γ), eq (28).
        let falls = |third: f64| {
            surface * rate
                - (truth.stiffness - hats.stiffness) * rates.stiffness / g0
                - (truth.damping - hats.damping) * third * rates.damping / g1
                - (truth.viscous - hats.viscous) * rates.viscous / g12
        };
        let wanted = -GAINS.reaching * surface * surface - GAINS.switching * surface.abs();
        assert!((falls(1.0) - wanted).abs() < 1e-8 * (1.0 + wanted.abs()), "{} {wanted}", falls(1.0));
        rises_with_plus += usize::from(falls(-1.0) > wanted + 1e-6 && bristles.leak > 0.0);
    }
    assert!(rises_with_plus > 100, "{rises_with_plus}");
}

#[test]
fn sliding_mode_reaches_its_surface_as_asked_where_nothing_rubs() {
    let mut model = axis(LUGRE);
    model.elements.clear();
    let gains = sliding_mode::Gains { surface: 30.0, reaching: 60.0, switching: 5.0, boundary: 0.0 };
    let mut law = SlidingMode::new(gains, AxisModel::new(&model, 0).unwrap(), Feedforward::None);
    let (mut seed, period) = (1, 1e-3);
    for _ in 0..100 {
        let mut n = || number(&mut seed);
        let (reference, state) = (Reference { position: n(), velocity: n(), acceleration: n() }, State { position: n(), velocity: n() });
        let q2 = law.effort(&reference, &state, period) / 0.005;
        let surface = law.surface(&reference, &state);
        let rate = reference.acceleration - q2 + 30.0 * (reference.velocity - state.velocity);
        assert!((rate + 60.0 * surface + 5.0 * surface.signum()).abs() < 1e-9);
    }
    assert_eq!(
        [switching_sign(0.0, 0.0), switching_sign(-1e-9, 0.0), switching_sign(0.5, 2.0), switching_sign(9.0, 2.0)],
        [0.0, -1.0, 0.25, 1.0]
    );
}

#[test]
fn a_reference_of_steps_becomes_smooth_and_a_ramp_keeps_its_speed() {
    let mut filter = ReferenceFilter::new(20.0, 1e-3);
    assert_eq!(filter.step(0.3), Reference { position: 0.3, velocity: 0.0, acceleration: 0.0 });
    let mut last = Reference::default();
    for k in 0..2000 {
        let now = filter.step(0.3 + 2e-3 * f64::from(k));
        if k > 0 {
            // Speed and acceleration are those of the position that is given.
            assert!((now.position - last.position - 0.5e-3 * (now.velocity + last.velocity)).abs() < 1e-5);
        }
        last = now;
    }
    assert!((last.velocity - 2.0).abs() < 1e-9 && last.acceleration.abs() < 1e-6, "{last:?}");
    // A filter of two poles at w lags 2/w behind a ramp.
    assert!((0.3 + 2e-3 * 1999.0 - last.position - 2.0 * 2.0 / (TAU * 20.0)).abs() < 1e-9);
    let mut differences = Differentiator::new(100.0);
    let v: Vec<f64> = (0..500).map(|k| differences.step(0.5 * f64::from(k), 1e-3)).collect();
    assert!(v[0] == 0.0 && (v[499] - 500.0).abs() < 1e-9);
}

#[test]
fn a_model_that_these_laws_are_not_for_is_refused_in_words() {
    let settings = |law| Settings { law, reference_hz: 20.0, velocity_hz: 100.0 };
    let refused = |law, model: Option<&Model>| Controller::new(1, &settings(law), model, 0.02, 1e-3).err().unwrap().to_string();
    assert!(refused(Law::Backstepping(GAINS), None).contains("needs a model"));
    let coulomb = axis("kind = \"coulomb\"\nforce = 0.3");
    assert_names(refused(Law::Backstepping(GAINS), Some(&coulomb)), &["lugre", "preisach_lugre"]);
    let mut two = axis(PREISACH);
    two.elements[1].law = backdrive_plant::elements::Law::Spring(backdrive_plant::elements::Spring { stiffness: 1.0, rest: 0.0 });
    assert!(refused(Law::Backstepping(GAINS), Some(&two)).contains("spring to ground"));
    assert!(
        Controller::new(2, &settings(Law::Backstepping(GAINS)), Some(&axis(PREISACH)), 0.02, 1e-3)
            .err()
            .unwrap()
            .to_string()
            .contains("no such axis")
    );
}

#[test]
fn the_node_holds_before_commands_and_falls_silent_without_measurements() {
    let model = axis(PREISACH);
    let law = Law::Pd(pd::Gains { stiffness: 10.0, damping: 0.1 }, Feedforward::None);
    let mut node = Controller::new(1, &Settings { law, reference_hz: 50.0, velocity_hz: 100.0 }, Some(&model), 0.01, 1e-3).unwrap();
    let mut step = |k: u64, command: Option<f64>, measured: Option<f64>| {
        let port = |value: Option<f64>| {
            let sample = value.map(|x| {
                let mut sample = Sample::new(1);
                (sample.step, sample.position[0]) = (k, x);
                sample
            });
            Port { sample, age_steps: 0 }
        };
        let mut out = [Sample::new(1)];
        node.step(
            &Tick { step: k, time_s: 1e-3 * k as f64, period_s: 1e-3 },
            &[port(command), port(measured)],
            &mut out,
            &mut Events::default(),
        );
        out[0].effort[0]
    };
    assert!(step(0, None, None).is_nan());
    assert_eq!(step(1, None, Some(0.7)), 0.0);
    assert!(step(2, None, Some(0.6)) > 0.9);
    let pushes = (3..100).map(|k| step(k, Some(1.0), Some(0.6))).last().unwrap();
    assert!((pushes - 4.0).abs() < 0.05, "{pushes}");
    assert!(!step(105, None, None).is_nan());
    for k in 106..130 {
        step(k, Some(1.0), None);
    }
    assert!(step(130, Some(1.0), None).is_nan());
}
