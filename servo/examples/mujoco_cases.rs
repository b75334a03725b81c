//! Free runs for MuJoCo: `cargo run --release -p backdrive-servo --example mujoco_cases -- SET MODEL FOLDER`, then `tests/python/servo_exports.py FOLDER`.
//!
//! MODEL is a diagnosed model. FOLDER gets its MJCF, and `cases.json` with commands, recordings and free runs of the model without what MuJoCo lacks.

use backdrive_export::{LeftOut, change_all, mjcf};
use backdrive_plant::set::RecordingSet;
use backdrive_servo::problem::Problem;
use backdrive_servo::run::free_runs;
use serde_json::{Map, Value, json};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let [set, model, folder] = asked.as_slice() else {
        eprintln!("expected SET MODEL FOLDER");
        return ExitCode::from(2);
    };
    match cases(Path::new(set), Path::new(model), Path::new(folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(3)
        }
    }
}

fn cases(set: &Path, model: &Path, folder: &Path) -> Result<(), String> {
    let set = RecordingSet::open(set).map_err(|e| e.to_string())?;
    let problem = Problem::open(&set, Some(model)).map_err(|e| e.to_string())?;
    let exported = mjcf::export(&problem.model, None).map_err(|e| e.to_string())?;
    std::fs::create_dir_all(folder).map_err(|e| e.to_string())?;
    for left in exported.left_out.iter().filter(|left| left.matters()) {
        println!("left out: {} of {}: {}", left.kind, left.name, left.why);
    }
    let written: Vec<LeftOut> = exported.left_out;
    let model = change_all(&problem.model, &written);
    let of = |name: &str| model.servos.iter().find(|s| s.joint == name).map(|s| s.numbers);
    let numbers: Vec<_> = problem.joints.iter().map(|j| of(&j.name)).collect();
    let held_out = problem.joints.iter().any(|j| !j.held_out.is_empty());
    let mut all = Vec::new();
    for index in 0..problem.joints.first().map_or(0, |j| if held_out { j.held_out.len() } else { j.fit.len() }) {
        let positions = free_runs(&problem, &numbers, held_out, index).map_err(|e| e.to_string())?;
        let mut joints = Map::new();
        let (mut name, mut t) = (String::new(), Vec::new());
        for (joint, simulated) in problem.joints.iter().zip(positions).filter(|(j, _)| of(&j.name).is_some()) {
            let record = if held_out { &joint.held_out[index] } else { &joint.fit[index] };
            (name, t) = (record.name.trim_end_matches(".csv").to_string(), record.t.clone());
            let value: Value = json!({ "command": record.command, "position": simulated, "recorded": record.position });
            joints.insert(joint.name.clone(), value);
        }
        std::fs::write(folder.join(format!("{name}.xml")), &exported.text).map_err(|e| e.to_string())?;
        all.push(json!({ "name": name, "t": t, "joints": joints }));
    }
    std::fs::write(folder.join("cases.json"), Value::Array(all).to_string()).map_err(|e| e.to_string())
}
