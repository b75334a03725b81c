//! A bench simulated without noise is identified as what it is.

use backdrive_control::dynamometer::DynamometerModel;
use backdrive_control::engine::{Engine, Grid};
use backdrive_control::observer::Shaft;
use backdrive_control::speed_control::SpeedControl;
use backdrive_testbench::lag::Observation;
use backdrive_testbench::{Asked, Bench, Record, closed_loop, identify, open_loop};

const PERIOD: f64 = 1e-3;

fn truth() -> Bench {
    let speeds = vec![0.0, 80.0, 160.0, 240.0];
    let map =
        Grid::new(vec![0.0, 0.5, 1.0], speeds, vec![0.0, 0.0, 0.0, -20.0, 190.0, 400.0, -35.0, 280.0, 590.0, -55.0, 210.0, 480.0]).unwrap();
    let lag = Grid::new(vec![0.0, 1.0], vec![80.0, 240.0], vec![1.6, 1.0, 0.8, 0.4]).unwrap();
    Bench {
        shaft: Shaft { engine: 0.94, dynamometer: 0.61, stiffness: 2.06e4, damping: 9.5 },
        engine: Engine::new(map, lag),
        dynamometer: DynamometerModel {
            map: vec![[-700.0, -650.0], [0.0, 0.0], [700.0, 640.0]],
            frequency_hz: 13.0,
            damping_ratio: 0.75,
            delay_s: 0.005,
            power: 240e3,
        },
    }
}

/// A record of what is wanted, filled in by simulation: `rows` are (until s, pedal, speed), joined by steps.
fn record(rows: &[(f64, f64, f64)], added: impl Fn(f64) -> f64) -> Record {
    let steps = (rows.last().unwrap().0 / PERIOD) as usize;
    let at = |k: usize| rows.iter().find(|r| (k as f64 * PERIOD) < r.0).copied().unwrap_or(rows[rows.len() - 1]);
    let blank = vec![0.0; steps];
    let mut record = Record {
        period_s: PERIOD,
        pedal: (0..steps).map(|k| at(k).1).collect(),
        setpoint: (0..steps).map(|k| at(k).2).collect(),
        added: (0..steps).map(|k| added(k as f64 * PERIOD)).collect(),
        command: blank.clone(),
        torque: blank.clone(),
        engine_speed: blank.clone(),
        dyno_speed: blank.clone(),
        shaft_torque: blank,
        true_engine_torque: Vec::new(),
        observed: Vec::new(),
        control: SpeedControl::new(20.0, 60.0, 700.0),
    };
    let found = closed_loop(&truth(), &record);
    let mut control = record.control;
    record.command = (0..steps).map(|k| control.step(record.setpoint[k], found.engine_speed[k], record.added[k], PERIOD).0).collect();
    // The shaft's torque from the equation of the dynamometer, at a step: the mean over the periods about it.
    let j = truth().shaft.dynamometer;
    let over = |k: usize| j * (found.dyno_speed[k + 1] - found.dyno_speed[k]) / PERIOD - found.dyno_torque[k];
    record.shaft_torque = (0..steps).map(|k| if k == 0 || k + 1 >= steps { 0.0 } else { 0.5 * (over(k - 1) + over(k)) }).collect();
    (record.torque, record.engine_speed, record.dyno_speed) = (found.dyno_torque, found.engine_speed, found.dyno_speed);
    record
}

#[test]
fn every_number_is_found() {
    let tau = std::f64::consts::TAU;
    // Lines of 0.25 Hz, phases by Schroeder.
    let shake = move |t: f64| {
        (1..=200).map(|k| 6.0 * (tau * 0.25 * k as f64 * t - std::f64::consts::PI * (k * k) as f64 / 200.0).sin()).sum::<f64>()
    };
    let unfired = record(&[(4.0, 0.0, 100.0), (12.0, 0.0, 160.0), (20.0, 0.0, 120.0)], shake);
    let mut rows = vec![(3.0, 0.0, 80.0)];
    for speed in [80.0, 160.0, 240.0] {
        for pedal in [0.0, 0.5, 1.0] {
            rows.push((rows[rows.len() - 1].0 + 12.0, pedal, speed));
        }
    }
    let stationary = record(&rows, |_| 0.0);
    let mut rows = vec![(3.0, 0.0, 80.0)];
    for speed in [80.0, 240.0] {
        for pedal in [0.0, 0.3, 0.0, 0.3, 1.0, 0.7, 1.0, 0.7] {
            rows.push((rows[rows.len() - 1].0 + 4.0, pedal, speed));
        }
    }
    let steps = record(&rows, |_| 0.0);
    let asked = Asked {
        engine_inertia: 0.9,
        stiffness: 2e4,
        power: 240e3,
        plateau_s: 3.5,
        lag_points: [vec![0.0, 1.0], vec![80.0, 240.0]],
        observation: Observation { noise: [0.005, 0.005], force_rate: 400.0, back_off: 1.2 },
    };
    let found = identify(&asked, &unfired, &stationary, &steps).unwrap();
    let (shaft, expected) = (found.bench.shaft, truth());
    println!("{found:#?}", found = (shaft, found.first_damping, &found.bench.dynamometer, found.bench.engine.lag.values()));
    let close = |a: f64, b: f64, share: f64| (a - b).abs() < share * b.abs();
    assert!(close(shaft.dynamometer, expected.shaft.dynamometer, 0.01));
    assert!(close(shaft.engine, expected.shaft.engine, 0.01) && close(shaft.stiffness, expected.shaft.stiffness, 0.02));
    assert!(close(shaft.damping, expected.shaft.damping, 0.05) && close(found.first_damping, expected.shaft.damping, 0.2));
    let machine = &found.bench.dynamometer;
    assert!(close(machine.frequency_hz, 13.0, 0.02) && close(machine.delay_s, 0.005, 0.21));
    let worst = |a: &Grid, b: &Grid| a.values().iter().zip(b.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst(&found.bench.engine.map, &expected.engine.map) < 3.0);
    assert!(worst(&found.bench.engine.lag, &expected.engine.lag) < 0.1);
}

#[test]
fn open_and_closed_loop_agree() {
    let bench = truth();
    let record = record(&[(2.0, 0.2, 100.0), (4.0, 0.8, 140.0)], |_| 0.0);
    let closed = closed_loop(&bench, &record);
    let open = open_loop(&bench.shaft, &record, &closed.engine_torque, &closed.dyno_torque);
    assert_eq!(open.engine_speed, closed.engine_speed);
    // A shaft that is dragged keeps its energy but for what torques give and damping takes: at rest of both, the wanted speed.
    assert!((closed.engine_speed.last().unwrap() - 140.0).abs() < 2.0);
}

#[test]
fn a_record_that_shows_nothing_is_refused_with_what_to_record() {
    let still = record(&[(10.0, 0.0, 100.0)], |_| 0.0);
    let asked = Asked {
        engine_inertia: 0.9,
        stiffness: 2e4,
        power: 240e3,
        plateau_s: 3.5,
        lag_points: [vec![0.0], vec![80.0]],
        observation: Observation { noise: [0.02, 0.02], force_rate: 200.0, back_off: 1.2 },
    };
    let told = identify(&asked, &still, &still, &still).unwrap_err().to_string();
    assert!(told.contains("record several pedals at several speeds"), "{told}");
}
