//! Errors of free runs from the commands on recordings that were left out, joint by joint: `cargo run --release -p backdrive-servo --example so101_table -- SET MODEL`.
//!
//! Without a set that holds recordings out, each is simulated by a fit that has not seen it. The line `mean` is the mean over the joints. Below stand the
//! nrmse of each recording and the effects found. A third argument names a file to which the diagnosed model is written.

use backdrive_diagnosis::options::Options;
use backdrive_plant::set::RecordingSet;
use backdrive_servo::diagnose::diagnose;
use backdrive_servo::problem::Problem;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let (set, model, out) = match asked.as_slice() {
        [set, model] => (set, model, None),
        [set, model, out] => (set, model, Some(Path::new(out))),
        _ => {
            eprintln!("expected SET MODEL [OUT]: a set.toml with commands and positions, a model file with the robot, and a file to write");
            return ExitCode::from(2);
        }
    };
    match table(Path::new(set), Path::new(model), out) {
        Ok(text) => {
            println!("{text}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(3)
        }
    }
}

fn table(set: &Path, model: &Path, out: Option<&Path>) -> Result<String, String> {
    let began = Instant::now();
    let set = RecordingSet::open(set).map_err(|e| e.to_string())?;
    let problem = Problem::open(&set, Some(model)).map_err(|e| e.to_string())?;
    let found = diagnose(&problem, &Options::default(), None, &|_| ()).map_err(|e| e.to_string())?;
    if let Some(out) = out {
        std::fs::write(out, found.model.to_toml()).map_err(|e| format!("{}: {e}", out.display()))?;
    }
    let servo = found.verdict.servo.ok_or("no joint was diagnosed")?;
    let mut lines = vec![format!("{:<16} {:>21} {:>21} {:>21}", "", "the command", "second order", "diagnosed")];
    lines.push(format!(
        "{:<16} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "joint", "nrmse", "MAE mrad", "nrmse", "MAE mrad", "nrmse", "MAE mrad"
    ));
    let mut sums = [0.0; 6];
    for joint in &servo.joints {
        let e = &joint.errors;
        let of = |x: Option<f64>| x.unwrap_or(0.0);
        let row = [of(e.command), 1e3 * e.command_mae, of(e.refit), 1e3 * e.refit_mae, of(e.diagnosed), 1e3 * e.diagnosed_mae];
        sums.iter_mut().zip(row).for_each(|(sum, x)| *sum += x / servo.joints.len() as f64);
        lines.push(row_of(&joint.joint, &row));
    }
    lines.push(row_of("mean", &sums));
    for record in &found.verdict.held_out.per_record {
        lines.push(format!("{:<30} {:<24} {:>8.4}", record.record, record.output, record.nrmse_after.unwrap_or(f64::NAN)));
    }
    for answer in &found.answers {
        lines.push(format!("{}: {}", problem.joints[answer.joint].name, answer.found.best.added.join(", ")));
    }
    lines.push(format!("{:.0} s", began.elapsed().as_secs_f64()));
    Ok(lines.join("\n"))
}

fn row_of(name: &str, row: &[f64; 6]) -> String {
    let [a, b, c, d, e, f] = row;
    format!("{name:<16} {a:>10.3} {b:>10.2} {c:>10.3} {d:>10.2} {e:>10.3} {f:>10.2}")
}
