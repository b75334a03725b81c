//! lerobot opens datasets of ours, and merges them with others. It needs a Python that has lerobot (several GB with PyTorch), named by `BACKDRIVE_LEROBOT_PYTHON`.

use backdrive_bags::{Contract, ImportOptions, Reader, export_lerobot, import_csv};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

/// What lerobot finds in a dataset of two episodes, of 60 and 80 rows at 50 Hz. Each joint has a position of 0.01 rad times the row, an effort of 0.5 N m in
/// the first and 1.5 N m in the second, and a target of twice the position with the opposite sign.
fn told(python: &OsStr, joints: &[&str]) -> Value {
    let folder = tempfile::tempdir().expect("a directory");
    let bags = [0, 1].map(|episode| {
        let headings: String = joints.iter().map(|joint| format!(",{joint}.position,{joint}.effort,{joint}.command")).collect();
        let cells = |k: usize| format!(",{:?},{:?},{:?}", 0.01 * k as f64, 0.5 + episode as f64, -0.02 * k as f64).repeat(joints.len());
        let rows: String = (0..60 + 20 * episode).map(|k| format!("{:?}{}\n", k as f64 * 0.02, cells(k))).collect();
        let (table, bag) = (folder.path().join(format!("{episode}.csv")), folder.path().join(format!("{episode}.mcap")));
        std::fs::write(&table, format!("t{headings}\n{rows}")).expect("it writes");
        import_csv(&table, &bag, &ImportOptions::default()).expect("it is imported");
        Reader::open(&bag).expect("it opens")
    });
    let out = folder.path().join("dataset");
    std::fs::create_dir(&out).expect("a directory");
    export_lerobot(&bags, &out, &Contract::default(), "wave").expect("it is exported");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/lerobot_opens.py");
    let done = Command::new(python).arg(script).arg(&out).output().expect("the Python of BACKDRIVE_LEROBOT_PYTHON starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).expect("the script prints JSON")
}

#[test]
fn lerobot_itself_opens_datasets_of_ours() {
    let Some(python) = std::env::var_os("BACKDRIVE_LEROBOT_PYTHON") else {
        eprintln!("skipped: name a Python that has lerobot by BACKDRIVE_LEROBOT_PYTHON (pip install lerobot)");
        return;
    };
    // Of one joint lerobot has numbers, of more it has lists.
    for joints in [&["elbow"][..], &["elbow", "wrist"]] {
        let told = told(&python, joints);
        assert_eq!(
            json!([told["episodes"], told["frames"], told["fps"], told["task"], told["twice"]]),
            json!([2, 140, 50, "wave", [4, 280]])
        );
        let check = |found: &Value, right: f64| {
            let numbers: Vec<f64> = if joints.len() == 1 && found.is_number() {
                found.as_f64().into_iter().collect()
            } else {
                found.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
            };
            assert!(
                numbers.len() == joints.len() && numbers.iter().all(|number| (number - right).abs() < 1e-4),
                "{found} for {right}: {told}"
            );
        };
        let rows = &told["rows"];
        check(&rows["observation.state"][1], (0.01f64 * 79.0).to_degrees());
        check(&rows["observation.effort"][0], 0.5);
        check(&rows["observation.effort"][1], 1.5);
        check(&rows["action"][1], (-0.02f64 * 79.0).to_degrees());
        check(&told["mean"]["observation.effort"], (60.0 * 0.5 + 80.0 * 1.5) / 140.0);
    }
}
