//! Modes, poles and frequency responses against closed forms and the papers.

use backdrive_plant::elements::{Coulomb, Law, Spring};
use backdrive_plant::linear::{Friction, LinearError, LinearModel, Operating, frequency_response, log_frequencies};
use backdrive_plant::model::{Fragment, Model};
use nalgebra::Complex;
use std::f64::consts::{PI, TAU};
use std::path::Path;

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn device(name: &str) -> Model {
    Model::load(&file(&format!("models/{name}.toml"))).unwrap_or_else(|e| panic!("{e}"))
}

fn parameter(model: &Model, element: &str, index: usize) -> f64 {
    model.elements.iter().find(|e| e.name == element).unwrap().law.values()[index][0]
}

fn held(mut model: Model, grip: &str) -> Model {
    let grip = Fragment::load(&file(&format!("grips/{grip}.toml"))).unwrap_or_else(|e| panic!("{e}"));
    let user = model.axes[0].user;
    model.attach(&grip, user, "grip");
    model
}

/// A body that does not move: prescribed, with nothing to prescribe.
fn lock(model: &mut Model, body: &str) {
    let text = format!("[bodies]\n{body} = 1\n[[inputs]]\nname = \"lock\"\nkind = \"motion\"\non = \"{body}\"");
    let mut input = Model::from_toml(&text, "lock").unwrap().inputs.remove(0);
    input.on = model.bodies.iter().position(|b| b.name == body).unwrap();
    model.inputs.push(input);
}

fn peak_hz(model: &Model, at: &Operating, from: f64, to: f64) -> f64 {
    let f = log_frequencies(from, to, 20_001);
    let r = LinearModel::new(model, at).unwrap().response(0, 0, &f).unwrap();
    let best = (0..f.len()).max_by(|a, b| r[*a].norm().total_cmp(&r[*b].norm())).unwrap();
    f[best]
}

fn modes_hz(model: &Model, at: &Operating) -> Vec<f64> {
    LinearModel::new(model, at).unwrap().modes().unwrap().iter().map(|m| m.frequency_hz()).collect()
}

/// Check 7 of the papers: `f0 sqrt(1 - 2 zeta²)` from the configured numbers.
#[test]
fn drum_locked_sweep_peaks_where_the_cable_says() {
    let mut m = device("impulse-engine");
    lock(&mut m, "drum");
    let (k, b, mass) = (parameter(&m, "cable", 0), parameter(&m, "cable_damping", 0), m.bodies[0].inertia);
    let zeta = b / 2.0 / (k * mass).sqrt();
    let expected = (k / mass).sqrt() / TAU * (1.0 - 2.0 * zeta * zeta).sqrt();
    let peak = peak_hz(&m, &Operating::small(), 100.0, 500.0);
    assert!((peak / expected - 1.0).abs() < 1e-3, "{peak} {expected}");
    assert!((peak - 302.7).abs() < 0.3, "{peak}");
}

#[test]
fn held_engine_has_the_modes_of_reading_r1() {
    let near = |found: Vec<f64>, expected: [f64; 3]| {
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 0.05, "{found:?} {expected:?}");
        }
    };
    // The modes that the papers' restatement quotes for R1 are those on the rising asymptote, k_lp = 3900 N/m.
    let mut rising = device("impulse-engine-linear");
    let linkage = rising.elements.iter().position(|e| e.name == "linkage").unwrap();
    rising.elements[linkage].law = Law::Spring(Spring { stiffness: parameter(&device("impulse-engine"), "linkage", 0), rest: 0.0 });
    near(modes_hz(&held(rising, "normal"), &Operating::small()), [12.1, 77.4, 390.5]);
    near(modes_hz(&held(device("impulse-engine-linear"), "normal"), &Operating::small()), [12.1, 77.85, 390.5]);
    // With hysteresis the middle mode falls with amplitude towards that of the mean asymptote.
    let m = held(device("impulse-engine"), "normal");
    let middle: Vec<f64> = [1e-9, 1e-5, 1e-4, 1e-3, 1e-1].iter().map(|a| modes_hz(&m, &Operating::amplitude(*a))[1]).collect();
    assert!(middle.windows(2).all(|w| w[1] < w[0]), "{middle:?}");
    assert!((middle[0] - 94.7).abs() < 0.1 && (middle[4] - 77.85).abs() < 0.1, "{middle:?}");
}

/// A grip goes on each axis of a device with several, and the chains stay apart but for their coupling.
#[test]
fn two_axes_take_a_grip_each() {
    let mut m = device("two-axis");
    let grip = Fragment::load(&file("grips/normal.toml")).unwrap();
    for axis in 0..2 {
        let user = m.axes[axis].user;
        m.attach(&grip, user, &format!("grip.{axis}"));
    }
    let linear = LinearModel::new(&m, &Operating::small()).unwrap();
    assert_eq!(linear.free.len(), 4);
    assert!(linear.modes().unwrap()[0].frequency_hz() > 5.0);
    let r = |input: usize, output: usize| linear.response(input, output, &[1.0]).unwrap()[0].norm();
    assert!(r(0, 1) > 0.0 && r(0, 1) < 0.3 * r(0, 0), "{} {}", r(0, 1), r(0, 0));
    assert!((r(0, 1) / r(1, 0) - 1.0).abs() < 1e-9, "a passive network is reciprocal");
}

#[test]
fn hysteresis_shows_its_stiffness_at_each_amplitude() {
    let m = device("impulse-engine");
    let index = m.elements.iter().position(|e| e.name == "linkage").unwrap();
    let p = |i: usize| parameter(&m, "linkage", i);
    let asymptote = (p(0) + p(1)) / 2.0;
    let small = asymptote + p(4) * (p(2) - p(3)) / 2.0;
    let at = |amplitude: f64| LinearModel::new(&m, &Operating::amplitude(amplitude)).unwrap().elements[index].stiffness;
    assert!((at(1e-9) / small - 1.0).abs() < 1e-4, "{}", at(1e-9));
    assert!((at(0.1) / asymptote - 1.0).abs() < 1e-3, "{}", at(0.1));
    assert!(at(1e-5) > at(1e-4) && at(1e-4) > at(1e-3));
}

#[test]
fn two_masses_match_the_closed_form() {
    let text = "[bodies]\na = 0.2\nb = 0.3\n[[elements]]\nkind='spring'\nbetween=['a','b']\nstiffness=500\n\
        [[elements]]\nkind='damper'\nbetween=['a','b']\ndamping=0.4\n\
        [[inputs]]\nname='u'\nkind='force'\non='a'\ngain=2\ndelay=0.001\nbandwidth=100\n\
        [[outputs]]\nname='y'\nkind='position'\nof='b'\ndelay=0.002\ngain=3\n\
        [[outputs]]\nname='v'\nkind='velocity'\nof='a'\n[[outputs]]\nname='f'\nkind='force'\nelement=['element0','element1']\n";
    let m = Model::from_toml(text, "x").unwrap();
    let linear = LinearModel::new(&m, &Operating::small()).unwrap();
    let (m1, m2, k, b) = (0.2, 0.3, 500.0, 0.4);
    let omega = f64::sqrt(k * (1.0 / m1 + 1.0 / m2));
    let modes = linear.modes().unwrap();
    assert_eq!(modes[0].frequency_hz(), 0.0);
    assert!((modes[1].omega_squared.sqrt() / omega - 1.0).abs() < 1e-12);
    assert!((modes[1].shape[0] / modes[1].shape[1] + m2 / m1).abs() < 1e-9);
    let poles = linear.poles().unwrap();
    let zeta = b * (1.0 / m1 + 1.0 / m2) / 2.0 / omega;
    let pair = poles.last().unwrap();
    assert!((pair.damping_ratio() / zeta - 1.0).abs() < 1e-9 && (pair.frequency_hz() * TAU / omega - 1.0).abs() < 1e-9);
    assert_eq!(poles.iter().filter(|p| p.frequency_hz() == 0.0).count(), poles.len() - 1);
    for f in [0.5, 7.0, 40.0] {
        let s = Complex::new(0.0, TAU * f);
        let drive = 2.0 * (-s * 0.001).exp() / (1.0 + s / (TAU * 100.0));
        let d = s * (m1 * m2 * s * s + (m1 + m2) * (b * s + k)) * s;
        let sensed = 3.0 * (-s * 0.002).exp();
        let near = |output: usize, expected: Complex<f64>| {
            let found = linear.response(0, output, &[f]).unwrap()[0];
            assert!((found - expected).norm() < 1e-9 * expected.norm(), "{f} Hz output {output}: {found} {expected}");
        };
        let xb = drive * (b * s + k) / d;
        let xa = drive * (m2 * s * s + b * s + k) / d;
        near(0, xb * sensed);
        near(1, s * xa);
        near(2, (k + b * s) * (xa - xb));
    }
    assert_eq!(linear.response(0, 0, &[0.0]), Err(LinearError::Infinite { frequency_hz: 0.0 }));
    assert!(frequency_response(&m, &Operating::small(), "u", "nothing", &[1.0]).is_none());
    assert_eq!(linear.response(1, 0, &[1.0]), Err(LinearError::NoSuch { what: "input", index: 1 }));
}

#[test]
fn back_emf_is_a_damper_on_the_driven_body() {
    let text = "[bodies]\na = 0.2\n[[elements]]\nkind='spring'\nbetween=['a','ground']\nstiffness=500\nDAMPER\
        [[inputs]]\nname='u'\nkind='force'\non='a'\nEMF\n[[outputs]]\nname='y'\nkind='position'\nof='a'\n";
    let with = |damper: &str, emf: &str| Model::from_toml(&text.replace("DAMPER", damper).replace("EMF", emf), "x").unwrap();
    let response = |m: Model| frequency_response(&m, &Operating::small(), "u", "y", &[3.0, 9.0]).unwrap().unwrap();
    let emf = response(with("", "back_emf=1.5"));
    let damper = response(with("[[elements]]\nkind='damper'\nbetween=['a','ground']\ndamping=1.5\n", ""));
    assert_eq!(emf, damper);
}

/// Equation (2) of the steering compensator: a reaction on a massless prescribed body, and bodies that only inerters give inertia.
#[test]
fn compensator_admittance_is_the_papers_equation() {
    let model = |c: f64| {
        let text = format!(
            "[bodies]\nram = 0\ndisc = 0\nflywheel = 0\n[[elements]]\nkind='spring'\nbetween=['ram','disc']\nstiffness=480e3\n\
            [[elements]]\nkind='inerter'\nbetween=['disc','ground']\ninertance=21.6\n[[elements]]\nkind='damper'\n\
            between=['disc','flywheel']\ndamping={c}\n[[elements]]\nkind='inerter'\nbetween=['flywheel','ground']\ninertance=98.4\n\
            [[inputs]]\nname='x'\nkind='motion'\non='ram'\n[[outputs]]\nname='F'\nkind='reaction'\nof='ram'\n"
        );
        Model::from_toml(&text, "x").unwrap()
    };
    let (k, b, b1) = (480e3, 98.4, 21.6);
    let admittance = |c: f64, f: f64| {
        let s = Complex::new(0.0, TAU * f);
        frequency_response(&model(c), &Operating::small(), "x", "F", &[f]).unwrap().unwrap()[0] / s
    };
    for c in [690.0, 1380.0, 5518.0] {
        for f in [0.1, 3.24, 18.0, 35.0] {
            let s = Complex::new(0.0, TAU * f);
            let expected = k * s * (b * b1 * s + c * (b + b1)) / (b * b1 * s * s * s + c * (b + b1) * s * s + k * b * s + k * c);
            let found = admittance(c, f);
            assert!((found - expected).norm() < 1e-9 * expected.norm(), "c {c} at {f} Hz: {found} {expected}");
        }
        let omega = f64::sqrt(0.5 * (k / b1 + k / (b + b1)));
        assert!((omega / TAU - 18.2238).abs() < 1e-4);
        assert!((admittance(c, omega / TAU).norm() / 6032.3932 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn friction_is_ignored_or_the_damper_that_takes_as_much() {
    let mut m = device("rigid-mass");
    m.elements.push(backdrive_plant::model::Element {
        name: "dry".into(),
        between: [Some(0), None],
        law: Law::Coulomb(Coulomb { force: 0.1 }),
    });
    let at = Operating { friction: Friction::Viscous, frequency_hz: 5.0, ..Operating::amplitude(1e-3) };
    let linear = LinearModel::new(&m, &at).unwrap();
    let expected = 4.0 * 0.1 / (PI * 1e-3 * TAU * 5.0);
    assert!((linear.elements[1].damping / expected - 1.0).abs() < 1e-5);
    assert_eq!(LinearModel::new(&m, &Operating::amplitude(1e-3)).unwrap().elements[1].damping, 0.0);
    assert!(matches!(LinearModel::new(&m, &Operating::amplitude(0.0)), Err(LinearError::Operating { .. })));
}

#[test]
fn a_wall_is_free_space_until_it_is_looked_at_where_it_touches() {
    let wall = Fragment::load(&file("environments/stiff-wall.toml")).unwrap();
    let mut slave = device("slave");
    let user = slave.axes[0].user;
    let on = slave.attach(&wall, user, "wall");
    let element = on.elements[0];
    assert_eq!(LinearModel::new(&slave, &Operating::amplitude(1e-4)).unwrap().elements[element].stiffness, 0.0);
    let touching = Operating { about: vec![(element, 0.006)], ..Operating::amplitude(1e-4) };
    let linear = LinearModel::new(&slave, &touching).unwrap();
    assert!((linear.elements[element].stiffness / 5000.0 - 1.0).abs() < 1e-9);
    let held = LinearModel::new(&slave, &Operating::amplitude(1e-4)).unwrap();
    let pole = held.poles().unwrap()[0];
    assert!((pole.frequency_hz() - 60.0).abs() < 1e-3 && (pole.damping_ratio() - 0.7).abs() < 1e-4, "{pole:?}");
}

#[test]
fn bodies_without_any_inertia_are_named() {
    let mut m = device("rigid-mass");
    m.bodies[0].inertia = 0.0;
    let error = LinearModel::new(&m, &Operating::small()).unwrap().modes().unwrap_err();
    assert_eq!(error.to_string(), "body \"handle\" has neither inertia nor an inerter");
}
