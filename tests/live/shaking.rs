//! A loop that shakes is found, its cause is named and its gain lowered while it runs; one that does not shake is left alone.

use super::told;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// Events of a run that is watched, and the force scales in force.
fn watched(words: &[&str]) -> (Vec<(String, String)>, Vec<f64>) {
    let temp = tempfile::tempdir().unwrap();
    let bag: PathBuf = temp.path().join("run.mcap");
    let mut command = Command::new(env!("CARGO_BIN_EXE_backdrive"));
    command.current_dir(FOLDER).arg("run").args(words).args(["--clock", "realtime", "--bag"]).arg(&bag).env("TMPDIR", temp.path());
    let done = command.stdin(Stdio::null()).output().unwrap();
    assert!(bag.exists(), "{}", String::from_utf8_lossy(&done.stderr));
    told(&bag)
}

fn kinds<'a>(events: &'a [(String, String)], kind: &str) -> Vec<&'a str> {
    events.iter().filter(|(k, _)| k == kind).map(|(_, text)| text.as_str()).collect()
}

#[test]
fn a_gain_that_is_too_high_is_named_and_lowered_and_a_calm_loop_is_left_alone() {
    let shaking = ["launch/contact.toml", "--rate", "1000", "--lambda", "4", "--canceller", "none", "--duration", "8", "--heal"];
    let (events, lambda) = watched(&shaking);
    assert_eq!(kinds(&events, "live_onset").len(), 1, "{events:?}");
    assert!(kinds(&events, "live_why").iter().any(|text| text.contains("gain") || text.contains("rate")), "{events:?}");
    assert!(kinds(&events, "live_heal").iter().any(|text| text.contains("it helped")), "{events:?}");
    assert!(lambda.last().is_some_and(|l| *l < 1.5), "{lambda:?}");

    let (events, lambda) = watched(&["launch/contact.toml", "--rate", "1000", "--lambda", "0.5", "--heal"]);
    assert!(events.iter().all(|(kind, _)| !kind.starts_with("live_")), "{events:?}");
    assert_eq!(lambda, [0.5]);
    // Bounds that are set beforehand hold.
    let bounded = ["launch/contact.toml", "--rate", "1000", "--lambda", "4", "--canceller", "none", "--heal=3.5"];
    let (events, lambda) = watched(&bounded);
    assert!(kinds(&events, "live_onset").len() == 1 && kinds(&events, "live_heal").is_empty(), "{events:?}");
    assert_eq!(lambda, [4.0]);
}
