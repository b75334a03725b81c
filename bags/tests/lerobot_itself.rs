//! lerobot opens a dataset of ours, and merges it with another. It needs a Python that has lerobot (several GB with PyTorch), named by `BACKDRIVE_LEROBOT_PYTHON`.

use backdrive_bags::{Contract, ImportOptions, Reader, export_lerobot, import_csv};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

#[test]
fn lerobot_itself_opens_a_dataset_of_ours() {
    let Some(python) = std::env::var_os("BACKDRIVE_LEROBOT_PYTHON") else {
        eprintln!("skipped: name a Python that has lerobot by BACKDRIVE_LEROBOT_PYTHON (pip install lerobot)");
        return;
    };
    let folder = tempfile::tempdir().expect("a directory");
    let bags = [0, 1].map(|episode| {
        let row = |k: usize| format!("{:?},{:?},{:?},{:?}\n", k as f64 * 0.02, 0.01 * k as f64, 0.5 + episode as f64, -0.02 * k as f64);
        let rows: String = (0..60 + 20 * episode).map(row).collect();
        let (table, bag) = (folder.path().join(format!("{episode}.csv")), folder.path().join(format!("{episode}.mcap")));
        std::fs::write(&table, format!("t,elbow.position,elbow.effort,elbow.command\n{rows}")).expect("it writes");
        import_csv(&table, &bag, &ImportOptions::default()).expect("it is imported");
        Reader::open(&bag).expect("it opens")
    });
    let out = folder.path().join("dataset");
    std::fs::create_dir(&out).expect("a directory");
    export_lerobot(&bags, &out, &Contract::default(), "wave").expect("it is exported");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/lerobot_opens.py");
    let done = Command::new(python).arg(script).arg(&out).output().expect("the Python of BACKDRIVE_LEROBOT_PYTHON starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let told: Value = serde_json::from_slice(&done.stdout).expect("the script prints JSON");
    assert_eq!(json!([told["episodes"], told["frames"], told["fps"], told["task"], told["twice"]]), json!([2, 140, 50, "wave", [4, 280]]));
    let near = |found: &Value, right: f64| found.as_f64().is_some_and(|found| (found - right).abs() < 1e-4);
    let rows = &told["rows"];
    assert!(
        near(&rows["observation.state"][1][0], (0.01f64 * 79.0).to_degrees()) && near(&rows["observation.effort"][1][0], 1.5),
        "{rows}"
    );
    assert!(near(&rows["action"][0][0], 0.0) && near(&rows["action"][1][0], (-0.02f64 * 79.0).to_degrees()), "{rows}");
    // Of an episode of 60 rows at 0.5 and one of 80 at 1.5.
    assert!(near(&told["mean"]["observation.effort"][0], (60.0 * 0.5 + 80.0 * 1.5) / 140.0), "{}", told["mean"]);
}
