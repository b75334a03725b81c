//! Recordings of real devices as they were published: what is found in them is so. Skipped where they are not.

use backdrive_inspect::{FindingKind, Options, Source, inspect};
use std::path::PathBuf;

/// Folders with the findings that are true of a file: of the double pendulum the sign of a torque is turned round in its set, and five samples of another are lost frames.
const FOLDERS: &[(&str, &[(&str, FindingKind)])] = &[
    ("emps", &[]),
    ("tue_bilateral", &[]),
    ("brfd_friction_damper", &[]),
    ("piezo_p885", &[]),
    ("silverbox", &[]),
    ("odrive_cogging", &[]),
    ("kuka_kr300", &[]),
    ("dfki_double_pendulum", &[("055032.csv", FindingKind::WrongSign), ("061157.csv", FindingKind::Outliers)]),
];

/// A file that holds terms of a model, which are no recording.
const NO_RECORDING: &str = "traj_A_model_terms.csv";

#[test]
fn nothing_is_found_that_is_not_so() {
    let beside = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let data = std::env::var_os("BACKDRIVE_DATA").map_or(beside, PathBuf::from);
    for (folder, known) in FOLDERS {
        let Ok(entries) = std::fs::read_dir(data.join(folder)) else {
            println!("skipped: {folder} is not in {}", data.display());
            continue;
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            if !name.ends_with(".csv") || name == NO_RECORDING {
                continue;
            }
            let report = inspect(&[Source::Path(path)], &Options::default()).unwrap_or_else(|e| panic!("{e}"));
            for finding in report.wrong() {
                assert!(known.contains(&(name.as_str(), finding.kind)), "{folder}/{name}: {}", finding.message);
            }
        }
    }
}
