//! `backdrive test-bench`: an engine test bench identified from its bags.

use crate::cli;
use crate::columns::columns;
use crate::failure::Failure;
use crate::output;
use backdrive_report::number;
use backdrive_testbench::files::files;
use backdrive_testbench::lag::Observation;
use backdrive_testbench::{Asked, BenchError, Identified, Record, Validation, identify, validate};
use serde_json::{Value, json};
use std::path::Path;

/// Identifies, writes what a graph takes, and prints the parameters.
pub fn test_bench(options: &cli::TestBench) -> Result<u8, Failure> {
    let bad = |e: BenchError| Failure::input(e);
    let record = |path: &Path| Record::of_bag(path).map_err(bad);
    let (unfired, map, steps) = (record(&options.unfired)?, record(&options.map)?, record(&options.lag)?);
    let asked = asked(options, &steps);
    let found = crate::progress::busy("identifying the bench", || identify(&asked, &unfired, &map, &steps)).map_err(bad)?;
    let validation = match (&options.dragged, &options.cycle) {
        (Some(dragged), Some(cycle)) => Some(validate(&found.bench, &asked.observation, &record(dragged)?, &record(cycle)?).map_err(bad)?),
        _ => None,
    };
    output::folder(&options.out)?;
    for (name, text) in files(&found).map_err(Failure::machine)? {
        output::file(&options.out.join(name), text)?;
    }
    if options.json {
        output::json(&as_json(&asked, &found, validation.as_ref()))?;
    } else {
        output::line(text(&asked, &found, validation.as_ref()))?;
    }
    output::note(format_args!("wrote engine.toml, dynamometer.toml and shaft.toml into {}", options.out.display()));
    Ok(0)
}

/// What is asked for; without speeds of the lag's grid the lowest, middle and highest at which the pedal was stepped.
fn asked(options: &cli::TestBench, steps: &Record) -> Asked {
    let stepped = steps.pedal.windows(2).zip(&steps.setpoint).filter(|(pedal, _)| pedal[0] != pedal[1]).map(|(_, speed)| *speed);
    let (low, high) = stepped.fold((f64::INFINITY, 0.0_f64), |(low, high), s| (low.min(s), high.max(s)));
    let speeds = if options.speeds.is_empty() { vec![low, 0.5 * (low + high), high] } else { options.speeds.clone() };
    Asked {
        engine_inertia: options.engine_inertia,
        stiffness: options.stiffness,
        power: options.power,
        plateau_s: options.plateau,
        lag_points: [options.pedals.iter().map(|percent| 0.01 * percent).collect(), speeds],
        observation: Observation { noise: [options.noise; 2], force_rate: options.torque_rate, back_off: options.back_off },
    }
}

/// Name, unit, value, standard error.
fn numbers(found: &Identified) -> Vec<(&'static str, &'static str, f64, Option<f64>)> {
    let (shaft, machine, errors) = (&found.bench.shaft, &found.bench.dynamometer, &found.refined.deviations);
    vec![
        ("J_A, dynamometer's inertia", "kg m2", shaft.dynamometer, None),
        ("J_C, engine's inertia", "kg m2", shaft.engine, errors.first().copied()),
        ("c, shaft's stiffness", "N m/rad", shaft.stiffness, errors.get(1).copied()),
        ("d, shaft's damping", "N m s/rad", shaft.damping, errors.get(2).copied()),
        ("d by matching poles", "N m s/rad", found.first_damping, None),
        ("torsional mode", "Hz", found.torsional_hz, None),
        ("dynamometer's frequency", "Hz", machine.frequency_hz, None),
        ("dynamometer's damping ratio", "", machine.damping_ratio, None),
        ("dynamometer's delay", "s", machine.delay_s, None),
    ]
}

/// What correlates with what, 0 to 1, and the paper's value.
fn correlations(validation: &Validation) -> Vec<(&'static str, f64)> {
    vec![
        ("dragged, closed loop: dynamometer's speed", validation.mechanical_closed),
        ("dragged, open loop: dynamometer's speed", validation.mechanical_open),
        ("observed torque fed to the shaft: engine's speed", validation.observer[0]),
        ("observed torque fed to the shaft: dynamometer's speed", validation.observer[1]),
        ("engine model with the observed torque", validation.engine),
        ("dynamometer model, dragged", validation.dynamometer[0]),
        ("dynamometer model, cycle", validation.dynamometer[1]),
        ("whole bench from pedal and wanted speed: engine's speed", validation.whole[0]),
        ("whole bench from pedal and wanted speed: dynamometer's torque", validation.whole[1]),
    ]
}

/// The lag by pedal and speed: pedal (0 to 1), speed (rad/s), time constant (s), standard error (s).
fn lags(asked: &Asked, found: &Identified) -> Vec<[f64; 4]> {
    let [pedals, speeds] = &asked.lag_points;
    let points = speeds.iter().flat_map(|speed| pedals.iter().map(move |pedal| (*pedal, *speed)));
    let of = |values: &[f64], k: usize| values.get(k).copied().unwrap_or(f64::NAN);
    points.enumerate().map(|(k, (pedal, speed))| [pedal, speed, of(&found.lags.values, k), of(&found.lags.deviations, k)]).collect()
}

fn as_json(asked: &Asked, found: &Identified, validation: Option<&Validation>) -> Value {
    let numbers: Vec<Value> = numbers(found)
        .into_iter()
        .map(|(name, unit, value, error)| json!({ "name": name, "unit": unit, "value": value, "standard_error": error }))
        .collect();
    let lags: Vec<Value> = lags(asked, found)
        .into_iter()
        .map(|[pedal, speed, value, error]| json!({ "pedal": pedal, "speed": speed, "time_constant": value, "standard_error": error }))
        .collect();
    let correlations: Option<Vec<Value>> =
        validation.map(|v| correlations(v).into_iter().map(|(name, value)| json!({ "of": name, "correlation": value })).collect());
    json!({ "numbers": numbers, "lags": lags, "correlations": correlations })
}

fn text(asked: &Asked, found: &Identified, validation: Option<&Validation>) -> String {
    let mut table = vec![["number", "value", "std. error", "unit"].map(String::from).to_vec()];
    for (name, unit, value, error) in numbers(found) {
        table.push(vec![name.to_string(), number(value), error.map_or("–".to_string(), number), unit.to_string()]);
    }
    let mut out = columns(&table);
    let mut table = vec![["engine's lag at pedal, %", "speed, rad/s", "time constant, s", "std. error"].map(String::from).to_vec()];
    for [pedal, speed, value, error] in lags(asked, found) {
        table.push(vec![number(100.0 * pedal), number(speed), number(value), number(error)]);
    }
    out += "\n";
    out += &columns(&table);
    if let Some(validation) = validation {
        let mut table = vec![["correlation on held-out recordings", "%"].map(String::from).to_vec()];
        table.extend(correlations(validation).into_iter().map(|(name, value)| vec![name.to_string(), format!("{:.1}", 100.0 * value)]));
        out += "\n";
        out += &columns(&table);
    }
    out.trim_end().to_string()
}
