//! A recorder that is killed leaves everything behind but the last quarter second.
#![cfg(unix)]

mod common;

use backdrive_bags::{Reader, Recorder, RecorderOptions, info, recover};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const VICTIM: &str = "BACKDRIVE_TEST_VICTIM";

/// The process that the other test starts and kills: it records at 2000 messages per second and prints its progress.
#[test]
#[ignore = "only of use as the process that is killed"]
fn victim() {
    let Some(path) = std::env::var_os(VICTIM).map(PathBuf::from) else { return };
    let options = if path.ends_with("ordered.mcap") { RecorderOptions::lockstep() } else { RecorderOptions::default() };
    let mut recorder = Recorder::create(&path, &common::header(), &options).expect("it starts");
    let begin = Instant::now();
    for step in 0.. {
        recorder.push(common::MEASURED, common::measured(step), 0).expect("it writes");
        recorder.push(common::FORCE, common::force(step), 0).expect("it writes");
        println!("pushed {step}");
        std::thread::sleep((begin + Duration::from_millis(step + 1)).saturating_duration_since(Instant::now()));
    }
}

#[test]
fn a_killed_recorder_loses_at_most_a_quarter_second() {
    let dir = tempfile::tempdir().expect("a directory");
    for name in ["plain.mcap", "ordered.mcap"] {
        // A machine that stalls for a moment is not the recorder's doing: one of three attempts must do.
        let kept_enough = (0..3).any(|attempt| {
            let folder = dir.path().join(attempt.to_string());
            std::fs::create_dir_all(&folder).expect("a folder");
            kill_one(&folder, name)
        });
        assert!(kept_enough, "{name}: more than a quarter second is lost");
    }
}

/// Whether everything that was older than a quarter second survived.
fn kill_one(dir: &Path, name: &str) -> bool {
    let path = dir.join(name);
    let this = std::env::current_exe().expect("this program");
    let mut child = Command::new(this)
        .args(["--exact", "victim", "--ignored", "--nocapture"])
        .env(VICTIM, &path)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    let lines = BufReader::new(child.stdout.take().expect("its output")).lines();
    let mut pushed = Vec::new();
    for line in lines.map_while(Result::ok) {
        if let Some(step) = line.strip_prefix("pushed ").and_then(|step| step.parse::<u64>().ok()) {
            pushed.push((Instant::now(), step));
            if step == 1_000 {
                break;
            }
        }
    }
    child.kill().expect("it is killed");
    let killed = Instant::now();
    child.wait().expect("it is dead");
    let old_enough = pushed.iter().filter(|(when, _)| killed - *when > Duration::from_millis(250)).map(|(_, step)| *step + 1).max();
    let summary = info(&path).expect("it is summed up");
    assert!(!summary.ended_cleanly && summary.damage.is_none() && summary.lost == Some(0), "{summary}");
    let saved = dir.join(format!("saved-{name}"));
    let report = recover(&path, &saved, false).expect("it is recovered");
    println!("{name}: {} of {} messages", report.messages, 2 * pushed.len());
    let copy = Reader::open(&saved).expect("it opens");
    assert!(copy.ended_cleanly());
    assert_eq!(copy.header(), Some(&common::header()));
    report.messages >= 2 * old_enough.expect("a second has passed")
}
