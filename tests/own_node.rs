//! A program of the user's own instead of a node: examples/own_master.rs, started by launch/own-master.toml.

#[path = "common/naming.rs"]
mod naming;

use backdrive_bags::{Reader, Signal, signals};
use naming::assert_names;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

const BACKDRIVE: &str = env!("CARGO_BIN_EXE_backdrive");
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The example's program, built once: a test that is run alone does not make cargo build the examples.
fn own_master() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let beside = Path::new(BACKDRIVE).parent().unwrap();
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--quiet", "--workspace", "--example", "own_master"]).args(beside.ends_with("release").then_some("--release"));
        build.env("CARGO_TARGET_DIR", beside.parent().unwrap()).current_dir(ROOT);
        assert!(build.status().unwrap().success());
        beside.join("examples/own_master")
    })
}

/// The graph with the paths that it has in the repository, and this program as its master.
fn graph_with(program: &str, folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(Path::new(ROOT).join("launch/own-master.toml")).unwrap();
    let asked = "../target/release/examples/own_master";
    assert!(text.contains(asked));
    let text = text.replace(asked, program).replace("\"../plant", &format!("\"{ROOT}/plant"));
    let graph = folder.join("own-master.toml");
    std::fs::write(&graph, text).unwrap();
    graph
}

fn backdrive(words: &[&str], folder: &Path) -> Output {
    Command::new(BACKDRIVE).args(words).current_dir(folder).output().unwrap()
}

#[test]
fn a_program_of_ones_own_runs_in_the_loop() {
    let folder = tempfile::tempdir().unwrap();
    let graph = graph_with(&own_master().display().to_string(), folder.path());
    let output = backdrive(&["run", graph.to_str().unwrap(), "--json", "--bag", "own.mcap"], folder.path());
    let result: serde_json::Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
    assert_eq!(output.status.code(), Some(0), "{result}");
    assert_eq!((result["steps"].as_u64(), result["lost"].as_u64(), result["outcome"].as_str()), (Some(10_000), Some(0), Some("stable")));

    let reader = Reader::open(&folder.path().join("own.mcap")).unwrap();
    assert!(reader.ended_cleanly() && reader.completeness().unwrap().is_complete());
    let published = |node: &str| reader.header().unwrap().topics.iter().filter(|t| t.publisher == node).count();
    // Its own state, events and status, as one of our nodes would report them.
    assert_eq!(published("master"), 4);
    let wanted = [
        Signal::new("position", "/master/measured_js", "position[0]"),
        Signal::new("applied", "/master/measured_js", "effort[0]"),
        Signal::new("asked", "/master/servo_jf", "effort[0]"),
        Signal::new("wall", "/slave/measured_js", "effort[0]"),
    ];
    let found = signals(&reader, &wanted).unwrap();
    let [position, applied, asked, wall] = found.columns.as_slice() else { panic!("{:?}", found.names) };
    assert_eq!(position.len(), 10_000);
    // It is moved by the hand, pushed back by the wall, and applies what it was asked for in the same step.
    assert!(position.iter().any(|x| *x > 5e-3));
    assert!(wall.iter().any(|f| *f < -1.0));
    assert!(applied.iter().zip(asked).all(|(a, b)| *a == if b.is_nan() { 0.0 } else { *b }));
    assert!(position.iter().all(|x| (x / 2e-6 - (x / 2e-6).round()).abs() < 1e-6));
}

#[test]
fn a_program_that_is_not_there_is_named_beside_the_graph() {
    let folder = tempfile::tempdir().unwrap();
    let graph = graph_with("programs/absent", folder.path());
    let output = backdrive(&["run", graph.to_str().unwrap(), "--bag", "own.mcap"], Path::new("/"));
    assert_eq!(output.status.code(), Some(3));
    let told = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(told.contains(&folder.path().join("programs/absent").display().to_string()), "{told}");
}

#[test]
fn without_a_model_its_axes_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let graph = graph_with("own_master", folder.path());
    let check = |text: &str| {
        std::fs::write(&graph, text).unwrap();
        backdrive(&["check", graph.to_str().unwrap()], folder.path())
    };
    let text = std::fs::read_to_string(&graph).unwrap();
    assert_eq!(check(&text).status.code(), Some(0));
    let unnamed: String = text.lines().filter(|line| !line.starts_with("axes")).map(|line| format!("{line}\n")).collect();
    let output = check(&unnamed);
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("needs a model, or axes"), "{output:?}");
}

#[test]
fn started_by_hand_it_says_what_it_is() {
    let output = Command::new(own_master()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_names(String::from_utf8_lossy(&output.stderr), &["`command`"]);
}
