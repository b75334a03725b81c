//! The stepper against textbook solutions.

mod stepper_common;

use backdrive_plant::model::OutputKind::{Force, Position, Reaction, Velocity};
use backdrive_plant::stepper::{Options, Plant, Segment};
use std::f64::consts::TAU;
use stepper_common::*;

#[test]
fn coulomb_takes_four_c_over_k_from_each_cycle_and_then_holds() {
    let (m, k, c, period) = (0.5, 800.0, 0.6, 1e-4);
    let model =
        model(&[m], vec![spring([at(0), GROUND], k), coulomb([at(0), GROUND], c)], vec![force_input(0)], vec![Position(0), Velocity(0)]);
    let y = run(&model, &[knock(40_000, period, 1.0)], period, None);
    let x = &y[0];
    // Peak of the parabola through the highest sample and its neighbours.
    let peaks: Vec<f64> = (30..x.len() - 1)
        .filter(|i| x[*i] > x[i - 1] && x[*i] >= x[i + 1] && x[*i] > 3.0 * c / k)
        .map(|i| x[i] + (x[i + 1] - x[i - 1]).powi(2) / (8.0 * (2.0 * x[i] - x[i - 1] - x[i + 1])))
        .collect();
    assert!(peaks.len() > 5);
    for pair in peaks.windows(2) {
        assert!(((pair[0] - pair[1]) / (4.0 * c / k) - 1.0).abs() < 2e-5, "{}", pair[0] - pair[1]);
    }
    let rest = &x[x.len() - 2000..];
    assert_eq!(range(rest), 0.0, "creeps");
    assert_eq!(largest(y[1][x.len() - 2000..].iter().copied()), 0.0);
    assert!(rest[0].abs() <= c / k);
}

#[test]
fn free_chain_has_its_frequency_both_exactly_and_by_substeps() {
    let (m1, m2, k, period) = (0.3, 1.1, 4000.0, 1e-4);
    let linear = model(&[m1, m2], vec![spring([at(0), at(1)], k)], vec![force_input(0)], vec![Position(0), Position(1)]);
    let mut by_substeps = linear.clone();
    by_substeps.elements.push(coulomb([at(0), at(1)], 0.0));
    for (model, tolerance) in [(linear, 1e-7), (by_substeps, 1e-6)] {
        let y = run(&model, &[knock(20_000, period, 0.1)], period, None);
        let relative: Vec<f64> = y[0].iter().zip(&y[1]).map(|(a, b)| a - b).collect();
        let crossings: Vec<f64> = (100..relative.len() - 1)
            .filter(|i| relative[*i] < 0.0 && relative[i + 1] >= 0.0)
            .map(|i| i as f64 + relative[i] / (relative[i] - relative[i + 1]))
            .collect();
        let cycles = (crossings.len() - 1) as f64;
        let w = TAU * cycles / ((crossings[crossings.len() - 1] - crossings[0]) * period);
        assert!((w / (k * (1.0 / m1 + 1.0 / m2)).sqrt() - 1.0).abs() < tolerance, "{w}");
    }
}

#[test]
fn long_periods_do_not_hurt_a_linear_model() {
    let elements =
        vec![spring([at(0), at(1)], 4e4), damper([at(0), at(1)], 3.0), spring([at(1), GROUND], 500.0), damper([at(1), GROUND], 5.0)];
    let model = model(&[0.02, 0.1], elements, vec![force_input(0)], vec![Position(0), Velocity(1)]);
    let slow = samples(200, 1e-2, |t| (9.0 * t).sin());
    let fine: Vec<f64> = (0..199 * 50 + 1)
        .map(|i| {
            let (whole, rest) = (i / 50, (i % 50) as f64 / 50.0);
            if whole + 1 < slow.len() { slow[whole] + rest * (slow[whole + 1] - slow[whole]) } else { slow[whole] }
        })
        .collect();
    let (a, b) = (run(&model, std::slice::from_ref(&slow), 1e-2, None), run(&model, &[fine], 2e-4, None));
    for (a, b) in a.iter().zip(&b) {
        let every: Vec<f64> = b.iter().step_by(50).copied().collect();
        assert!(difference(a, &every) < 1e-11, "{}", difference(a, &every));
    }
}

#[test]
fn energy_balances_with_everything_at_once() {
    let elements = vec![
        spring([at(0), at(1)], 3000.0),
        damper([at(0), at(1)], 1.5),
        coulomb([at(0), GROUND], 0.3),
        element("stribeck", [at(1), GROUND], &[0.2, 0.35, 0.01]),
        spring([at(1), GROUND], 500.0),
        element("quadratic_drag", [at(1), GROUND], &[2.0]),
        element("lugre", [at(1), GROUND], &[1e4, 10.0, 0.1, 0.15, 0.01]),
        element("hunt_crossley", [at(0), GROUND], &[1e5, 1e4, 1.5, 2e-3]),
        element("bias", [at(0), GROUND], &[0.1]),
        spring([at(2), at(1)], 300.0),
        element("inerter", [at(2), at(1)], &[0.02]),
    ];
    let mut push = force_input(0);
    push.back_emf = 0.4;
    let model = model(&[0.1, 0.2, 0.05], elements, vec![push, motion_input(2)], vec![]);
    let period = 1e-4;
    let mut plant = Plant::new(&model, period, &Options { substeps: Some(10), ..Options::default() }).expect("model");
    plant.track_energy();
    let (u, x) = (sweep(6000, period, 4.0, 30.0, 3.0), samples(6000, period, |t| 4e-3 * (1.0 - (20.0 * t).cos())));
    let moves = backdrive_plant::stepper::segments(backdrive_plant::model::Hold::Cubic, &x, period);
    plant.start_at(&[0.0, x[0]]);
    let first = plant.energy();
    let mut back_emf_took = 0.0;
    for i in 0..u.len() - 1 {
        let before = plant.velocity(0);
        plant.step(&[Segment::line(u[i], u[i + 1], period), moves[i]]);
        back_emf_took += 0.4 * 0.5 * (before.powi(2) + plant.velocity(0).powi(2)) * period;
    }
    let e = plant.energy();
    let elements: f64 = (0..model.elements.len()).map(|index| plant.dissipated_by(index)).sum();
    assert!(((elements + back_emf_took) / e.dissipated - 1.0).abs() < 1e-4, "{elements} and {back_emf_took} of {e:?}");
    assert!(plant.dissipated_by(model.elements.len()).is_nan());
    let gap = e.work_in - (e.kinetic + e.stored - first.stored) - e.dissipated;
    assert!(e.work_in > 0.05 && e.dissipated > 0.03, "{e:?}");
    assert!(gap.abs() / e.work_in < 3e-4, "{gap} of {e:?}");
}

#[test]
fn steady_sliding_forces_of_the_bristle_models() {
    let prescribed = |kind: &str, values: &[f64], speed: f64| {
        let model = model(&[0.0], vec![element(kind, [at(0), GROUND], values)], vec![motion_input(0)], vec![Force(vec![0])]);
        let y = run(&model, &[samples(3000, 1e-3, |t| speed * t)], 1e-3, None);
        y[0][2999]
    };
    assert!((prescribed("dahl", &[1e4, 0.4], 0.01) / 0.4 - 1.0).abs() < 1e-9);
    let lugre = 0.4 + 0.2 * (-1.0f64).exp();
    assert!((prescribed("lugre", &[1e5, 50.0, 0.4, 0.6, 0.01], 0.01) / lugre - 1.0).abs() < 1e-6);
    assert!((prescribed("bouc_wen", &[100.0, 0.0, 1.0, 60.0, 40.0, 1.0], -0.05) + 1.0).abs() < 1e-5);
    assert_eq!(prescribed("coulomb", &[0.4], -0.01), -0.4);
    assert_eq!(prescribed("asymmetric_coulomb", &[0.4, 0.0], -0.01), 0.0);
    assert!((prescribed("quadratic_drag", &[3.0], 0.2) - 0.12).abs() < 1e-9);
}

#[test]
fn maxwell_slip_keeps_masing_and_wipes_out() {
    let n = 60;
    let forces: Vec<f64> = (0..n).map(|i| 0.002 + (0.1 - 0.002) * i as f64 / (n - 1) as f64).collect();
    let virgin = |x: f64| forces.iter().map(|f| (50.0 * x).min(*f)).sum::<f64>();
    let kind = backdrive_plant::elements::kind_named("maxwell_slip").expect("kind");
    let mut sliders = element("spring", [at(0), GROUND], &[0.0, 0.0]);
    sliders.law = (kind.build)(&[vec![50.0; n], forces.clone()]).expect("law");
    let mut way_in = motion_input(0);
    way_in.hold = backdrive_plant::model::Hold::Linear;
    let model = model(&[1.0], vec![sliders], vec![way_in], vec![Force(vec![0])]);
    let corners = [0.0, 1e-3, 2e-4, 1e-3, 1.5e-3];
    let way: Vec<f64> =
        (0..2001)
            .map(|i: usize| {
                if i == 2000 { corners[4] } else { corners[i / 500] + (corners[i / 500 + 1] - corners[i / 500]) * (i % 500) as f64 / 500.0 }
            })
            .collect();
    let f = &run(&model, std::slice::from_ref(&way), 1e-3, None)[0];
    assert!((f[500] - virgin(1e-3)).abs() < 1e-12);
    assert!((f[500] - f[1000] - 2.0 * virgin(4e-4)).abs() < 1e-12);
    assert!((f[1800] - virgin(way[1800])).abs() < 1e-12);
}

#[test]
fn hysteretic_spring_is_the_limit_of_equations_2_and_3() {
    let (kp, kn, fp, fneg, gamma) = (390.0, 400.0, 0.05, -0.06, 5000.0);
    let model = model(
        &[1.0],
        vec![element("hysteretic_spring", [at(0), GROUND], &[kp, kn, fp, fneg, gamma])],
        vec![motion_input(0)],
        vec![Position(0), Force(vec![0])],
    );
    let way = |t: f64| 2e-3 * (TAU * t).sin() * (1.0 - (-t).exp());
    let y = run(&model, &[samples(4000, 1e-3, way)], 1e-3, Some(2));
    let (mut discrete, mut line, mut last, mut worst) = (0.0, 0.0, 0.0, 0.0f64);
    for i in 1..3999 * 400 {
        let x = way(f64::from(i) * 1e-3 / 400.0);
        if x > last {
            line = fp + kp * x + kp / gamma;
        } else if x < last {
            line = fneg + kn * x - kn / gamma;
        }
        let path = gamma * (x - last).abs();
        discrete = (path * line + discrete) / (1.0 + path);
        last = x;
        if i % 400 == 0 {
            worst = worst.max((discrete - y[1][i as usize / 400]).abs());
        }
    }
    assert!(worst / range(&y[1]) < 1e-3, "{worst}");
}

/// Admittance F/(s x) of a model from motion of body 0 to its reaction, at `hz`.
fn admittance(model: &backdrive_plant::model::Model, hz: f64, substeps: Option<usize>) -> (f64, f64) {
    let period = 1e-3;
    let count = (6.0 / hz / period) as usize + 9000;
    let x = samples(count, period, |t| 1e-3 * (TAU * hz * t).sin() * (0.5 - 0.5 * (TAU / 4.0 * t.min(2.0)).cos()));
    let y = run(model, std::slice::from_ref(&x), period, substeps);
    let window = (4.0 / hz / period).round() as usize;
    let phasor = |q: &[f64]| {
        (count - window..count).fold((0.0, 0.0), |s, i| {
            let angle = TAU * hz * i as f64 * period;
            (s.0 + q[i] * angle.cos(), s.1 - q[i] * angle.sin())
        })
    };
    let (f, d, w) = (phasor(&y[0]), phasor(&x), TAU * hz);
    // F / (j w x)
    let (re, im) = (-w * d.1, w * d.0);
    let square = re * re + im * im;
    ((f.0 * re + f.1 * im) / square, (f.1 * re - f.0 * im) / square)
}

/// Eq (2) of paper 001 at s = j w, times or divided out by hand.
fn equation_2(k: f64, b: f64, b1: f64, c: f64, w: f64) -> (f64, f64) {
    let numerator = (-k * b * b1 * w * w, k * c * (b + b1) * w);
    let denominator = (k * c - c * (b + b1) * w * w, b * k * w - b * b1 * w * w * w);
    let square = denominator.0 * denominator.0 + denominator.1 * denominator.1;
    (
        (numerator.0 * denominator.0 + numerator.1 * denominator.1) / square,
        (numerator.1 * denominator.0 - numerator.0 * denominator.1) / square,
    )
}

#[test]
fn compensator_has_the_admittance_of_equation_2() {
    let (k, b, b1) = (480e3, 98.4, 21.6);
    for c in [690.0, 2759.0, 1e7] {
        let elements = vec![
            spring([at(0), at(1)], k),
            element("inerter", [at(1), GROUND], &[b1]),
            damper([at(1), at(2)], c),
            element("inerter", [at(2), GROUND], &[b]),
        ];
        let linear = model(&[0.0, 0.0, 0.0], elements, vec![motion_input(0)], vec![Reaction(0)]);
        // Losses on the way of ring-down: a damper that small changes nothing.
        for hz in [3.2, 8.0, 20.0] {
            let (a, e) = (admittance(&linear, hz, None), equation_2(k, b, b1, c, TAU * hz));
            let error = ((a.0 - e.0).powi(2) + (a.1 - e.1).powi(2)).sqrt() / (e.0 * e.0 + e.1 * e.1).sqrt();
            assert!(error < if c > 1e6 { 5e-2 } else { 2e-3 }, "c {c}, {hz} Hz: {a:?} {e:?}");
        }
    }
}

#[test]
fn compensator_without_damper_rings_at_the_limit_of_equation_2() {
    let (k, b1) = (480e3, 21.6);
    // c = 0: the disc alone on the spring, f = sqrt(k/b1)/2π = 23.725 Hz; c = inf: with the flywheel, 10.066 Hz.
    for (inertance, hz) in [(b1, 23.725), (b1 + 98.4, 10.066)] {
        let model = model(
            &[0.0],
            vec![spring([at(0), GROUND], k), element("inerter", [at(0), GROUND], &[inertance])],
            vec![force_input(0)],
            vec![Position(0)],
        );
        let y = run(&model, &[knock(20_000, 1e-3, 1.0)], 1e-3, None);
        let crossings: Vec<f64> =
            (30..19_999).filter(|i| y[0][*i] < 0.0 && y[0][i + 1] >= 0.0).map(|i| i as f64 + y[0][i] / (y[0][i] - y[0][i + 1])).collect();
        let found = (crossings.len() - 1) as f64 / (crossings[crossings.len() - 1] - crossings[0]) / 1e-3;
        assert!((found / hz - 1.0).abs() < 1e-4, "{found}");
    }
}

#[test]
fn a_chain_of_fourteen_bodies_and_a_hand() {
    let n = 14;
    let mut elements: Vec<_> = (0..n).map(|i| spring([at(i), at(i + 1)], 2000.0 + 100.0 * i as f64)).collect();
    elements.extend((0..n).map(|i| damper([at(i), at(i + 1)], 0.3)));
    let mut linear = model(&[0.1; 15], elements, vec![force_input(0), motion_input(n)], vec![Position(0), Velocity(7), Reaction(n)]);
    let inputs = [sweep(2000, 1e-3, 1.0, 20.0, 1.0), sweep(2000, 1e-3, 1.0, 9.0, 1e-3)];
    let exact = run(&linear, &inputs, 1e-3, None);
    linear.elements.push(coulomb([at(3), at(9)], 0.0));
    let by_substeps = run(&linear, &inputs, 1e-3, Some(10));
    for (a, b) in by_substeps.iter().zip(&exact) {
        assert!(difference(a, b) < 2e-4, "{}", difference(a, b));
    }
}
