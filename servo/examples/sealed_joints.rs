//! Diagnoses drawn servo joints: `cargo run --release -p backdrive-servo --example sealed_joints -- CASES VERDICTS`.
//!
//! CASES is a folder of `tests/python/draw_servos.py`; each case's verdict is written to VERDICTS/NNN/verdict.json, for `tests/python/score_servos.py`.

use backdrive_diagnosis::options::Options;
use backdrive_plant::set::RecordingSet;
use backdrive_servo::diagnose::diagnose;
use backdrive_servo::problem::Problem;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let [cases, verdicts] = asked.as_slice() else {
        eprintln!("expected CASES VERDICTS");
        return ExitCode::from(2);
    };
    match all(Path::new(cases), Path::new(verdicts)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(3)
        }
    }
}

fn all(cases: &Path, verdicts: &Path) -> Result<(), String> {
    let entries = std::fs::read_dir(cases).map_err(|e| format!("{}: {e}", cases.display()))?;
    let mut folders: Vec<PathBuf> = entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.join("set.toml").is_file()).collect();
    folders.sort();
    for folder in folders {
        let set = RecordingSet::open(&folder.join("set.toml")).map_err(|e| e.to_string())?;
        let problem = Problem::open(&set, None).map_err(|e| e.to_string())?;
        let found = diagnose(&problem, &Options::default(), None, &|_| ()).map_err(|e| format!("{}: {e}", folder.display()))?;
        let out = verdicts.join(folder.file_name().unwrap_or_default());
        std::fs::create_dir_all(&out).map_err(|e| e.to_string())?;
        std::fs::write(out.join("verdict.json"), serde_json::to_string_pretty(&found.verdict).map_err(|e| e.to_string())?)
            .map_err(|e| e.to_string())?;
    }
    Ok(())
}
