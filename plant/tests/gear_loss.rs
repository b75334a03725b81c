//! Loss in proportion to the force passed on, in both directions of power.

mod stepper_common;

use backdrive_plant::elements::kind_named;
use backdrive_plant::model::Model;
use backdrive_plant::model::OutputKind::{Position, Velocity};
use stepper_common::*;

/// A shaft whose bearing loses force, and a load behind a spring; dampers to ground on either.
fn gear(efficiency: f64, back: f64, damping: [f64; 2], driven: usize) -> Model {
    let elements = vec![
        spring([at(0), at(1)], 3000.0),
        damper([at(0), at(1)], 2.0),
        element("gear_loss", [at(0), GROUND], &[efficiency, back]),
        damper([at(0), GROUND], damping[0]),
        damper([at(1), GROUND], damping[1]),
    ];
    model(&[0.05, 0.2], elements, vec![force_input(driven)], vec![Position(0), Velocity(0)])
}

fn final_speed(model: &Model, force: f64) -> f64 {
    let count = 6000;
    let y = run(model, &[samples(count, 1e-3, |t| force * (t / 0.5).min(1.0))], 1e-3, None);
    y[1][count - 1]
}

#[test]
fn driving_the_joint_gets_its_share_of_the_force() {
    for force in [5.0, -5.0] {
        // All that the joint passes on drives the damper behind it.
        let v = final_speed(&gear(0.8, 0.7, [0.0, 10.0], 0), force);
        assert!((10.0 * v / force / 0.8 - 1.0).abs() < 1e-4, "{v}");
    }
}

#[test]
fn driven_by_the_joint_the_shaft_gets_the_other_share() {
    for force in [5.0, -5.0] {
        let v = final_speed(&gear(0.8, 0.7, [10.0, 0.0], 1), force);
        assert!((10.0 * v / force / 0.7 - 1.0).abs() < 1e-4, "{v}");
    }
}

#[test]
fn which_end_is_named_first_does_not_matter() {
    let straight = gear(0.8, 0.3, [1.0, 4.0], 0);
    let mut turned = straight.clone();
    turned.elements[0].between.reverse();
    turned.elements[2].between.reverse();
    let u = [sweep(3000, 1e-3, 1.0, 10.0, 3.0)];
    let (a, b) = (run(&straight, &u, 1e-3, None), run(&turned, &u, 1e-3, None));
    assert!(difference(&a[0], &b[0]) < 1e-9);
}

#[test]
fn below_a_back_efficiency_of_0_the_joint_moves_nothing() {
    for back in [-0.1, -0.5] {
        let locked = gear(0.4, back, [0.0, 0.0], 1);
        let y = run(&locked, &[samples(4000, 1e-3, |t| 2.0 * t * t)], 1e-3, None);
        // Until there is a load it is the joint's damper that pushes.
        assert!(range(&y[0]) < 1e-7 && range(&y[0][2000..]) == 0.0, "{back}: {}", range(&y[0]));
        // From its own side it moves as before.
        let v = final_speed(&gear(0.4, back, [0.0, 10.0], 0), 5.0);
        assert!((10.0 * v / 5.0 / 0.4 - 1.0).abs() < 1e-4, "{v}");
    }
}

#[test]
fn efficiencies_above_one_are_refused() {
    let kind = kind_named("gear_loss").unwrap();
    assert!((kind.build)(&[vec![1.1], vec![0.5]]).is_err() && (kind.build)(&[vec![0.9], vec![1.5]]).is_err());
}
