//! How long a simulated second of five devices of `plant/models` takes at an error of 0.1 %, as a share of a body's range.
//!
//!     cargo bench -p backdrive-export --bench five_devices                     (ours; writes target/five_devices for the others)
//!     target/venv/bin/python benches/five_devices/time_others.py               (MuJoCo and SciPy, and the table)
//!
//! All are pushed by the same held forces for 2 s, without a hand. What MuJoCo cannot say is replaced in all three by what stands in its place there.

use backdrive_export::{change_all, mjcf};
use backdrive_plant::model::{Hold, Model};
use backdrive_plant::stepper::{Options, Plant, Segment};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// Time for which forces are held, s.
const HOLD_S: f64 = 1e-3;
const SAMPLES: usize = 2000;
/// Substeps of each hold that count as converged.
const CONVERGED: usize = 256;
/// Share of a body's range.
const ERROR: f64 = 1e-3;
/// Steps at which MuJoCo is asked, us.
const MUJOCO_US: [f64; 8] = [1000.0, 500.0, 250.0, 125.0, 62.5, 31.25, 15.625, 7.8125];
const ROUNDS: usize = 9;
/// Devices, and how hard they are pushed, N or N m.
const DEVICES: [(&str, f64); 5] =
    [("impulse-engine", 1.5), ("impulse-engine-linear", 1.5), ("two-axis", 1.5), ("ball-screw", 0.6), ("engine-test-bench", 150.0)];

fn drive(input: usize, size: f64) -> Vec<f64> {
    let tone = |t: f64, hz: f64| (TAU * hz * t + 0.9 * input as f64).sin();
    (0..SAMPLES)
        .map(|k| HOLD_S * k as f64)
        .map(|t| size * (t / 0.2).min(1.0) * (tone(t, 3.1) + 0.5 * tone(t, 7.3) + 0.2 * tone(t, 23.0)) / 1.7)
        .collect()
}

/// Positions of the bodies after every hold, one after the other.
fn run(plant: &mut Plant, drives: &[Vec<f64>], bodies: usize) -> Vec<Vec<f64>> {
    plant.reset();
    let mut found = vec![Vec::with_capacity(SAMPLES); bodies];
    let mut now = vec![Segment::held(0.0); drives.len()];
    for k in 0..SAMPLES {
        now.iter_mut().zip(drives).for_each(|(segment, drive)| *segment = Segment::held(drive[k]));
        plant.step(&now);
        found.iter_mut().enumerate().for_each(|(body, column)| column.push(plant.position(body)));
    }
    found
}

/// Largest distance as a share of a body's range.
fn distance(found: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    let of_body = |(found, expected): (&Vec<f64>, &Vec<f64>)| {
        let (low, high) = expected.iter().fold((0.0f64, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
        found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / (high - low)
    };
    found.iter().zip(expected).map(of_body).fold(0.0, f64::max)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = root.join("target/five_devices");
    std::fs::create_dir_all(&folder)?;
    let mut all: Vec<Value> = Vec::new();
    println!("{:>24} {:>10} {:>16} {:>26}", "device", "step, us", "from converged", "ms per simulated second");
    for (name, size) in DEVICES {
        let mut model = Model::load(&root.join(format!("plant/models/{name}.toml")))?;
        model.outputs.clear();
        model.axes.clear();
        model.inputs.iter_mut().for_each(|input| (input.hold, input.saturation) = (Hold::Zero, f64::INFINITY));
        let first = mjcf::export(&model, Some(1e-3))?;
        for left in first.left_out.iter().filter(|left| !left.changes.is_empty()) {
            println!("{name}: {} ({}): in its place {}", left.name, left.kind, left.instead.as_deref().unwrap_or("nothing"));
        }
        model = change_all(&model, &first.left_out);
        let drives: Vec<Vec<f64>> = (0..model.inputs.len()).map(|i| drive(i, size)).collect();
        let plant = |substeps| Plant::new(&model, HOLD_S, &Options { substeps: Some(substeps), ..Options::default() });
        let bodies = model.bodies.len();
        let converged = run(&mut plant(CONVERGED)?, &drives, bodies);
        let mut ours = json!(null);
        for substeps in [1, 2, 4, 8, 16, 32, 64] {
            let mut plant = plant(substeps)?;
            let apart = distance(&run(&mut plant, &drives, bodies), &converged);
            let us = 1e6 * HOLD_S / substeps as f64;
            if apart > ERROR {
                println!("{name:>24} {us:>10.1} {:>14.4} %", 100.0 * apart);
                continue;
            }
            let mut fastest = f64::INFINITY;
            for _ in 0..ROUNDS {
                let start = Instant::now();
                black_box(run(&mut plant, black_box(&drives), bodies));
                fastest = fastest.min(start.elapsed().as_secs_f64());
            }
            let ms = 1e3 * fastest / (HOLD_S * SAMPLES as f64);
            println!("{name:>24} {us:>10.1} {:>14.4} % {ms:>26.3}", 100.0 * apart);
            ours = json!({ "us": us, "apart": apart, "ms": ms });
            break;
        }
        for us in MUJOCO_US {
            std::fs::write(folder.join(format!("{name}-{us}.xml")), mjcf::export(&model, Some(1e-6 * us))?.text)?;
        }
        let end = |place: Option<usize>| place.map_or(json!(null), |body| json!(body));
        let elements: Vec<Value> = model
            .elements
            .iter()
            .map(|e| json!({ "kind": e.law.kind().name, "between": [end(e.between[0]), end(e.between[1])], "values": e.law.values() }))
            .collect();
        all.push(json!({
            "name": name, "hold": HOLD_S, "error": ERROR, "mujoco_us": MUJOCO_US, "ours": ours, "drives": drives, "converged": converged,
            "inputs": model.inputs.iter().map(|i| json!({ "name": i.name, "on": i.on, "gain": i.gain })).collect::<Vec<_>>(),
            "bodies": model.bodies.iter().map(|b| json!({ "name": b.name, "inertia": b.inertia })).collect::<Vec<_>>(),
            "elements": elements,
        }));
    }
    std::fs::write(folder.join("devices.json"), serde_json::to_string(&all)?)?;
    Ok(())
}
