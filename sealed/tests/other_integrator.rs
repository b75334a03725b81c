//! The forms that no model file has, and the two single-bristle laws, against equations written down a second time and stepped by a
//! classical Runge-Kutta method with small steps.

mod common;

use backdrive_sealed::effects::Site;
use backdrive_sealed::laws::*;
use backdrive_sealed::plant::SealedPlant;
use common::*;

const PERIOD: f64 = 1e-3;

/// Rows of (x, v) of a 0.5 kg mass at the end of every period under a force `f` held through it; `slopes(y, f)` gives dy/dt of
/// the state y = (x, v, ..).
fn runge_kutta<const N: usize>(steps: usize, force: impl Fn(f64) -> f64, slopes: impl Fn(&[f64; N], f64) -> [f64; N]) -> Vec<[f64; 2]> {
    const PARTS: usize = 200;
    let h = PERIOD / PARTS as f64;
    let ahead = |y: &[f64; N], k: &[f64; N], h: f64| std::array::from_fn::<f64, N, _>(|i| y[i] + h * k[i]);
    let mut y = [0.0; N];
    let mut rows = Vec::new();
    for step in 0..steps {
        let f = force(step as f64 * PERIOD);
        for _ in 0..PARTS {
            let k1 = slopes(&y, f);
            let k2 = slopes(&ahead(&y, &k1, 0.5 * h), f);
            let k3 = slopes(&ahead(&y, &k2, 0.5 * h), f);
            let k4 = slopes(&ahead(&y, &k3, h), f);
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        rows.push([y[0], y[1]]);
    }
    rows
}

/// Asserts that position and speed of the mass with this law to ground stay within shares of their ranges of the rows.
#[track_caller]
fn agrees(law: Law, force: impl Fn(f64) -> f64, rows: &[[f64; 2]], share: f64) {
    let network = device(MASS);
    let mut plant = SealedPlant::new(&network, &hiding(&network, vec![grounded("mass", law)]), PERIOD).unwrap();
    let found = run(&mut plant, rows.len(), PERIOD, |t| vec![force(t)]);
    for output in 0..2 {
        let range = rows.iter().fold(0.0_f64, |most, row| most.max(row[output].abs()));
        let off = rows.iter().zip(&found).fold(0.0_f64, |most, (a, b)| most.max((a[output] - b[output]).abs()));
        assert!(off < share * range, "output {output}: off by {off} of {range}");
    }
}

/// To and fro, slower and faster, at up to `most` N.
fn swept(most: f64) -> impl Fn(f64) -> f64 + Copy {
    move |t| most * (12.0 * t + 15.0 * t * t).sin() * (1.0 + 0.5 * (3.0 * t).cos())
}

#[test]
fn a_rounded_gap() {
    let (k, c, gap, w) = (5000.0, 4.0, 2e-3, 1.5e-4);
    let force = swept(2.0);
    let rows = runge_kutta(1500, force, |[x, v]: &[f64; 2], f| {
        let edge = |u: f64| if u > 40.0 { u } else { u.exp().ln_1p() };
        let bump = |u: f64| 0.5 * (1.0 + (0.5 * u).tanh());
        let (right, left) = ((x - 0.5 * gap) / w, (-x - 0.5 * gap) / w);
        let law = k * w * (edge(right) - edge(left)) + c * (bump(right) + bump(left)) * v;
        [*v, (f - law) / 0.5]
    });
    agrees(Law::RoundedGap(RoundedGap { gap, rounding: w, stiffness: k, damping: c }), force, &rows, 2e-3);
}

#[test]
fn a_bristle_field() {
    let field = BristleField {
        stiffness: 3000.0,
        force: 2.0,
        stiffness_spread: 0.5,
        force_spread: 0.6,
        count: 40,
        static_ratio: 1.0,
        velocity: 1.0,
    };
    let bristles = field.bristles();
    // Every bristle's spring by itself: it bends with the mass unless it slides and the mass goes on.
    let force = swept(3.0);
    let rows = runge_kutta(1500, force, |y: &[f64; 42], f| {
        let v = y[1];
        let mut slopes = [0.0; 42];
        let mut law = 0.0;
        for (i, (k, limit)) in bristles.stiffness.iter().zip(&bristles.force).enumerate() {
            let z = y[2 + i];
            law += (k * z).clamp(-limit, *limit);
            slopes[2 + i] = if (k * z).abs() >= *limit && z * v > 0.0 { 0.0 } else { v };
        }
        (slopes[0], slopes[1]) = (v, (f - law) / 0.5);
        slopes
    });
    agrees(Law::BristleField(field), force, &rows, 3e-3);
}

#[test]
fn friction_that_warms() {
    // Pushed on by more than the friction, so that the speed stays above 0 and the equations smooth.
    let (c0, half, capacity, tau) = (2.0, 20.0, 0.01, 1.5);
    let force = |t: f64| 2.6 + 0.5 * (9.0 * t).sin();
    let rows = runge_kutta(1500, force, |[_, v, warm]: &[f64; 3], f| {
        let c = c0 / (1.0 + warm / half);
        [*v, (f - c) / 0.5, c * v / capacity - warm / tau]
    });
    let speeds = rows.iter().map(|row| row[1]);
    assert!(speeds.fold(f64::INFINITY, f64::min) > 0.0);
    agrees(
        Law::WarmFriction(WarmFriction { force: c0, half_warming: half, heat_capacity: capacity, cooling_time: tau }),
        force,
        &rows,
        1e-4,
    );
}

#[test]
fn friction_under_load() {
    // A spring is drawn out by a force that only grows, with friction on the mass that its force presses on.
    let (k, c0, mu) = (300.0, 0.4, 0.3);
    let force = |t: f64| 0.5 + 12.0 * t;
    let spring = element("spring", "mass", &format!("kind = \"spring\"\nstiffness = {k}\n"))
        + &element("loss", "mass", "kind = \"damper\"\ndamping = 30.0");
    let network = device(&(MASS.to_string() + &spring));
    let law = Law::LoadFriction(LoadFriction { force: c0, coefficient: mu, joint: Some("spring".into()) });
    let mut plant = SealedPlant::new(&network, &hiding(&network, vec![grounded("mass", law)]), PERIOD).unwrap();
    let found = run(&mut plant, 1500, PERIOD, |t| vec![force(t)]);
    let rows = runge_kutta(1500, force, |[x, v]: &[f64; 2], f| [*v, (f - k * x - 30.0 * v - c0 - mu * k * x.abs()) / 0.5]);
    assert!(rows.iter().all(|row| row[1] > 0.0), "it never turns");
    for (row, other) in rows.iter().zip(&found) {
        assert!((row[0] - other[0]).abs() < 1e-4 * rows[1499][0] && (row[1] - other[1]).abs() < 1e-3 * rows[1499][1]);
    }
}

#[test]
fn one_bristle() {
    let (s, c, h, d, vs) = (3000.0, 1.5, 2.2, 8.0, 0.01);
    let force = swept(2.5);
    let rows = runge_kutta(1500, force, |[_, v, z]: &[f64; 3], f| [*v, (f - s * z) / 0.5, v - s / c * v.abs() * z]);
    agrees(Law::Dahl(Dahl { stiffness: s, coulomb: c }), force, &rows, 2e-3);
    let rows = runge_kutta(1500, force, |[_, v, z]: &[f64; 3], f| {
        let g = c + (h - c) * (-(v / vs) * (v / vs)).exp();
        let bends = v - s * v.abs() / g * z;
        [*v, (f - s * z - d * bends) / 0.5, bends]
    });
    agrees(Law::Lugre(Lugre { stiffness: s, damping: d, coulomb: c, at_rest: h, velocity: vs }), force, &rows, 5e-3);
}

#[test]
fn a_gap_with_sharp_edges_in_a_joint() {
    // The shaft's end as a state of its own, stopped at the ends of the gap.
    let (k, c, gap) = (4000.0, 6.0, 1e-3);
    let force = swept(2.0);
    let rows = runge_kutta(1500, force, |[x, v, end]: &[f64; 3], f| {
        let free = v + k / c * (x - end);
        let stopped = (*end >= 0.5 * gap && free > 0.0) || (*end <= -0.5 * gap && free < 0.0);
        let moves = if stopped { 0.0 } else { free };
        [*v, (f - k * (x - end) - c * (v - moves)) / 0.5, moves]
    });
    let network = device(MASS);
    let law = Law::Backlash(Backlash { gap, stiffness: k, damping: c });
    let truth = hiding(
        &network,
        vec![(backdrive_sealed::effects::Physics::Law(law.clone()), Site::Between(["mass".into(), "ground".into()]), vec![])],
    );
    assert!(SealedPlant::new(&network, &truth, PERIOD).is_ok());
    agrees(law, force, &rows, 1e-2);
}
