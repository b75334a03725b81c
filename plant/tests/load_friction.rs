//! Friction that grows with the force of a joint, against closed forms.

mod stepper_common;

use backdrive_plant::model::OutputKind::{Position, Velocity};
use backdrive_plant::stepper::{Options, Plant, Segment};
use stepper_common::*;

const C: f64 = 0.4;
const MU: f64 = 0.6;

#[test]
fn a_block_on_a_rope_lets_go_where_its_own_pull_presses_no_more_than_it_pulls() {
    let (k, rate, period) = (1000.0, 1e-3, 1e-3);
    let elements = vec![spring([at(0), at(1)], k), element("load_friction", [at(1), GROUND], &[C, MU])];
    let model = model(&[0.0, 0.2], elements, vec![motion_input(0)], vec![Position(1)]);
    let y = run(&model, &[samples(1500, period, |t| rate * t)], period, None);
    // k x = c + μ k x.
    let lets_go = C / (1.0 - MU) / k / rate / period;
    let first = y[0].iter().position(|x| *x != 0.0).unwrap() as f64;
    assert!((first - lets_go).abs() < 3.0, "{first} {lets_go}");
}

#[test]
fn pressed_by_more_than_it_is_pulled_it_never_moves() {
    let elements = vec![spring([at(0), at(1)], 1000.0), element("load_friction", [GROUND, at(1)], &[0.0, 1.05])];
    let model = model(&[0.0, 0.2], elements, vec![motion_input(0)], vec![Position(1)]);
    for side in [1.0, -1.0] {
        let y = run(&model, &[samples(2000, 1e-3, |t| side * (0.1 * t + 1e-3 * (40.0 * t).sin()))], 1e-3, None);
        assert_eq!(range(&y[0]), 0.0);
    }
}

#[test]
fn under_a_constant_load_it_slows_down_and_comes_back_on_parabolas() {
    let (m, load, v0, period) = (0.5, 3.0, 0.8, 1e-3);
    // A spring so soft that its pull stays the same.
    let soft = 1e-6;
    let elements = vec![element("spring", [at(0), at(1)], &[soft, -load / soft]), element("load_friction", [at(0), GROUND], &[C, MU])];
    let model = model(&[m, 0.0], elements, vec![motion_input(1)], vec![Position(0), Velocity(0)]);
    let mut plant = Plant::new(&model, period, &Options::default()).unwrap();
    plant.track_energy();
    plant.set_motion(0, 0.0, v0);
    let level = C + MU * load;
    let (slows, returns) = ((load + level) / m, (load - level) / m);
    let stops = v0 / slows;
    let first = plant.energy();
    for i in 1..=1000 {
        plant.step(&[Segment::held(0.0)]);
        let t = f64::from(i) * period;
        let (x, v) = if t < stops {
            (v0 * t - 0.5 * slows * t * t, v0 - slows * t)
        } else {
            (0.5 * v0 * stops - 0.5 * returns * (t - stops).powi(2), -returns * (t - stops))
        };
        assert!((plant.position(0) - x).abs() < 1e-6 && (plant.velocity(0) - v).abs() < 1e-5, "{t}: {} {x}", plant.position(0));
    }
    let now = plant.energy();
    let gone = level * (0.5 * v0 * stops + 0.5 * returns * (1.0 - stops).powi(2));
    assert!((now.dissipated / gone - 1.0).abs() < 1e-4, "{} {gone}", now.dissipated);
    assert!((now.kinetic + now.stored + now.dissipated - first.kinetic - first.stored - now.work_in).abs() < 1e-9 * gone.max(1.0) * 1e3);
}

#[test]
fn halving_the_substeps_changes_little_where_the_load_swings() {
    let elements = vec![
        spring([at(0), at(1)], 2000.0),
        damper([at(0), at(1)], 1.0),
        spring([at(1), GROUND], 300.0),
        element("load_friction", [at(0), GROUND], &[0.1, 0.15]),
    ];
    let model = model(&[0.05, 0.2], elements, vec![force_input(0)], vec![Position(0), Position(1)]);
    let u = sweep(4000, 1e-3, 1.0, 15.0, 2.0);
    let runs = [4, 8, 64].map(|n| run(&model, std::slice::from_ref(&u), 1e-3, Some(n)));
    let off = [0, 1].map(|i| difference(&runs[i][1], &runs[2][1]));
    assert!(off[0] < 2e-4 && off[1] < 0.6 * off[0], "{off:?}");
}
