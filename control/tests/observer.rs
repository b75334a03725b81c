//! The unknown-input observer against closed forms, its matrix inequality, and published or independently computed numbers.

use backdrive_control::engine::{Engine, Grid};
use backdrive_control::observer::{DesignError, Quantity, System, UnknownInput, Weights, design, kalman, lmi, norm_squared, riccati};
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::Model;
use nalgebra::{Complex, DMatrix};
use std::path::Path;

const BENCH: [f64; 4] = [0.9, 0.7, 2e4, 12.0];

fn bench() -> System {
    let [jc, ja, c, d] = BENCH;
    System::shaft(jc, ja, c, d, [0.1, 0.1])
}

fn model(name: &str) -> Model {
    Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/models").join(name)).unwrap()
}

fn close(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * b.abs()
}

#[test]
fn the_system_has_the_papers_transfer_functions_and_modes() {
    let [jc, ja, c, d] = BENCH;
    let system = bench();
    for hz in [0.1, 3.0, 35.9, 200.0] {
        let s = Complex::new(0.0, std::f64::consts::TAU * hz);
        let pencil = DMatrix::from_fn(3, 3, |i, j| (if i == j { s } else { Complex::new(0.0, 0.0) }) - Complex::new(system.a[(i, j)], 0.0));
        let x = pencil.lu().solve(&system.b.map(|v| Complex::new(v, 0.0))).unwrap();
        let below = s * (s * s * jc * ja + s * d * (jc + ja) + c * (jc + ja));
        for (row, above) in [(1, s * d + c), (2, s * s * jc + s * d + c)] {
            assert!((x[(row, 0)] - above / below).norm() < 1e-9 * (above / below).norm(), "{hz} Hz, state {row}");
        }
    }
    // Rigid mode at 0, torsional mode s^2 + d (1/J_C + 1/J_A) s + c (1/J_C + 1/J_A).
    let both = 1.0 / jc + 1.0 / ja;
    let poles = system.a.complex_eigenvalues();
    assert!(poles.iter().any(|p| p.norm() < 1e-9));
    let torsion = poles.iter().find(|p| p.im > 1.0).unwrap();
    assert!(close(torsion.norm(), (c * both).sqrt(), 1e-9) && close(-2.0 * torsion.re, d * both, 1e-9));
}

#[test]
fn a_model_file_gives_the_same_system_as_the_equations() {
    let model = model("engine-test-bench.toml");
    let found = System::of_model(&model, &Operating::small(), Quantity::Velocity, Some(Quantity::Velocity), &[0.1, 0.1]).unwrap();
    let [jc, ja, c, d] = BENCH;
    let expected = System::shaft(jc, ja, c, d, [0.1, 0.1]);
    for (what, found, expected) in [("A", found.a, expected.a), ("B", found.b, expected.b), ("E", found.e, expected.e)] {
        assert!((&found - &expected).amax() < 1e-9 * expected.amax(), "{what}: {found}");
    }
    // The machine's speed is measured first: the equations have the engine's first.
    assert_eq!(found.c, DMatrix::from_row_slice(2, 3, &[0.0, 0.0, 1.0, 0.0, 1.0, 0.0]));
}

#[test]
fn the_least_m_and_the_gains_are_those_of_independent_computations() {
    let (system, weights) = (bench(), Weights::default());
    // SciPy's bisection of the same equation; CLARABEL finds 0.118265 for the inequality.
    let found = design(&system, &weights, 1.05).unwrap();
    assert!(close(found.least_m, 0.118248, 1e-4), "{}", found.least_m);
    assert!(close(found.least_m, 0.118265, 2e-3));
    let poles = found.poles(&system);
    println!("m {} K {} L {} poles {poles:?} {:?}", found.m, found.k, found.l, found.check);
    assert!(close(poles.iter().map(|p| p.re).fold(0.0, f64::min), -62.0, 0.05), "{poles:?}");
    assert!(found.l.amax() > 100.0 && found.l.amax() < 200.0, "{}", found.l);
    // Infinite m: the Kalman-Bucy filter.
    let (_, l) = kalman(&system, &weights).unwrap();
    assert!(close(l[(0, 0)], 7.0722, 1e-4) && close(l[(0, 1)], 7.0700, 1e-4), "{l}");
    // Nearer to the least m the gain grows without bound, farther from it it is mild.
    let gain = |back_off: f64| design(&system, &weights, back_off).unwrap().l.amax();
    assert!(gain(1.001) > 20.0 * gain(1.05) && gain(2.0) < 0.2 * gain(1.05));
}

#[test]
fn the_gains_keep_the_inequality_and_its_norm() {
    let (system, weights) = (bench(), Weights::default());
    for back_off in [1.05, 2.0, 50.0] {
        let found = design(&system, &weights, back_off).unwrap();
        assert!(found.check.holds(), "{:?}", found.check);
        // The matrix by itself, at this m and at one that nothing can keep.
        let y = &found.p * &stacked(&found.k, &found.l);
        assert!(lmi::check(&system, &weights, &found.p, &y, found.m).holds());
        assert!(!lmi::check(&system, &weights, &found.p, &y, 0.9 * found.least_m).holds());
        let most =
            (0..400).map(|i| norm_squared(&system, &weights, (&found.k, &found.l), 1e-3 * 10f64.powf(i as f64 / 50.0))).fold(0.0, f64::max);
        assert!(most <= found.m * (1.0 + 1e-9) && most > 0.5 * found.least_m, "back-off {back_off}: {most} of {}", found.m);
    }
}

fn stacked(k: &DMatrix<f64>, l: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(k.nrows() + l.nrows(), k.ncols(), |i, j| if i < k.nrows() { k[(i, j)] } else { l[(i - k.nrows(), j)] })
}

#[test]
fn the_riccati_equation_is_solved_and_refused() {
    // x' = x + u, Q = 3, W = 1 (scalar): X^2 - 2 X - 3 = 0, the stabilising X = 3.
    let one = |v: f64| DMatrix::from_element(1, 1, v);
    let x = riccati::solve(&one(1.0), &one(3.0), &one(1.0)).unwrap();
    assert!((x[(0, 0)] - 3.0).abs() < 1e-12);
    // W = -1: X^2 + 2 X + 3 = 0 has no real solution.
    assert!(riccati::solve(&one(1.0), &one(3.0), &one(-1.0)).is_none());
}

#[test]
fn designs_that_cannot_be_are_refused() {
    let weights = Weights::default();
    assert_eq!(design(&bench(), &weights, 1.0), Err(DesignError::BackOff(1.0)));
    assert!(matches!(design(&System::shaft(0.9, 0.7, 2e4, 12.0, [0.0, 0.1]), &weights, 2.0), Err(DesignError::Number { .. })));
    // Without a shaft between them the dynamometer's speed contains no information on the engine.
    let mut cut = System::shaft(0.9, 0.7, 0.0, 0.0, [0.1, 0.1]);
    cut.c = cut.c.rows(1, 1).into_owned();
    cut.noise.pop();
    assert!(matches!(design(&cut, &weights, 2.0), Err(DesignError::System(_))));
    let slave = Model::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/models/slave.toml")).unwrap();
    assert!(System::of_model(&slave, &Operating::small(), Quantity::Position, None, &[1e-6]).is_err());
}

/// The shaft by the closed loop of a fine Runge-Kutta, as an observer's world: speeds at samples.
fn speeds(system: &System, torque: impl Fn(f64) -> f64, seconds: f64, period: f64) -> Vec<[f64; 2]> {
    let rate = |x: &DMatrix<f64>, t: f64| &system.a * x + &system.e * torque(t);
    let mut x = DMatrix::zeros(3, 1);
    let (mut rows, steps) = (Vec::new(), 20);
    let h = period / steps as f64;
    for k in 0..(seconds / period) as usize {
        rows.push([x[(1, 0)], x[(2, 0)]]);
        for i in 0..steps {
            let t = k as f64 * period + i as f64 * h;
            let a = rate(&x, t);
            let b = rate(&(&x + &a * (0.5 * h)), t + 0.5 * h);
            let c = rate(&(&x + &b * (0.5 * h)), t + 0.5 * h);
            let d = rate(&(&x + &c * h), t + h);
            x += (a + b * 2.0 + c * 2.0 + d) * (h / 6.0);
        }
    }
    rows
}

#[test]
fn a_constant_torque_is_found_and_a_ramp_is_followed_at_a_constant_distance() {
    let system = System::shaft(0.9, 0.7, 2e4, 12.0, [0.01, 0.01]);
    let found = design(&system, &Weights::default(), 1.2).unwrap();
    let slowest = found.poles(&system)[0].re;
    let period = 1e-3;
    let run = |torque: &dyn Fn(f64) -> f64, seconds: f64| -> Vec<f64> {
        let mut observer = UnknownInput::new(&system, &found.k, &found.l, period);
        speeds(&system, torque, seconds, period)
            .iter()
            .enumerate()
            .map(|(k, row)| {
                observer.step(&[0.0], Some(row));
                torque(k as f64 * period) - observer.force(0)
            })
            .collect()
    };
    let seconds = 25.0 / -slowest;
    let error = run(&|_| 40.0, seconds);
    assert!(error.last().unwrap().abs() < 1e-6 * 40.0, "{:?}", error.last());
    // The error of a ramp of 7 N m/s is that of the error's equation at rest: -(A_a - K C)^-1 G 7.
    let expected = found.error(&system).lu().solve(&DMatrix::from_column_slice(4, 1, &[0.0, 0.0, 0.0, -7.0])).unwrap()[(3, 0)];
    let error = run(&|t| 7.0 * t, seconds);
    let (last, before) = (error[error.len() - 1], error[error.len() - 1000]);
    assert!(close(last, expected, 2e-3) && close(last, before, 1e-3), "{last} {before} {expected}");
}

#[test]
fn the_observer_is_exact_at_any_period() {
    // Ten steps of 1 ms under a measurement that runs in a straight line are one of 10 ms.
    let system = bench();
    let found = design(&system, &Weights::default(), 1.5).unwrap();
    let at = |t: f64| [3.0 * t, 2.0 - t];
    let force = |period: f64, steps: usize| {
        let mut observer = UnknownInput::new(&system, &found.k, &found.l, period);
        (0..=steps).for_each(|k| observer.step(&[5.0], Some(&at(k as f64 * period))));
        [observer.force(0), observer.velocity(0)]
    };
    let (coarse, fine) = (force(0.01, 10), force(0.001, 100));
    assert!(coarse.iter().zip(&fine).all(|(a, b)| close(*a, *b, 1e-9)), "{coarse:?} {fine:?}");
}

#[test]
fn without_measurements_it_goes_on_by_its_model() {
    let system = bench();
    let found = design(&system, &Weights::default(), 1.5).unwrap();
    let mut observer = UnknownInput::new(&system, &found.k, &found.l, 1e-3);
    observer.step(&[0.0], None);
    observer.step(&[0.0], Some(&[10.0, 10.0]));
    // Both ends turn at 10 rad/s and 16 N m on the machine turn the whole faster: 16 / (0.9 + 0.7) rad/s2 on the mean.
    (0..1000).for_each(|_| observer.step(&[16.0], None));
    assert!((observer.velocity(0) - 20.0).abs() < 0.2, "{}", observer.velocity(0));
    assert!(observer.force(0).abs() < 1e-9 && observer.position(0).is_nan());
}

#[test]
fn masters_of_the_project_can_be_observed() {
    for (name, bodies) in [("rigid-mass.toml", 1), ("impulse-engine-linear.toml", 3), ("impulse-engine.toml", 3)] {
        let model = model(name);
        let at = Operating::amplitude(1e-3);
        assert_eq!(LinearModel::new(&model, &at).unwrap().inertia.nrows(), bodies);
        let system = System::of_model(&model, &at, Quantity::Position, None, &[2e-6]).unwrap();
        let weights = Weights { rate: 1e-4, ..Weights::default() };
        let found = design(&system, &weights, 2.0).unwrap();
        println!("{name}: least m {}, poles {:?}, {:?}", found.least_m, found.poles(&system), found.check);
        assert!(found.poles(&system).iter().all(|p| p.re < 0.0));
    }
}

#[test]
fn a_hammerstein_engine_is_first_order_at_a_point_and_its_lag_is_continuous() {
    let grid = |values: [f64; 4]| Grid::new(vec![0.0, 1.0], vec![100.0, 200.0], values.to_vec()).unwrap();
    let engine = || Engine::new(grid([-20.0, 500.0, -40.0, 400.0]), grid([2.1, 1.0, 0.8, 0.4]));
    let (pedal, speed, period) = (0.6, 130.0, 1e-3);
    let mut run = engine();
    let (stationary, lag) = (run.static_torque(pedal, speed), run.time_constant(pedal, speed));
    // Bilinear: at 0.6 of the pedal 292 and 224 N m, at 0.3 of the way between the speeds.
    assert!(close(stationary, 292.0 + 0.3 * (224.0 - 292.0), 1e-12));
    for k in 1..=5000 {
        let torque = run.step(pedal, speed, period);
        let expected = stationary * (1.0 - (-(k as f64) * period / lag).exp());
        assert!((torque - expected).abs() < 1e-6 * stationary, "step {k}");
    }
    // No jump of the lag at a point of its grid, nor beyond it.
    let engine = engine();
    for (p, s) in [(0.5, 100.0), (0.5, 200.0), (0.0, 150.0), (1.0, 150.0), (0.3, 120.0)] {
        for (dp, ds) in [(1e-9, 0.0), (0.0, 1e-6)] {
            let (a, b) = (engine.time_constant(p - dp, s - ds), engine.time_constant(p + dp, s + ds));
            assert!((a - b).abs() < 1e-6, "{a} {b} at {p} {s}");
        }
    }
    assert!(Grid::new(vec![0.0, 0.0], vec![1.0], vec![1.0, 2.0]).is_err());
    assert!(Grid::new(vec![0.0, 1.0], vec![1.0], vec![1.0]).is_err());
    assert!(Grid::new(vec![0.0], vec![1.0], vec![f64::NAN]).is_err());
}
