//! A node of one's own in Python or C++ by `backdrive step`: examples/own_master.py and own_master.cpp instead of examples/own_master.rs.

mod system;

use backdrive_bags::{Reader, Signal, signals};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use system::{Ended, Place, file};

/// The graph in Python with this command as its master.
fn graph(place: &Place, words: &[&str], rate: &str) -> String {
    let text = system::graph_text("launch/own-master-python.toml");
    let stated = "[\"backdrive\", \"step\", \"python3\", \"examples/own_master.py\"]";
    assert!(text.contains(stated), "{text}");
    let command = format!("{:?}", [&[env!("CARGO_BIN_EXE_backdrive"), "step"], words].concat());
    let text = text.replace(stated, &command).replace("rate_hz = 1000", &format!("rate_hz = {rate}"));
    place.write("graph.toml", &text).display().to_string()
}

fn run(place: &Place, graph: &str, bag: &str) -> Ended {
    place.backdrive(&["run", graph, "--json", "--bag", bag])
}

/// Position of the master and force of the wall.
fn columns(place: &Place, bag: &str) -> Vec<Vec<f64>> {
    let reader = Reader::open(&place.path(bag)).unwrap();
    assert!(reader.ended_cleanly() && reader.completeness().unwrap().is_complete());
    let wanted = [
        Signal::new("position", "/master/measured_js", "position[0]"),
        Signal::new("applied", "/master/measured_js", "effort[0]"),
        Signal::new("asked", "/master/servo_jf", "effort[0]"),
        Signal::new("wall", "/slave/measured_js", "effort[0]"),
    ];
    signals(&reader, &wanted).unwrap().columns
}

fn python() -> String {
    std::env::var("BACKDRIVE_PYTHON").unwrap_or_else(|_| "python3".to_string())
}

#[test]
fn a_master_in_python_keeps_up_in_lockstep_and_holds_the_loop() {
    let place = Place::new();
    let done = run(&place, &graph(&place, &[&python(), &file("examples/own_master.py")], "1000"), "python.mcap");
    assert_eq!(done.code, Some(0), "{done:?}");
    let result = done.json();
    assert_eq!((result["steps"].as_u64(), result["lost"].as_u64(), result["outcome"].as_str()), (Some(2000), Some(0), Some("stable")));
    let found = columns(&place, "python.mcap");
    let [position, applied, asked, wall] = found.as_slice() else { panic!("{}", found.len()) };
    assert_eq!(position.len(), 2000);
    assert!(position.iter().any(|x| *x > 5e-3) && wall.iter().any(|f| *f < -1.0));
    assert!(applied.iter().zip(asked).all(|(a, b)| *a == if b.is_nan() { 0.0 } else { *b }));
    assert!(position.iter().all(|x| (x / 2e-6 - (x / 2e-6).round()).abs() < 1e-6));
}

#[test]
fn the_same_master_in_cpp_does_the_same_to_the_bit() {
    let place = Place::new();
    let program = place.path("own_master");
    let mut build = Command::new("g++");
    build.args(["-O2", "-std=c++17", "-Wall", "-Werror", "-ffp-contract=off"]);
    let built = build.arg(file("examples/own_master.cpp")).arg("-o").arg(&program).status();
    match built {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return eprintln!("SKIPPED: g++ is not installed"),
        built => assert!(built.unwrap().success()),
    }
    let done = run(&place, &graph(&place, &[&program.display().to_string()], "1000"), "cpp.mcap");
    assert_eq!(done.code, Some(0), "{done:?}");
    let done = run(&place, &graph(&place, &[&python(), &file("examples/own_master.py")], "1000"), "python.mcap");
    assert_eq!(done.code, Some(0), "{done:?}");
    let bits = |bag: &str| columns(&place, bag).into_iter().flatten().map(f64::to_bits).collect::<Vec<_>>();
    assert!(bits("cpp.mcap") == bits("python.mcap"));
}

#[test]
fn a_program_that_ends_early_ends_the_run_and_is_named() {
    let place = Place::new();
    place.write("short.py", "import sys\nsys.stdin.buffer.readline()\nraise SystemExit('the encoder is not plugged in')\n");
    let done = run(&place, &graph(&place, &[&python(), "short.py"], "1000"), "short.mcap");
    assert_ne!(done.code, Some(0), "{done:?}");
    let told = format!("{}{}", done.stdout, done.stderr);
    assert!(told.contains("master") && told.contains("ended before the run did"), "{done:?}");
    // A program that is not there.
    let done = run(&place, &graph(&place, &["no-such-program"], "1000"), "none.mcap");
    let told = format!("{}{}", done.stdout, done.stderr);
    assert!(done.code != Some(0) && told.contains("no-such-program: cannot be started"), "{done:?}");
    // By hand it states what it is.
    let done = place.backdrive(&["step", "python3"]);
    done.ends(2, &["`command`"]);
}

#[test]
fn python_reads_a_topic_in_shared_memory() {
    let known = Command::new(python()).args(["-c", "import iceoryx2"]).output().unwrap();
    if !known.status.success() {
        return eprintln!("SKIPPED: the package iceoryx2 is not installed");
    }
    let place = Place::new();
    let mut run = place.command(env!("CARGO_BIN_EXE_backdrive"));
    let graph = file("launch/contact.toml");
    run.args(["run", &graph, "--clock", "realtime", "--rate", "500", "--duration", "6", "--bag", "watched.mcap"]);
    let mut run = run.stdout(Stdio::null()).spawn().unwrap();
    // The folder of the run stands below that of temporary files, and holds the middleware's once nodes join.
    let deadline = Instant::now() + Duration::from_secs(30);
    let folder = loop {
        let below = std::fs::read_dir(place.path("tmp")).into_iter().flatten().flatten().flat_map(|e| std::fs::read_dir(e.path()));
        let runs: Vec<_> = below.flatten().flatten().map(|e| e.path()).filter(|path| path.join("middleware/services").is_dir()).collect();
        if let [only] = runs.as_slice() {
            break only.clone();
        }
        assert!(Instant::now() < deadline, "no run began");
        std::thread::sleep(Duration::from_millis(100));
    };
    std::thread::sleep(Duration::from_secs(1));
    let watch =
        Command::new(python()).arg(file("examples/watch_topic.py")).arg(&folder).args(["/master/measured_js", "1"]).output().unwrap();
    run.wait().unwrap();
    let told = String::from_utf8_lossy(&watch.stdout).into_owned();
    let count: u32 = told.split(' ').next().and_then(|word| word.parse().ok()).unwrap_or_else(|| panic!("{watch:?}"));
    assert!(count > 50 && told.contains(" 0 lost"), "{watch:?}");
}

#[test]
fn the_example_is_short() {
    let text = std::fs::read_to_string(Path::new(&file("examples/own_master.py"))).unwrap();
    let code = text.split("\"\"\"").nth(2).unwrap().lines().filter(|line| !line.trim().is_empty()).count();
    assert!(code <= 20, "{code} lines");
}
