//! The command: its output and exit code where the input is wrong or the recordings are not here.

#[path = "../../tests/common/naming.rs"]
mod naming;

use naming::assert_names;
use std::path::Path;
use std::process::{Command, Output};

fn study(arguments: &[&str], out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_study")).env_remove("BACKDRIVE_DATA").args(arguments).arg("--out").arg(out).output().unwrap()
}

/// Exit code and everything that was printed.
fn told(arguments: &[&str]) -> (i32, String) {
    let out = tempfile::tempdir().unwrap();
    let output = study(arguments, out.path());
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    (output.status.code().unwrap(), text)
}

#[test]
fn every_study_is_listed() {
    let (code, text) = told(&["--list"]);
    assert_eq!(code, 0, "{text}");
    assert!(backdrive_studies::STUDIES.iter().all(|s| text.contains(s.name) && text.contains(s.about)), "{text}");
}

#[test]
fn a_name_that_is_wrong_is_told_before_anything_runs() {
    let (code, text) = told(&["silverbox", "silverbx", "--data", "/nowhere"]);
    assert_eq!(code, 3, "{text}");
    assert!(text.contains("there is no study \"silverbx\"") && text.contains("kuka_kr300") && !text.contains("skipped"), "{text}");
}

#[test]
fn without_names_it_is_usage() {
    assert_eq!(told(&[]).0, 2);
    assert_eq!(told(&["emps", "--all"]).0, 2);
}

#[test]
fn absent_recordings_are_skipped_with_where_they_are() {
    let outside: Vec<&str> = backdrive_studies::STUDIES.iter().filter(|s| !s.needs.1.is_empty()).map(|s| s.name).collect();
    let (code, text) = told(&[&outside[..], &["--data", "/nowhere"]].concat());
    assert_eq!(code, 7, "{text}");
    assert_eq!(text.matches("skipped ").count(), outside.len(), "{text}");
    assert_names(&text, &["studies/emps/README.md"]);
}

#[test]
fn a_broken_recording_is_told_with_its_line_and_the_next_study_has_its_turn() {
    let data = tempfile::tempdir().unwrap();
    let folder = data.path().join("silverbox");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("snls80mv.csv"), "time_s,u_V,y_V\n0,0.1,0.2\n1,zero,0.2\n").unwrap();
    let (code, text) = told(&["silverbox", "emps", "--data", data.path().to_str().unwrap()]);
    assert_eq!(code, 3, "{text}");
    assert_names(&text, &["snls80mv.csv", "row 3", "zero", "emps"]);
}

#[test]
fn recordings_that_are_too_short_are_told() {
    let data = tempfile::tempdir().unwrap();
    let emps = data.path().join("emps");
    std::fs::create_dir(&emps).unwrap();
    for name in ["emps_train.csv", "emps_test_pulses.csv"] {
        std::fs::write(emps.join(name), "time_s,u_V,q_m,qref_m\n0,0,0,0\n0.001,0,0,0\n").unwrap();
    }
    let silverbox = data.path().join("silverbox");
    std::fs::create_dir(&silverbox).unwrap();
    std::fs::write(silverbox.join("snls80mv.csv"), "time_s,u_V,y_V\n0,0,0\n0.001,0,0\n").unwrap();
    for name in ["emps", "silverbox"] {
        let (code, text) = told(&[name, "--data", data.path().to_str().unwrap()]);
        assert_eq!(code, 3, "{text}");
        assert!(text.contains("rows"), "{text}");
    }
}

#[test]
fn a_folder_of_results_that_cannot_be_made_is_told() {
    let data = tempfile::tempdir().unwrap();
    let folder = data.path().join("silverbox");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("snls80mv.csv"), "time_s,u_V,y_V\n0,0,0\n").unwrap();
    let file = data.path().join("file");
    std::fs::write(&file, "").unwrap();
    let output = study(&["silverbox", "--data", data.path().to_str().unwrap()], &file);
    assert_eq!(output.status.code(), Some(5));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot be made"));
}
