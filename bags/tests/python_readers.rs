//! A bag is read by readers that know nothing of ours: PyPI `mcap` with `mcap-ros2-support`, and `rosbags`.
//!
//! `BACKDRIVE_PYTHON` names a Python that has them (`pip install mcap mcap-ros2-support rosbags numpy`). Without it the test is
//! skipped, unless `BACKDRIVE_REQUIRE_PYTHON=1`.

mod common;
#[path = "../../tests/common/python.rs"]
mod python;

use backdrive_bags::{Reader, recover};
use python::python;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

/// What the Python must have.
const NEEDS: &str = "with mcap, mcap-ros2-support, rosbags and numpy";

fn read_with(python: &Path, bag: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/read_bag.py");
    let output = Command::new(python).arg(script).arg(bag).output().expect("the Python of BACKDRIVE_PYTHON starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("the script prints JSON")
}

fn compare(python: &Path, bag: &Path) {
    let seen = read_with(python, bag);
    let ours = Reader::open(bag).expect("it opens");
    for reader in ["mcap", "rosbags"] {
        let topics = seen[reader].as_object().expect("topics");
        assert_eq!(topics.len(), ours.topics().len() + 1, "{reader}: and which step samples are of");
        assert_eq!(topics["/backdrive/steps"]["type"], "backdrive_msgs/msg/Steps", "{reader}");
        for (topic, count) in ours.topics().iter().zip(ours.counts()) {
            assert_eq!(topics[&topic.name]["count"], *count, "{reader}, {}", topic.name);
            assert_eq!(topics[&topic.name]["type"], topic.type_name, "{reader}, {}", topic.name);
        }
    }
    assert_eq!(seen["mcap"], seen["rosbags"], "both see the same values");
}

#[test]
fn other_peoples_readers_decode_every_message() {
    let Some(python) = python(NEEDS) else { return };
    let dir = tempfile::tempdir().expect("a directory");
    let (path, cut, saved) = (dir.path().join("run.mcap"), dir.path().join("cut.mcap"), dir.path().join("saved.mcap"));
    common::record(&path, 1_501);
    compare(&python, &path);
    let seen = read_with(&python, &path);
    let force = &seen["mcap"]["/master/servo_jf"];
    assert_eq!(force["names"], json!(["forward", "side"]));
    assert_eq!(force["last_effort"], json!([-(1_500.0_f64).sqrt(), null]), "not measured is NaN");
    assert_eq!(force["last_stamp"], json!([1, 500_000_000]));
    assert_eq!((&force["frame_id"], &force["last_step"]), (&json!(""), &json!(1_500)));
    assert_eq!(seen["mcap"]["/master/events"]["last_text"], "the handle touched the wall");
    assert_eq!(seen["mcap"]["/scaling/gains"]["last_mu"], 1.15);
    let bytes = std::fs::read(&path).expect("it reads");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("it writes");
    recover(&cut, &saved, false).expect("it is recovered");
    compare(&python, &saved);
}
