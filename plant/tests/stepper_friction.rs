//! Dry friction: exact stick, break-away, several contacts at once.

mod stepper_common;

use backdrive_plant::model::OutputKind::{Force, Position, Reaction, Velocity};
use stepper_common::*;

#[test]
fn break_away_happens_at_the_static_force_and_rest_is_exact() {
    let elements =
        vec![spring([at(0), at(1)], 1000.0), element("stribeck", [at(1), GROUND], &[1.0, 2.0, 0.01]), damper([at(0), at(1)], 5.0)];
    let model = model(&[1.0, 1.0], elements, vec![motion_input(0)], vec![Position(0), Position(1), Velocity(1), Force(vec![1])]);
    let y = run(&model, &[samples(20_000, 1e-3, |t| 2e-4 * t)], 1e-3, None);
    let first = y[1].iter().position(|x| x.abs() > 1e-12).expect("it moves");
    let load = 1000.0 * (y[0][first] - y[1][first]) + 5.0 * 2e-4;
    assert!((load / 2.0 - 1.0).abs() < 1e-3, "{load}");
    assert_eq!(largest(y[2][..first].iter().copied()), 0.0);
    // While it sticks the friction force is the load.
    let stuck = first - 100;
    assert!((y[3][stuck] - (1000.0 * y[0][stuck] + 1e-3)).abs() < 1e-6);
}

#[test]
fn a_dragged_body_sticks_and_slips_at_the_static_force_each_time() {
    let elements =
        vec![spring([at(0), at(1)], 1000.0), element("stribeck", [at(1), GROUND], &[1.0, 2.0, 0.01]), damper([at(0), at(1)], 1.0)];
    let model = model(&[1.0, 1.0], elements, vec![motion_input(0)], vec![Position(0), Position(1), Velocity(1)]);
    let y = run(&model, &[samples(20_000, 1e-3, |t| 2e-3 * t)], 1e-3, None);
    let mut slips = 0;
    for i in 1..19_999 {
        if y[2][i] == 0.0 && y[2][i + 1] != 0.0 {
            slips += 1;
            let load = 1000.0 * (y[0][i] - y[1][i]) + 2e-3;
            assert!((load - 2.0).abs() < 2.1e-3, "{load}");
        } else if y[2][i] == 0.0 && y[2][i - 1] == 0.0 {
            assert_eq!(y[1][i], y[1][i - 1]);
        }
    }
    assert!(slips > 10, "{slips}");
}

#[test]
fn two_contacts_let_go_at_the_sum_of_their_forces() {
    let elements =
        vec![spring([at(0), at(1)], 2e4), damper([at(0), at(1)], 3.0), coulomb([at(0), GROUND], 0.1), coulomb([at(1), GROUND], 0.2)];
    let model = model(&[0.02, 0.02], elements, vec![force_input(0)], vec![Position(0), Position(1)]);
    let y = run(&model, &[samples(10_000, 1e-3, |t| 0.05 * t)], 1e-3, None);
    let first = y[1].iter().position(|x| x.abs() > 1e-9).expect("it moves") as f64;
    assert!((0.05e-3 * first / 0.3 - 1.0).abs() < 5e-3, "{first}");
}

#[test]
fn eight_contacts_in_the_same_place_are_one() {
    let (u, period) = (sweep(8000, 5e-4, 1.0, 12.0, 2.0), 5e-4);
    let device = |frictions: Vec<f64>| {
        let mut elements = vec![spring([at(0), at(1)], 3000.0), damper([at(0), at(1)], 1.0), spring([at(1), GROUND], 200.0)];
        elements.extend(frictions.iter().map(|c| coulomb([at(1), GROUND], *c)));
        model(&[0.1, 0.2], elements, vec![force_input(0)], vec![Position(0), Position(1), Velocity(1)])
    };
    let one = run(&device(vec![0.36]), std::slice::from_ref(&u), period, Some(2));
    let eight = run(&device((1..=8).map(|i| 0.01 * f64::from(i)).collect()), &[u], period, Some(2));
    for (a, b) in one.iter().zip(&eight) {
        assert!(difference(b, a) < 1e-9, "{}", difference(b, a));
    }
    let rests = [&one, &eight].map(|y| y[2].iter().filter(|v| **v == 0.0).count());
    assert!(rests[0] > 50 && rests[1] == rests[0], "{rests:?}");
}

#[test]
fn a_ladder_of_contacts_between_all_bodies_converges() {
    // Every pair of five bodies rubs, and each rubs on ground: fifteen contacts, closely coupled.
    let inertias = [0.02, 1.0, 0.05, 3.0, 0.01];
    let mut elements = Vec::new();
    for i in 0..5 {
        elements.push(coulomb([at(i), GROUND], 0.02 + 0.01 * i as f64));
        elements.push(spring([at(i), GROUND], 100.0));
        for j in i + 1..5 {
            elements.push(coulomb([at(i), at(j)], 0.05 + 0.01 * (i + j) as f64));
        }
    }
    let outputs = (0..5).map(Position).chain((0..5).map(Velocity)).collect();
    let model = model(&inertias, elements, vec![force_input(0), force_input(3)], outputs);
    let (count, period) = (3000, 1e-3);
    let inputs = [sweep(count, period, 0.5, 4.0, 3.0), sweep(count, period, 1.0, 2.0, 4.0)];
    let (coarse, fine) = (run(&model, &inputs, period, Some(2)), run(&model, &inputs, period, Some(16)));
    for body in 0..5 {
        assert!(difference(&coarse[body], &fine[body]) < 2e-3, "body {body}: {}", difference(&coarse[body], &fine[body]));
    }
}

#[test]
fn asymmetric_friction_with_a_free_direction() {
    let model = model(
        &[0.5],
        vec![element("asymmetric_coulomb", [at(0), GROUND], &[0.0, 0.7])],
        vec![force_input(0)],
        vec![Velocity(0), Force(vec![0])],
    );
    // Forwards nothing rubs; backwards 0.5 N is held.
    let y = run(&model, &[samples(1000, 1e-3, |t| if t < 0.5 { 1.0 } else { -0.5 })], 1e-3, Some(1));
    assert!((y[0][500] - 1.0).abs() < 2e-3);
    let y = run(&model, &[vec![-0.5; 1000]], 1e-3, Some(1));
    assert_eq!(largest(y[0].iter().copied()), 0.0);
    assert!((y[1][999] + 0.5).abs() < 1e-12);
}

#[test]
fn friction_without_force_is_nothing() {
    for kind in [("coulomb", vec![0.0]), ("asymmetric_coulomb", vec![0.0, 0.0]), ("stribeck", vec![0.0, 0.0, 0.1])] {
        let with = model(
            &[0.5],
            vec![spring([at(0), GROUND], 50.0), element(kind.0, [at(0), GROUND], &kind.1)],
            vec![force_input(0)],
            vec![Position(0)],
        );
        let without = model(&[0.5], vec![spring([at(0), GROUND], 50.0)], vec![force_input(0)], vec![Position(0)]);
        let u = sweep(2000, 1e-3, 1.0, 5.0, 1.0);
        let (a, b) = (run(&with, std::slice::from_ref(&u), 1e-3, Some(4)), run(&without, &[u], 1e-3, Some(4)));
        assert!(difference(&a[0], &b[0]) < 1e-5, "{}: {}", kind.0, difference(&a[0], &b[0]));
    }
}

#[test]
fn a_prescribed_body_drags_a_free_one_by_friction() {
    let model = model(
        &[0.0, 0.2],
        vec![coulomb([at(0), at(1)], 0.5)],
        vec![motion_input(0)],
        vec![Position(0), Position(1), Velocity(0), Velocity(1), Reaction(0)],
    );
    // Slow: acceleration at most 0.02 * 4² = 0.32 < 2.5 m/s²: it follows. Quick: 0.02 * 20² = 8: it slips.
    let slow = run(&model, &[samples(4000, 1e-3, |t| 0.02 * (1.0 - (4.0 * t).cos()))], 1e-3, None);
    assert!(largest(slow[0].iter().zip(&slow[1]).map(|(a, b)| a - b)) < 1e-7);
    assert_eq!(largest(slow[2].iter().zip(&slow[3]).map(|(a, b)| a - b)), 0.0);
    assert!(largest((10..3999).map(|i| slow[4][i] - 0.2 * 0.32 * (4e-3 * i as f64).cos())) < 1e-4);
    let quick = run(&model, &[samples(4000, 1e-3, |t| 0.02 * (1.0 - (20.0 * t).cos()))], 1e-3, None);
    assert!((largest(quick[4].iter().copied()) - 0.5).abs() < 1e-9);
    assert!(largest(quick[0].iter().zip(&quick[1]).map(|(a, b)| a - b)) > 1e-3);
}

#[test]
fn a_massless_prescribed_body_reads_its_friction() {
    let model = model(
        &[0.0],
        vec![coulomb([at(0), GROUND], 0.3), element("stribeck", [at(0), GROUND], &[0.1, 0.2, 0.01])],
        vec![motion_input(0)],
        vec![Reaction(0), Velocity(0)],
    );
    let y = run(&model, &[samples(1000, 1e-3, |t| 0.01 * (6.0 * t).sin())], 1e-3, None);
    for i in 5..999 {
        let v = y[1][i];
        let expected = (0.3 + 0.1 + 0.1 * (-(v / 0.01) * (v / 0.01)).exp()) * v.signum();
        assert!((y[0][i] - expected).abs() < 1e-9, "{i}: {} {expected}", y[0][i]);
    }
}

#[test]
fn stribeck_and_deficit_converge_with_second_order() {
    for (kind, values) in [("stribeck", [0.2, 0.35, 0.02]), ("friction_deficit", [0.4, 0.2, 0.02])] {
        let elements = vec![
            spring([at(0), at(1)], 3000.0),
            damper([at(0), at(1)], 1.5),
            coulomb([at(0), GROUND], 0.3),
            element(kind, [at(1), GROUND], &values),
            spring([at(1), GROUND], 500.0),
        ];
        let model = model(&[0.1, 0.2], elements, vec![force_input(0)], vec![Position(0)]);
        let u = sweep(3000, 2e-4, 4.0, 30.0, 3.0);
        let y: Vec<Vec<f64>> =
            [1, 2, 4, 8, 64].into_iter().map(|n| run(&model, std::slice::from_ref(&u), 2e-4, Some(n)).remove(0)).collect();
        let errors: Vec<f64> = y[..4].iter().map(|q| difference(q, &y[4])).collect();
        println!("{kind}: errors {errors:?}");
        assert!(errors[0] < 2e-4, "{kind}: {errors:?}");
        assert!((errors[3] / errors[0]).powf(1.0 / 3.0) < 1.0 / 2.8, "{kind}: {errors:?}");
    }
}
