//! The model files in motion: stepped answers against linear analysis and against what the files promise.

use backdrive_plant::excitation::Excitation;
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::{Fragment, Hold, Model};
use backdrive_plant::stepper::{Options, simulate};
use nalgebra::Complex;
use rustfft::FftPlanner;
use std::path::{Path, PathBuf};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn device(name: &str) -> Model {
    Model::load(&file(&format!("models/{name}.toml"))).unwrap_or_else(|e| panic!("{e}"))
}

fn fragment(name: &str) -> Fragment {
    Fragment::load(&file(name)).unwrap_or_else(|e| panic!("{e}"))
}

fn spectrum(x: &[f64]) -> Vec<Complex<f64>> {
    let mut s: Vec<Complex<f64>> = x.iter().map(|x| Complex::new(*x, 0.0)).collect();
    FftPlanner::new().plan_fft_forward(x.len()).process(&mut s);
    s
}

#[test]
fn stepped_response_is_the_linear_one() {
    let mut m = device("impulse-engine-linear");
    let user = m.axes[0].user;
    m.attach(&fragment("grips/normal.toml"), user, "grip");
    m.inputs[0].hold = Hold::Linear;
    m.inputs[0].delay = 1e-3;
    m.inputs[0].bandwidth = 400.0;
    m.inputs[0].gain = 1.1;
    m.inputs[0].back_emf = 0.5;
    m.outputs[0].gain = 0.9;
    let rate = 10_000.0;
    let force = "multisine:rms=1,from=2,to=200,period=1,periods=3,seed=5".parse::<Excitation>().unwrap().samples(rate).unwrap();
    let hand = vec![0.0; force.len()];
    let y = simulate(&m, &[force.clone(), hand], 1.0 / rate, &Options::default()).unwrap().remove(0);
    let n = rate as usize;
    let (u, y) = (spectrum(&force[2 * n..]), spectrum(&y[2 * n..]));
    let lines = [2usize, 12, 40, 77, 120, 200];
    let linear = LinearModel::new(&m, &Operating::small()).unwrap();
    let expected = linear.response(0, 0, &lines.map(|k| k as f64)).unwrap();
    for (k, expected) in lines.iter().zip(expected) {
        // A line between samples is a sine that is a little lower: sinc² of its share of the rate.
        let x = std::f64::consts::PI * *k as f64 / rate;
        let found = y[*k] / u[*k] / (x.sin() / x).powi(2);
        assert!((found - expected).norm() < 2e-3 * expected.norm(), "{k} Hz: {found} {expected}");
    }
}

#[test]
fn a_hand_moves_the_handle_and_feels_it() {
    let mut m = device("impulse-engine-linear");
    let user = m.axes[0].user;
    let on = m.attach(&fragment("grips/normal.toml"), user, "grip");
    let force = m.add_port_force(&on);
    let n = 4000;
    // The hand goes 10 mm ahead and stays; the motor pushes back with 1 N.
    let hand: Vec<f64> = (0..n).map(|i| 0.01 * (f64::from(i) / 500.0).min(1.0)).collect();
    let push = vec![-1.0; n as usize];
    let y = simulate(&m, &[push, hand], 1e-3, &Options::default()).unwrap();
    let last: Vec<f64> = y.iter().map(|c| *c.last().unwrap()).collect();
    // The grip holds against 1 N: 1/400 m behind the hand at the handle, 1/3950 + 1/39500 m more at the motor.
    assert!((force.of(&last) - 1.0).abs() < 1e-3, "{last:?}");
    let expected = 0.01 - 1.0 / 400.0 - 1.0 / 3950.0 - 1.0 / 39500.0;
    assert!((last[0] - expected).abs() < 1e-5, "{} {expected}", last[0]);
}

#[test]
fn a_slave_follows_and_touches_the_wall_5_mm_ahead() {
    for (wall, softest, hardest) in
        [("free-space", 0.0, 0.0), ("soft-tissue", 1.4, 1.6), ("stiff-wall", 22.0, 24.0), ("hunt-crossley-wall", 30.0, 60.0)]
    {
        let mut m = device("slave");
        let user = m.axes[0].user;
        let on = m.attach(&fragment(&format!("environments/{wall}.toml")), user, "wall");
        let force = m.add_port_force(&on);
        // 10 mm ahead in half a second, and there for a second.
        let command: Vec<f64> = (0..1500).map(|i| 0.01 * (f64::from(i) / 500.0).min(1.0)).collect();
        let y = simulate(&m, &[command], 1e-3, &Options::default()).unwrap();
        let at = |i: usize| force.of(&y.iter().map(|c| c[i]).collect::<Vec<_>>());
        assert_eq!(at(240), 0.0, "{wall} touches too early");
        let pushed_back = -at(1499);
        assert!((softest..=hardest).contains(&pushed_back), "{wall}: {pushed_back} N");
        let tip = y[0][1499];
        assert!((tip - (0.01 - pushed_back / 71061.15)).abs() < 1e-6, "{wall}: {tip}");
    }
}

#[test]
fn the_two_axes_of_a_slave_do_not_feel_each_other() {
    let mut m = device("slave-two-axis");
    for axis in 0..2 {
        let (user, name) = (m.axes[axis].user, m.axes[axis].name.clone());
        m.attach(&fragment("environments/stiff-wall.toml"), user, &format!("wall.{name}"));
    }
    let forward: Vec<f64> = (0..800).map(|i| 0.01 * (f64::from(i) / 500.0).min(1.0)).collect();
    let side = vec![0.0; 800];
    let y = simulate(&m, &[forward, side], 1e-3, &Options::default()).unwrap();
    let index = |name: &str| m.outputs.iter().position(|o| o.name == name).unwrap();
    assert!(y[index("forward_tip_position")][799] > 0.009);
    assert!(y[index("side_tip_position")].iter().all(|x| *x == 0.0));
}
