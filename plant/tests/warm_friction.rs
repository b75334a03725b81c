//! Friction that its own heat lowers, against closed forms.

mod stepper_common;

use backdrive_plant::model::OutputKind::Reaction;
use backdrive_plant::stepper::{Options, Plant, Segment};
use stepper_common::*;

const COLD: f64 = 2.0;
const HEAT: f64 = 0.4;
const TAU: f64 = 1.5;

/// Time at which the warming is w at constant speed, from cold: `dw/dt = a/(1 + w) - w/τ`, by partial fractions.
fn time_at(w: f64, v: f64) -> f64 {
    let a = COLD * v / HEAT;
    // w² + w = a τ.
    let root = (0.25 + a * TAU).sqrt();
    let (up, down) = (-0.5 + root, -0.5 - root);
    let part = |end: f64, other: f64| (1.0 + end) / (end - other) * ((w - end) / (0.0 - end)).abs().ln();
    -TAU * (part(up, down) + part(down, up))
}

#[test]
fn at_constant_speed_it_falls_as_heat_builds_up_and_settles_where_it_is_lost() {
    let (v, period) = (0.2, 1e-2);
    let model =
        model(&[0.0], vec![element("warm_friction", [at(0), GROUND], &[COLD, HEAT, TAU])], vec![motion_input(0)], vec![Reaction(0)]);
    let y = run(&model, &[samples(2000, period, |t| v * t)], period, None);
    for i in [20, 50, 100, 200, 400] {
        let warming = COLD / y[0][i] - 1.0;
        let exact = time_at(warming, v);
        assert!((exact / (i as f64 * period) - 1.0).abs() < 2e-3, "{i}: {warming} {exact}");
    }
    let last = y[0][1999];
    assert!((last * (1.0 + last * v * TAU / HEAT) / COLD - 1.0).abs() < 1e-7, "{last}");
    // In the end c - c_inf falls as an exponential, of the rate that the equation has about the settled warming.
    let settled = COLD / last;
    let rate = COLD * v / HEAT / (settled * settled) + 1.0 / TAU;
    let rest = [500, 600].map(|i| y[0][i] - last);
    assert!(((rest[0] / rest[1]).ln() / rate - 1.0).abs() < 1e-2, "{rest:?} {rate}");
}

#[test]
fn at_rest_it_cools_down_again() {
    let model =
        model(&[0.0], vec![element("warm_friction", [at(0), GROUND], &[COLD, HEAT, TAU])], vec![motion_input(0)], vec![Reaction(0)]);
    let (v, period, pause) = (0.2, 1e-2, 0.75);
    let y =
        run(&model, &[samples(1200, period, |t| if t < 10.0 { v * t } else { v * (10.0 + (t - 10.0 - pause).max(0.0)) })], period, None);
    let warming = |i: usize| COLD / y[0][i] - 1.0;
    let (before, after) = (warming(998), warming(1078));
    // A few samples of rubbing at either end, within the spline through a corner.
    assert!((after / before / (-pause / TAU).exp() - 1.0).abs() < 0.1, "{before} {after}");
}

#[test]
fn what_it_takes_is_the_energy_that_goes_in() {
    let elements = vec![spring([at(0), GROUND], 50.0), element("warm_friction", [at(0), GROUND], &[0.5, 0.1, 2.0])];
    let model = model(&[0.3], elements, vec![force_input(0)], vec![]);
    let mut plant = Plant::new(&model, 1e-3, &Options::default()).unwrap();
    plant.track_energy();
    let mut slowest = f64::INFINITY;
    for i in 0..5000 {
        plant.step(&[Segment::held(2.0 * (8e-3 * f64::from(i)).sin())]);
        slowest = slowest.min(plant.element_force(1).abs());
    }
    let energy = plant.energy();
    let balance = energy.work_in - energy.kinetic - energy.stored - energy.dissipated;
    assert!(energy.dissipated > 0.1 && balance.abs() < 1e-4 * energy.work_in, "{energy:?}");
    assert!((plant.dissipated_by(1) - energy.dissipated).abs() < 1e-12);
}

#[test]
fn reset_makes_it_cold() {
    let model =
        model(&[0.0], vec![element("warm_friction", [at(0), GROUND], &[COLD, HEAT, TAU])], vec![motion_input(0)], vec![Reaction(0)]);
    let mut plant = Plant::new(&model, 1e-2, &Options::default()).unwrap();
    let force = |plant: &mut Plant| {
        for i in 0..100 {
            plant.step(&[Segment::line(2e-3 * f64::from(i), 2e-3 * f64::from(i + 1), 1e-2)]);
        }
        plant.element_force(0)
    };
    let first = force(&mut plant);
    plant.reset();
    assert!(first < 0.8 * COLD);
    assert_eq!(force(&mut plant), first);
}
