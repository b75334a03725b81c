//! Writing and reading the same messages with this crate and with Python's `mcap`, one after the other in one run.
//!
//! `BACKDRIVE_PYTHON=target/venv/bin/python cargo bench -p backdrive-bags --bench beside_python` (tests/run makes target/venv).
//!
//! 500 000 samples of one axis on five topics, CDR `sensor_msgs/msg/JointState`. Ours: from the first push to the end of `finish`, encoding included, and
//! every message read and decoded. Python: the payloads are ready when writing begins (lz4, chunks of 1 MiB), and reading is without decoding, then with
//! it. Each runs three times, alternately; the median is reported.

use backdrive_bags::{BagHeader, Reader, Recorder, RecorderOptions, TopicInfo, WhenFull, info};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use std::path::Path;
use std::time::Instant;

const MESSAGES: u64 = 500_000;
const TOPICS: u64 = 5;
const ROUNDS: usize = 3;

type Failed = Box<dyn std::error::Error>;

fn main() -> Result<(), Failed> {
    let dir = tempfile::tempdir()?;
    let (ours, copy) = (dir.path().join("ours.mcap"), dir.path().join("python.mcap"));
    let python = std::env::var_os("BACKDRIVE_PYTHON");
    let mut found: Vec<(&str, Vec<f64>)> = Vec::new();
    let mut note = |what: &'static str, seconds: f64| match found.iter_mut().find(|(name, _)| *name == what) {
        Some((_, all)) => all.push(seconds),
        None => found.push((what, vec![seconds])),
    };
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        write(&ours, 100_000)?;
        note("ours: record", begin.elapsed().as_secs_f64());
        let begin = Instant::now();
        let (reader, mut read) = (Reader::open(&ours)?, 0);
        for entry in reader.messages()? {
            read += u64::from(entry?.message(&ours)?.is_some());
        }
        assert_eq!(read, MESSAGES);
        note("ours: read and decode", begin.elapsed().as_secs_f64());
        let Some(python) = &python else { continue };
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/time_mcap.py");
        let output = std::process::Command::new(python).arg(script).arg(&ours).arg(&copy).output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        for (line, what) in text.lines().zip(["mcap for Python: write", "mcap for Python: read", "mcap for Python: read and decode"]) {
            note(what, line.parse()?);
        }
    }
    println!("{:34}{:>14}", "", "messages/s");
    for (what, mut seconds) in found {
        seconds.sort_by(f64::total_cmp);
        println!("{what:34}{:>14.0}", MESSAGES as f64 / seconds[seconds.len() / 2]);
    }
    println!("{:34}{:>14}", "ours, bytes", std::fs::metadata(&ours)?.len());
    if python.is_some() {
        println!("{:34}{:>14}", "Python's, bytes", std::fs::metadata(&copy)?.len());
    }
    // A gigabyte, looked at.
    let large = dir.path().join("large.mcap");
    write_until(&large, 1_000_000_000)?;
    let mut seconds: Vec<f64> = (0..5)
        .map(|_| {
            let begin = Instant::now();
            info(&large).map(|_| begin.elapsed().as_secs_f64())
        })
        .collect::<Result<_, _>>()?;
    seconds.sort_by(f64::total_cmp);
    println!("info of {} bytes: {:.2} ms", std::fs::metadata(&large)?.len(), 1e3 * seconds[2]);
    Ok(())
}

fn header() -> BagHeader {
    let info = |index| TopicInfo {
        topic: Topic { name: format!("/topic{index}"), kind: Kind::Sample },
        axes: vec!["forward".to_owned()],
        publisher: "bench".to_owned(),
    };
    BagHeader { rate_hz: 10_000.0, topics: (0..TOPICS).map(info).collect(), ..BagHeader::default() }
}

/// A sample that no two of are alike.
fn sample(step: u64) -> Message {
    let mut sample = Sample::new(1);
    (sample.step, sample.sequence, sample.stamp_ns) = (step, step, step as i64 * 100_000);
    let phase = step as f64 * 1e-3;
    (sample.position[0], sample.velocity[0], sample.effort[0]) = (phase.sin(), phase.cos(), (2.0 * phase).sin());
    Message::Sample(sample)
}

fn write(path: &Path, steps: u64) -> Result<(), Failed> {
    let options = RecorderOptions { when_full: WhenFull::Wait, overwrite: true, ..RecorderOptions::default() };
    let mut recorder = Recorder::create(path, &header(), &options)?;
    for step in 0..steps {
        for topic in 0..TOPICS as usize {
            recorder.push(topic, sample(step), 0)?;
        }
    }
    recorder.finish()?;
    Ok(())
}

fn write_until(path: &Path, bytes: u64) -> Result<(), Failed> {
    let options = RecorderOptions { when_full: WhenFull::Wait, ..RecorderOptions::default() };
    let mut recorder = Recorder::create(path, &header(), &options)?;
    let mut step = 0;
    while recorder.health().bytes < bytes {
        for _ in 0..10_000 {
            for topic in 0..TOPICS as usize {
                recorder.push(topic, sample(step), 0)?;
            }
            step += 1;
        }
    }
    recorder.finish()?;
    Ok(())
}
