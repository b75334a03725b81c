//! A fixed amount of recording in one thread of its own, for counting instructions: what encoding, indexing, compressing and writing cost.
//!
//! `cargo build --release -p backdrive-bags --benches`, then `valgrind --tool=callgrind target/release/deps/record_count-*`: instructions over
//! 100 000 messages. Writing goes to memory, so that no disk is counted. What waits for the queue differs from run to run: by under a percent.

use backdrive_bags::{BagHeader, Recorder, RecorderOptions, TopicInfo, WhenFull};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use std::io::Cursor;

const STEPS: u64 = 20_000;
const TOPICS: u64 = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let info = |index| TopicInfo {
        topic: Topic { name: format!("/topic{index}"), kind: Kind::Sample },
        axes: vec!["forward".to_owned()],
        publisher: "bench".to_owned(),
    };
    let header = BagHeader { rate_hz: 10_000.0, topics: (0..TOPICS).map(info).collect(), ..BagHeader::default() };
    // Chunks end by size alone, so that their number does not depend on the clock.
    let options = RecorderOptions { when_full: WhenFull::Wait, flush: std::time::Duration::from_secs(3600), ..RecorderOptions::default() };
    let mut recorder = Recorder::with_sink(Cursor::new(Vec::new()), "memory", &header, &options)?;
    for step in 0..STEPS {
        let mut sample = Sample::new(1);
        (sample.step, sample.sequence, sample.stamp_ns) = (step, step, step as i64 * 100_000);
        let phase = step as f64 * 1e-3;
        (sample.position[0], sample.velocity[0], sample.effort[0]) = (phase.sin(), phase.cos(), (2.0 * phase).sin());
        for topic in 0..TOPICS as usize {
            recorder.push(topic, Message::Sample(sample), step as i64 * 100_000)?;
        }
    }
    let verdict = recorder.finish()?;
    assert_eq!((verdict.written(), verdict.lost()), (STEPS * TOPICS, 0));
    println!("{} messages", verdict.written());
    Ok(())
}
