//! How much faster than the clock arms are simulated, by joints and by step, and how far each step is from the converged solution.
//!
//! An arm hangs from a ceiling. Its joints turn about x and y alternately. Each joint is driven by tones and has friction; `soft` arms have a motor behind
//! a compliant gear, with friction on both sides. The program also writes the arms as MJCF into `target/arm_speed`, where `time_mujoco.py` reads them, and
//! puts the results measured here next to them. `benches/README.md` describes how to run both and lists the results.

use backdrive_export::mjcf;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, Plant, Segment};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// Time for which torques are held, s.
const HOLD_S: f64 = 1e-3;
/// Samples of the torques.
const SAMPLES: usize = 2000;
/// Substeps of each hold that count as converged.
const CONVERGED: usize = 64;
/// Steps at which MuJoCo is asked, us.
const MUJOCO_US: [f64; 6] = [1000.0, 500.0, 250.0, 125.0, 62.5, 15.625];
const ROUNDS: usize = 7;

/// An arm of `joints` links; from the base to the tip everything gets lighter.
fn arm(joints: usize, soft: bool) -> String {
    let (mut opened, mut closed, mut inertias, mut network) = (String::new(), String::new(), String::from("[bodies]\n"), String::new());
    let mut element = |kind: &str, between: [String; 2], numbers: String| {
        let name = format!("{kind}{}", network.len());
        network += &format!("[[elements]]\nname = '{name}'\nkind = '{kind}'\nbetween = {between:?}\n{numbers}\n");
    };
    let mut signals = String::new();
    for i in 0..joints {
        let (axis, size) = (["1 0 0", "0 1 0"][i % 2], share(i, joints));
        let place = if i == 0 { "0 0 0" } else { "0 0 -0.2" };
        opened += &format!("<body name=\"link{i}\" pos=\"{place}\"><joint name=\"q{i}\" type=\"hinge\" axis=\"{axis}\"/>");
        opened += &format!("<inertial pos=\"0 0 -0.1\" mass=\"{size}\" diaginertia=\"{0} {0} {1}\"/>", 0.004 * size, 0.001 * size);
        closed += "</body>";
        let joint = format!("q{i}");
        let driven = if soft { format!("rotor{i}") } else { joint.clone() };
        let ground = || "ground".to_string();
        inertias += &format!("{driven} = {}\n", 0.02 * size);
        if soft {
            element("spring", [driven.clone(), joint.clone()], format!("stiffness = {}", 300.0 * size));
            element("damper", [driven.clone(), joint.clone()], format!("damping = {}", 0.3 * size));
            element("coulomb", [joint, ground()], format!("force = {}", 0.05 * size));
        }
        element("coulomb", [driven.clone(), ground()], format!("force = {}", if soft { 0.05 } else { 0.1 } * size));
        element("damper", [driven.clone(), ground()], format!("damping = {}", 0.1 * size));
        signals += &format!("[[inputs]]\nname = 'torque{i}'\nkind = 'force'\non = '{driven}'\n");
        signals += &format!("[[outputs]]\nname = 'x{i}'\nkind = 'position'\nof = 'q{i}'\n");
    }
    let xml = format!("<mujoco model=\"arm\"><worldbody>{opened}{closed}</worldbody></mujoco>");
    format!("name = 'arm-{joints}'\n[robot]\nxml = \'\'\'{xml}\'\'\'\n{inertias}{network}{signals}")
}

/// How heavy the link is and what drives it, as a share of the first one's.
fn share(link: usize, joints: usize) -> f64 {
    1.0 - 0.8 * link as f64 / joints as f64
}

/// Torques of a joint, N m.
fn torques(joint: usize, joints: usize) -> Vec<f64> {
    let phase = 0.9 * joint as f64;
    let tone = |t: f64, hz: f64, k: f64| (TAU * hz * t + k * phase).sin();
    let at = |t: f64| tone(t, 0.9, 1.0) + 0.6 * tone(t, 2.3, 2.0) + 0.3 * tone(t, 7.1, 3.0);
    (0..SAMPLES).map(|k| HOLD_S * k as f64).map(|t| 0.7 * share(joint, joints) * (t / 0.2).min(1.0) * at(t)).collect()
}

/// Angles of the joints after every hold, rad, one after the other.
fn run(plant: &mut Plant, drives: &[Vec<f64>], places: &[usize]) -> Vec<Vec<f64>> {
    plant.reset();
    let mut found = vec![Vec::with_capacity(SAMPLES); places.len()];
    let mut now: Vec<Segment> = vec![Segment::held(0.0); drives.len()];
    for k in 0..SAMPLES {
        now.iter_mut().zip(drives).for_each(|(segment, drive)| *segment = Segment::held(drive[k]));
        plant.step(&now);
        found.iter_mut().zip(places).for_each(|(column, body)| column.push(plant.position(*body)));
    }
    found
}

/// Largest distance as a share of a joint's range.
fn distance(found: &[Vec<f64>], expected: &[Vec<f64>]) -> f64 {
    let of_joint = |(found, expected): (&Vec<f64>, &Vec<f64>)| {
        let (low, high) = expected.iter().fold((0.0f64, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
        found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / (high - low)
    };
    found.iter().zip(expected).map(of_joint).fold(0.0, f64::max)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/arm_speed");
    std::fs::create_dir_all(&folder)?;
    let mut arms: Vec<Value> = Vec::new();
    println!("{:>7} {:>6} {:>10} {:>16} {:>18}", "joints", "gears", "step, us", "from converged", "times real time");
    for (joints, soft) in [(2, false), (4, false), (7, false), (14, false), (2, true), (4, true), (7, true)] {
        let name = format!("{joints}-{}", if soft { "soft" } else { "stiff" });
        let model = Model::from_toml(&arm(joints, soft), &name)?;
        let drives: Vec<Vec<f64>> = (0..joints).map(|i| torques(i, joints)).collect();
        let place = |i: usize| model.bodies.iter().position(|b| b.name == format!("q{i}")).ok_or("a joint is no body");
        let places = (0..joints).map(place).collect::<Result<Vec<_>, _>>()?;
        let plant = |substeps| Plant::new(&model, HOLD_S, &Options { substeps: Some(substeps), ..Options::default() });
        let converged = run(&mut plant(CONVERGED)?, &drives, &places);
        let mut steps = Vec::new();
        for substeps in [1, 2, 4, 8, 16] {
            let mut plant = plant(substeps)?;
            let apart = distance(&run(&mut plant, &drives, &places), &converged);
            let mut fastest = f64::INFINITY;
            for _ in 0..ROUNDS {
                let start = Instant::now();
                black_box(run(&mut plant, black_box(&drives), &places));
                fastest = fastest.min(start.elapsed().as_secs_f64());
            }
            let (us, times) = (1e6 * HOLD_S / substeps as f64, HOLD_S * SAMPLES as f64 / fastest);
            println!("{joints:>7} {:>6} {us:>10.1} {:>14.4} % {times:>18.0}", if soft { "soft" } else { "stiff" }, 100.0 * apart);
            steps.push(json!({ "us": us, "apart": apart, "times": times }));
        }
        for us in MUJOCO_US {
            let exported = mjcf::export(&model, Some(1e-6 * us))?;
            assert!(exported.left_out.iter().all(|left| left.kind == "motion"), "{name}: {:?}", exported.left_out);
            std::fs::write(folder.join(format!("{name}-{us}.xml")), exported.text)?;
        }
        let angles: Vec<&String> = model.outputs.iter().map(|o| &o.name).collect();
        let inputs: Vec<&String> = model.inputs.iter().map(|i| &i.name).collect();
        let mut arm = json!({ "name": name, "joints": joints, "soft": soft, "hold": HOLD_S, "mujoco_us": MUJOCO_US, "steps": steps });
        arm["inputs"] = json!(inputs);
        arm["drives"] = json!(drives);
        arm["outputs"] = json!(angles);
        arm["converged"] = json!(converged);
        arms.push(arm);
    }
    std::fs::write(folder.join("arms.json"), serde_json::to_string(&arms)?)?;
    println!("{}", folder.join("arms.json").display());
    Ok(())
}
