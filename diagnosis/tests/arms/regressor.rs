//! The regressor is the inverse dynamics, and finds which parameters can be separated.

use crate::common::{AS_STATED, set};
use backdrive_diagnosis::arms::base::base;
use backdrive_diagnosis::arms::inertial::{COUNT, pseudo_inertia, to_link};
use backdrive_diagnosis::arms::motion::Motion;
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::rigid::{regressor, torques};
use backdrive_plant::set::RecordingSet;

fn problem() -> Problem {
    let folder = tempfile::tempdir().unwrap();
    set(folder.path(), &AS_STATED, "", |_| {});
    Problem::open(&RecordingSet::open(folder.path()).unwrap(), None).unwrap()
}

fn motion() -> Motion {
    let wave = |f: f64| (0..50).map(|i| (f * f64::from(i)).sin()).collect::<Vec<f64>>();
    Motion {
        name: String::new(),
        position: vec![wave(0.31), wave(0.17)],
        velocity: vec![wave(0.23), wave(0.41)],
        acceleration: vec![wave(0.53), wave(0.37)],
        torque: Vec::new(),
        recorded_velocity: Vec::new(),
        moves: Vec::new(),
        counts: Vec::new(),
        payload: None,
    }
}

#[test]
fn parameters_times_the_regressor_are_the_torque() {
    let (problem, motion) = (problem(), motion());
    let columns = regressor(&problem.robot, &problem.bodies, &motion, &[]).unwrap();
    let direct = torques(&problem.tree, &motion, &[]);
    for (j, signal) in direct.iter().enumerate() {
        for (i, torque) in signal.iter().enumerate() {
            let sum: f64 = problem.bodies.nominal.iter().flatten().zip(&columns).map(|(p, c)| p * c[j][i]).sum();
            assert!((sum - torque).abs() < 1e-11 * (1.0 + torque.abs()), "joint {j}, sample {i}: {sum} {torque}");
        }
    }
}

#[test]
fn a_planar_arm_of_two_joints_has_six_base_parameters() {
    // About parallel axes under gravity each body shows its inertia about the axis and two first moments (Gautier & Khalil 1990); the first body's take
    // up the mass of the second.
    let problem = problem();
    let all = base(&problem).unwrap();
    assert_eq!(all.len(), 6, "{:?}", all.iter().map(|b| b.name()).collect::<Vec<_>>());
    // A change along the combination of a base parameter changes no torque.
    let motion = motion();
    let columns = regressor(&problem.robot, &problem.bodies, &motion, &[]).unwrap();
    for b in &all {
        for (with, factor) in &b.with {
            // A unit more of the dependent parameter is equivalent to its coefficient more of each base parameter that contains it.
            let of_all: Vec<(usize, f64)> =
                all.iter().filter_map(|o| o.with.iter().find(|(i, _)| i == with).map(|(_, f)| (o.of, *f))).collect();
            assert!(factor.abs() > 0.0);
            for j in 0..2 {
                for i in 0..motion.len() {
                    let sum: f64 = of_all.iter().map(|(k, f)| f * columns[*k][j][i]).sum();
                    assert!((columns[*with][j][i] - sum).abs() < 1e-9, "{}", b.name());
                }
            }
        }
    }
    assert!(all.iter().all(|b| b.of / COUNT < 2));
}

#[test]
fn a_pseudo_inertia_says_what_a_body_can_be() {
    let problem = problem();
    for p in &problem.bodies.nominal {
        assert!(pseudo_inertia(p).cholesky().is_some());
        let back = backdrive_diagnosis::arms::inertial::of_link(to_link(p).as_ref());
        assert!(p.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-12));
    }
    // A centre of mass outside of what the inertia allows.
    let mut p = problem.bodies.nominal[1];
    p[3] *= 3.0;
    assert!(pseudo_inertia(&p).cholesky().is_none());
}
