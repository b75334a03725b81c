//! Backlash, contacts and other elements that are stiff for some of the time.

mod stepper_common;

use backdrive_plant::model::OutputKind::{Force, Position, Velocity};
use backdrive_plant::stepper::{Options, Plant, Segment};
use stepper_common::*;

#[test]
fn backlash_flies_freely_and_pushes_only() {
    let model = model(
        &[0.2, 5.0],
        vec![element("backlash", [at(0), at(1)], &[2e-3, 1e5, 20.0]), spring([at(1), GROUND], 1e5)],
        vec![force_input(0)],
        vec![Position(0), Velocity(0), Force(vec![0]), Position(1)],
    );
    let mut u = vec![0.0; 20_000];
    u[1..41].fill(5.0);
    let y = run(&model, &[u], 2e-5, Some(4));
    let relative: Vec<f64> = y[0].iter().zip(&y[3]).map(|(a, b)| a - b).collect();
    let flying: Vec<usize> = (60..relative.len()).filter(|i| relative[*i].abs() < 0.999e-3).collect();
    assert!(flying.len() > 1000);
    for pair in flying.windows(2).filter(|pair| pair[1] == pair[0] + 1) {
        assert_eq!(y[2][pair[0]], 0.0);
        // One substep of force may still act at either end.
        let inside = relative[pair[0]].abs() < 0.99e-3 && relative[pair[1]].abs() < 0.99e-3;
        assert!(!inside || (y[1][pair[1]] - y[1][pair[0]]).abs() < 1e-12);
    }
    for (force, x) in y[2].iter().zip(&relative) {
        assert!(force * x >= 0.0);
    }
}

#[test]
fn backlash_becomes_a_dead_zone_as_its_damping_goes() {
    let shaken = |damping: f64| {
        let elements = vec![
            element("backlash", [at(0), at(1)], &[2e-3, 2000.0, damping]),
            spring([at(1), GROUND], 900.0),
            damper([at(1), GROUND], 4.0),
        ];
        let model = model(&[0.1, 0.3], elements, vec![force_input(0)], vec![Position(0), Force(vec![0])]);
        run(&model, &[sweep(5000, 1e-3, 1.0, 6.0, 4.0)], 1e-3, Some(10))
    };
    let dead_zone = shaken(0.0);
    let errors: Vec<f64> = [1.0, 0.1, 0.01].iter().map(|c| difference(&shaken(*c)[0], &dead_zone[0])).collect();
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 1e-2, "{errors:?}");
}

#[test]
fn backlash_without_a_gap_is_a_spring_and_a_damper() {
    let u = sweep(3000, 5e-4, 1.0, 20.0, 2.0);
    let rest = || vec![spring([at(1), GROUND], 700.0), damper([at(1), GROUND], 3.0), coulomb([at(1), GROUND], 0.05)];
    let mut joint = rest();
    joint.push(element("backlash", [at(0), at(1)], &[0.0, 4000.0, 2.0]));
    let mut plain = rest();
    plain.extend([spring([at(0), at(1)], 4000.0), damper([at(0), at(1)], 2.0)]);
    let device = |elements| model(&[0.1, 0.2], elements, vec![force_input(0)], vec![Position(0), Velocity(1)]);
    let (a, b) = (run(&device(joint), std::slice::from_ref(&u), 5e-4, Some(8)), run(&device(plain), &[u], 5e-4, Some(8)));
    for (a, b) in a.iter().zip(&b) {
        assert!(difference(a, b) < 1e-4, "{}", difference(a, b));
    }
}

#[test]
fn a_bounce_on_an_undamped_wall_keeps_its_energy() {
    let model = model(
        &[0.3],
        vec![element("contact", [at(0), GROUND], &[4000.0, 0.0, 5e-3])],
        vec![force_input(0)],
        vec![Position(0), Velocity(0)],
    );
    // Thrown at the wall at 0.2 m/s: it stays there half a cycle, π sqrt(m/k), and comes back as fast.
    let y = run(&model, &[knock(2000, 1e-4, 0.06)], 1e-4, None);
    assert!((y[1][100] - 0.2).abs() < 1e-9);
    assert!((y[1][1999] + 0.2).abs() < 2e-4, "{}", y[1][1999]);
    let deepest = y[0].iter().copied().fold(0.0, f64::max);
    assert!((deepest - 5e-3 - 0.2 * (0.3f64 / 4000.0).sqrt()).abs() < 2e-6, "{deepest}");
}

#[test]
fn contacts_far_too_stiff_for_the_substep_stay_finite_and_take_energy() {
    for (kind, values) in [
        ("contact", vec![1e8, 50.0, 1e-3]),
        ("contact", vec![1e8, 0.0, 1e-3]),
        ("hunt_crossley", vec![1e10, 1e9, 1.5, 1e-3]),
        ("backlash", vec![2e-3, 1e8, 10.0]),
        ("backlash", vec![2e-3, 1e8, 0.0]),
        ("backlash", vec![2e-3, 1e8, 0.0, 4e-4]),
        ("cubic_spring", vec![0.0, 1e13]),
        ("lugre", vec![1e7, 1e3, 0.5, 0.8, 1e-3]),
        ("dahl", vec![1e8, 0.5]),
        ("bouc_wen", vec![1e8, 0.1, 1.0, 1e6, 1e5, 1.0]),
        ("hysteretic_spring", vec![1e6, 1e6, 5.0, -5.0, 1e5]),
        ("quadratic_drag", vec![1e6]),
        ("asymmetric_damper", vec![1e6, 1e3]),
    ] {
        // A body of a gram, thrown to and fro, five periods of 200 µs in a push.
        let model = model(
            &[1e-3],
            vec![element(kind, [at(0), GROUND], &values), damper([at(0), GROUND], 0.02)],
            vec![force_input(0)],
            vec![Position(0), Velocity(0)],
        );
        let u = samples(20_000, 2e-4, |t| 0.1 * (30.0 * t).sin());
        let y = run(&model, &[u], 2e-4, Some(1));
        assert!(y[0].iter().all(|x| x.is_finite() && x.abs() < 0.5), "{kind} {values:?}: {}", largest(y[0].iter().copied()));
        assert!(largest(y[1].iter().copied()) < 10.0, "{kind} {values:?}: {}", largest(y[1].iter().copied()));
    }
}

#[test]
fn a_contact_beside_an_inerter() {
    let elements = vec![
        element("contact", [at(0), GROUND], &[3000.0, 2.0, 1e-3]),
        element("inerter", [at(0), at(1)], &[0.3]),
        spring([at(0), at(1)], 400.0),
        damper([at(1), GROUND], 2.0),
        spring([at(1), GROUND], 300.0),
    ];
    let model = model(&[0.05, 0.1], elements, vec![force_input(0)], vec![Position(0), Position(1), Force(vec![1])]);
    let u = sweep(4000, 5e-4, 1.0, 8.0, 3.0);
    let (coarse, fine) = (run(&model, std::slice::from_ref(&u), 5e-4, None), run(&model, &[u], 5e-4, Some(64)));
    for output in 0..2 {
        assert!(difference(&coarse[output], &fine[output]) < 2e-3, "{}", difference(&coarse[output], &fine[output]));
    }
}

#[test]
fn corner_cases_neither_panic_nor_give_what_is_no_number() {
    let nothing = [
        element("contact", [at(0), GROUND], &[0.0, 0.0, 0.0]),
        element("backlash", [at(0), GROUND], &[0.0, 0.0, 0.0]),
        element("coulomb", [at(0), at(0)], &[0.4]),
        element("spring", [at(0), at(0)], &[400.0, 0.1]),
        element("dahl", [GROUND, GROUND], &[400.0, 0.1]),
        element("hunt_crossley", [at(0), at(0)], &[1e5, 0.0, 1.5, -1.0]),
        element("inerter", [at(0), at(0)], &[2.0]),
        element("spring", [at(1), at(2)], &[500.0, 0.0]),
        element("coulomb", [at(1), at(2)], &[0.1]),
        element("lugre", [at(1), at(2)], &[1e4, 10.0, 0.1, 0.2, 0.01]),
        element("backlash", [at(1), at(2)], &[1e-3, 1e4, 1.0]),
        element("stribeck", [at(0), at(1)], &[0.0, 0.0, 1e-3]),
    ];
    let kinds = nothing.len();
    let mut second = motion_input(2);
    second.hold = backdrive_plant::model::Hold::Zero;
    let outputs = (0..kinds).map(|e| Force(vec![e])).collect();
    let model = model(&[0.1, 0.0, 0.0], nothing.to_vec(), vec![force_input(0), motion_input(1), second], outputs);
    let mut plant = Plant::new(&model, 1e-3, &Options::default()).expect("model");
    let mut values = vec![0.0; kinds + 3];
    plant.start_at(&[0.0, 0.01, -0.02, 7.0]);
    plant.outputs(&mut values);
    for i in 0..500 {
        let t = 1e-3 * f64::from(i);
        plant.step(&[Segment::held(t.sin()), Segment::line(t, t + 1e-3, 1e-3), Segment::held((7.0 * t).cos())]);
        plant.outputs(&mut values);
        assert!(plant.is_finite() && values.iter().all(|v| v.is_finite()), "{i}: {values:?}");
    }
    // Too few inputs, bodies that are not there, inputs that are no numbers.
    plant.step(&[]);
    assert!(plant.position(9).is_nan() && plant.element_force(99).is_nan() && plant.reaction(9).is_nan());
    plant.step(&[Segment::held(f64::NAN)]);
    assert!(!plant.is_finite());
    plant.reset();
    assert!(plant.is_finite() && plant.time() == 0.0 && plant.energy().work_in.is_nan());
}
