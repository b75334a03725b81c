//! Twelve recordings of a real SO-101 arm: its unsigned current is found in each, and nothing else is wrong with them. Skipped where they are not.

use backdrive_inspect::{FindingKind, Options, Report, Source, inspect};
use std::path::PathBuf;

fn report(path: PathBuf) -> Report {
    inspect(&[Source::Path(path)], &Options::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn the_unsigned_current_is_found_in_all_recordings_and_nothing_else() {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("BACKDRIVE_DATA").map_or(beside, PathBuf::from).join("so101");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("skipped: {} is not here", folder.display());
        return;
    };
    let mut count = 0;
    for path in entries.flatten().map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "csv")) {
        let name = path.display().to_string();
        let report = report(path);
        let wrong: Vec<_> = report.wrong().collect();
        assert!(!wrong.is_empty(), "{name}: no unsigned current");
        for finding in &wrong {
            let is_current = finding.signals.iter().all(|signal| signal.ends_with(".current"));
            assert!(finding.kind == FindingKind::Rectified && is_current, "{name}: {}", finding.message);
        }
        count += 1;
    }
    assert_eq!(count, 12);
    // What the servos of the steps show: late by 60 to 110 ms, bent by the arm's weight, with a dead band.
    let steps = report(folder.join("step_response.csv"));
    let pan = steps.responses.iter().find(|response| response.joint == "shoulder_pan").unwrap();
    let lag = pan.lag_ms.unwrap();
    assert!(lag.low > 60.0 && lag.high < 130.0, "{lag:?}");
    let lift = steps.responses.iter().find(|response| response.joint == "shoulder_lift").unwrap();
    assert!(lift.droop.unwrap()[0] > 0.01 && lift.dead_band.unwrap().low > 0.005, "{lift:?}");
}
