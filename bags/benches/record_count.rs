//! A fixed amount of recording in one thread of its own, for counting instructions: what encoding, indexing, compressing and writing cost.
//!
//! `cargo build --profile bench -p backdrive-bags --bench record_count`, then twice `valgrind --tool=callgrind target/release/deps/record_count-HASH STEPS`, of
//! 2000 and of 22000 steps: the difference over 100 000 is instructions a message, without start and end. Writing goes to memory, so that no disk is counted.

use backdrive_bags::{BagHeader, Recorder, RecorderOptions, TopicInfo, WhenFull};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use std::io::Cursor;

const TOPICS: u64 = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // What cargo adds to the arguments of a bench is no number.
    let steps: u64 = std::env::args().skip(1).find_map(|argument| argument.parse().ok()).unwrap_or(20_000);
    let info = |index| TopicInfo {
        topic: Topic { name: format!("/topic{index}"), kind: Kind::Sample },
        axes: vec!["forward".to_owned()],
        publisher: "bench".to_owned(),
    };
    let header = BagHeader { rate_hz: 10_000.0, topics: (0..TOPICS).map(info).collect(), ..BagHeader::default() };
    // Chunks end by size alone, so that their number does not depend on the clock.
    let options = RecorderOptions { when_full: WhenFull::Wait, flush: std::time::Duration::from_secs(3600), ..RecorderOptions::default() };
    let mut recorder = Recorder::with_sink(Cursor::new(Vec::new()), "memory", &header, &options)?;
    for step in 0..steps {
        let mut sample = Sample::new(1);
        (sample.step, sample.sequence, sample.stamp_ns) = (step, step, step as i64 * 100_000);
        let phase = step as f64 * 1e-3;
        (sample.position[0], sample.velocity[0], sample.effort[0]) = (phase.sin(), phase.cos(), (2.0 * phase).sin());
        for topic in 0..TOPICS as usize {
            recorder.push(topic, Message::Sample(sample), step as i64 * 100_000)?;
        }
    }
    let verdict = recorder.finish()?;
    assert_eq!((verdict.written(), verdict.lost()), (steps * TOPICS, 0));
    println!("{} messages", verdict.written());
    Ok(())
}
