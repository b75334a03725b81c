//! The tutorial and the how-to, done as they say: every block of commands in order, with the program on the path.

mod system;

use std::path::Path;
use std::process::Command;
use system::{Place, file};

/// The blocks that a reader is to type.
fn blocks(path: &str) -> Vec<String> {
    let text = std::fs::read_to_string(file(path)).unwrap();
    text.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap_or_default().to_string()).collect()
}

/// Runs a document's blocks in a folder that looks like the project's. What each said, and how it ended.
fn follow(place: &Place, path: &str) -> Vec<(String, i32, String)> {
    for folder in ["launch", "plant"] {
        std::os::unix::fs::symlink(file(folder), place.path(folder)).unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_backdrive")).parent().unwrap().display().to_string();
    let search = format!("{program}:{}", std::env::var("PATH").unwrap_or_default());
    let one = |block: String| {
        let mut shell = Command::new("bash");
        shell.arg("-c").arg(&block).current_dir(place.path("")).env("PATH", &search).env("TMPDIR", place.path("tmp"));
        let output = shell.output().unwrap();
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        println!("{block}{said}");
        (block, output.status.code().unwrap_or(-1), said)
    };
    blocks(path).into_iter().map(one).collect()
}

#[test]
fn the_tutorial_can_be_followed() {
    let place = Place::new();
    let done = follow(&place, "docs/tutorial.md");
    let of = |start: &str| done.iter().find(|d| d.0.contains(start)).unwrap_or_else(|| panic!("{start}"));
    for (block, code, said) in &done {
        // 1 is a negative answer, 7 none.
        assert!([0, 1, 7].contains(code), "{block}\n{said}");
    }
    assert!(of("before.mcap").2.contains("limit cycle"));
    let verdict: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("out/diagnosis/verdict.json")).unwrap()).unwrap();
    assert!(["missing", "unexplained", "ambiguous"].contains(&verdict["verdict"].as_str().unwrap()), "{verdict}");
    let error = |key: &str| verdict["held_out"][key].as_f64().unwrap();
    assert!(error("nrmse_after") < 0.5 * error("nrmse_refit"), "{}", verdict["held_out"]);
    assert!(place.path("out/diagnosis/report.html").is_file() && place.path("out/stability.html").is_file());
    assert!(of("after.mcap").2.contains("loop     stable"), "{}", of("after.mcap").2);
}

#[test]
fn a_recording_of_ones_own_can_be_brought() {
    let place = Place::new();
    for (block, code, said) in follow(&place, "docs/own-recording.md") {
        assert!([0, 1, 7].contains(&code), "{block}\n{said}");
    }
    let verdict: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("out/mine-diagnosis/verdict.json")).unwrap()).unwrap();
    assert_eq!(verdict["unknown_inputs"][0]["input"], "normal.hand");
    assert_ne!(verdict["verdict"], "none");
}
