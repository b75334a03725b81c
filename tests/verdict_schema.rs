//! `docs/verdict.schema.json` is what the types say, and verdict files are valid by it: one that is written now, and those of earlier versions.

#[path = "common/skipped.rs"]
mod skipped;
mod system;

use backdrive_diagnosis::verdict::{Verdict, schema};
use jsonschema::Validator;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use system::{Place, file};

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path.as_ref()).unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))
}

fn validator() -> Validator {
    jsonschema::validator_for(&serde_json::from_str(&schema().unwrap()).unwrap()).unwrap()
}

/// What a file breaks, each with its place in the file.
fn broken(validator: &Validator, verdict: &Value) -> Vec<String> {
    validator.iter_errors(verdict).map(|e| format!("{}: {e}", e.instance_path())).collect()
}

/// Valid by the schema, read as a value, and written again with every key that was there.
fn assert_valid(validator: &Validator, text: &str, name: &str) {
    let verdict: Value = serde_json::from_str(text).unwrap();
    assert_eq!(broken(validator, &verdict), Vec::<String>::new(), "{name}");
    let read: Verdict = serde_json::from_str(text).unwrap_or_else(|e| panic!("{name}: {e}"));
    let again = serde_json::to_value(&read).unwrap();
    assert_eq!(lost(&verdict, &again, ""), Vec::<String>::new(), "{name}");
    assert_eq!(broken(validator, &again), Vec::<String>::new(), "{name}, written again");
}

/// Places at which a value has something that another one does not.
fn lost(from: &Value, to: &Value, at: &str) -> Vec<String> {
    match (from, to) {
        (Value::Object(from), Value::Object(to)) => from
            .iter()
            .flat_map(|(key, value)| {
                let at = format!("{at}/{key}");
                to.get(key).map_or_else(|| vec![at.clone()], |to| lost(value, to, &at))
            })
            .collect(),
        (Value::Array(from), Value::Array(to)) if from.len() == to.len() => {
            from.iter().zip(to).enumerate().flat_map(|(i, (a, b))| lost(a, b, &format!("{at}/{i}"))).collect()
        }
        (Value::Number(a), Value::Number(b)) if a.as_f64() == b.as_f64() => Vec::new(),
        (from, to) if from == to => Vec::new(),
        (from, to) => vec![format!("{at}: {from} became {to}")],
    }
}

#[test]
fn the_schema_in_docs_is_what_the_types_say() {
    let there = read(file("docs/verdict.schema.json"));
    assert!(there == schema().unwrap(), "docs/verdict.schema.json is out of date: `cargo run --example verdict_schema` writes it again");
}

#[test]
fn verdicts_of_earlier_versions_are_valid_and_read_without_loss() {
    let validator = validator();
    let files: Vec<PathBuf> = std::fs::read_dir(file("tests/verdicts")).unwrap().map(|f| f.unwrap().path()).collect();
    assert!(files.len() >= 6);
    for path in files {
        assert_valid(&validator, &read(&path), &path.display().to_string());
    }
}

#[test]
fn what_is_no_verdict_is_not_valid() {
    let validator = validator();
    let right: Value = serde_json::from_str(&read(file("tests/verdicts/missing.json"))).unwrap();
    let wrong = |change: &dyn Fn(&mut Value)| {
        let mut verdict = right.clone();
        change(&mut verdict);
        (broken(&validator, &verdict).len(), serde_json::from_value::<Verdict>(verdict).is_err())
    };
    assert_eq!(wrong(&|_| ()), (0, false));
    let changes: [&dyn Fn(&mut Value); 4] = [
        &|v| v["verdict"] = json!("stable"),
        &|v| v["findings"][0]["confidence"] = json!("high"),
        &|v| v["held_out"]["nrmse_after"] = json!([1.0]),
        &|v| v["findings"][0]["between"] = json!(["motor"]),
    ];
    for (i, change) in changes.into_iter().enumerate() {
        let (errors, unread) = wrong(change);
        assert!(errors > 0 && unread, "change {i}: {errors} {unread}");
    }
}

/// An excitation that was planned is as valid as the reason why there is none.
#[test]
fn a_planned_experiment_is_valid() {
    let mut verdict: Value = serde_json::from_str(&read(file("tests/verdicts/ambiguous.json"))).unwrap();
    verdict["next_experiment"] = json!({
        "file": "next-experiment.toml", "input": "force", "excitation": "sine:amplitude=1,frequency=2,cycles=4", "sentence": "Play it.",
        "between": ["damper@disc-ground", "damper@flywheel-ground"], "separation_sd": 7.31, "level_floors": null, "output": "position",
        "repeats": 2, "duration_s": 2.0, "rate_hz": 1000.0,
    });
    assert_valid(&validator(), &verdict.to_string(), "with an experiment");
}

#[test]
fn a_verdict_that_is_written_now_is_valid() {
    let place = Place::new();
    let truth = file("plant/models/impulse-engine.toml");
    let drives = [
        ("sweep.csv", "sweep:amplitude=3,from=1,to=60,duration=2"),
        ("triangle.csv", "triangle:amplitude=3,period=0.5,cycles=3"),
        ("noise.csv", "multisine:rms=1,from=1,to=60,period=2,periods=1,seed=1"),
    ];
    for (name, drive) in drives {
        let done = place.backdrive(&["simulate", &truth, drive, "--rate", "1000", "--out", name]);
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    let nominal = file("plant/models/impulse-engine-linear.toml");
    let set = format!("model = {nominal:?}\nfit = [\"sweep.csv\", \"triangle.csv\"]\nheld_out = [\"noise.csv\"]\n");
    place.write("set.toml", &set);
    let done = place.backdrive(&["diagnose", ".", "--out", "out", "--patience", "4", "--no-report", "--json"]);
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    assert_valid(&validator(), &read(place.path("out/verdict.json")), "verdict.json");
    let mut verdict = done.json();
    // Commands to paste hang on the folder they were asked from, and are no part of the file.
    let next = verdict.as_object_mut().and_then(|verdict| verdict.remove("next")).unwrap_or_default();
    assert!(next.as_array().is_some_and(|next| next.iter().all(|step| step["do"].is_string() && step["commands"].is_array())), "{next:#}");
    assert_eq!(verdict, serde_json::from_str::<Value>(&read(place.path("out/verdict.json"))).unwrap());
    // What the command line once added afterwards is in it.
    assert!(verdict["audit"].as_array().is_some_and(|audit| !audit.is_empty()), "{verdict:#}");
}

/// The agreed formats' own example, where that file is at hand: beside this project, or named by BACKDRIVE_FORMATS.
#[test]
fn the_example_of_the_formats_is_valid() {
    let beside = || PathBuf::from(file("../shared/formats.md"));
    let path = std::env::var_os("BACKDRIVE_FORMATS").map_or_else(beside, PathBuf::from);
    let Ok(text) = std::fs::read_to_string(&path) else {
        return skipped::skipped(format!("{} is not there; BACKDRIVE_FORMATS names it", path.display()));
    };
    let example = text.split_once("## Verdict").and_then(|(_, after)| after.split_once("```json")).and_then(|(_, t)| t.split_once("```"));
    let (example, _) = example.unwrap_or_else(|| panic!("{}: has no example of a verdict", path.display()));
    assert_valid(&validator(), example, "the formats' example");
}
