//! How many messages per second go through the recorder, and through reading, recovery and comparison.
//!
//! `cargo bench -p backdrive-bags` prints messages per second and the size of the bag, for 10⁶ messages of two axes
//! on five topics. The recorder's figure is from the first push to the end of `finish`, with the caller waiting for the queue.

use backdrive_bags::{BagHeader, DiffOptions, Reader, Recorder, RecorderOptions, TopicInfo, WhenFull, diff, recover};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use std::time::Instant;

const MESSAGES: u64 = 1_000_000;
const TOPICS: u64 = 5;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let dir = tempfile::tempdir()?;
    let info = |index| TopicInfo {
        topic: Topic { name: format!("/topic{index}"), kind: Kind::Sample },
        axes: vec!["forward".to_owned(), "side".to_owned()],
        publisher: "bench".to_owned(),
    };
    let header = BagHeader { rate_hz: 10_000.0, topics: (0..TOPICS).map(info).collect(), ..BagHeader::default() };
    let samples: Vec<Message> = (0..MESSAGES / TOPICS)
        .map(|step| {
            let mut sample = Sample::new(2);
            (sample.step, sample.sequence, sample.stamp_ns) = (step, step, step as i64 * 100_000);
            for axis in 0..2 {
                let phase = step as f64 * 1e-3 + axis as f64;
                (sample.position[axis], sample.velocity[axis], sample.effort[axis]) = (phase.sin(), phase.cos(), (2.0 * phase).sin());
            }
            Message::Sample(sample)
        })
        .collect();
    let report = |what: &str, begin: Instant| println!("{what:24} {:>12.0} messages/s", MESSAGES as f64 / begin.elapsed().as_secs_f64());
    for (what, ordered) in [("record", false), ("record in order", true)] {
        let path = dir.path().join(format!("{what}.mcap"));
        let options = RecorderOptions { ordered, when_full: WhenFull::Wait, ..RecorderOptions::default() };
        let (mut recorder, begin, mut pushing) = (Recorder::create(&path, &header, &options)?, Instant::now(), 0.0);
        for (step, message) in samples.iter().enumerate() {
            let before = Instant::now();
            for topic in 0..TOPICS as usize {
                recorder.push(topic, *message, 0)?;
            }
            pushing += before.elapsed().as_secs_f64();
            if step % 100 == 0 {
                recorder.checkpoint();
            }
        }
        recorder.finish()?;
        report(what, begin);
        println!("{:24} {:>12.0} ns per push, {} bytes", "", pushing / MESSAGES as f64 * 1e9, std::fs::metadata(&path)?.len());
    }
    let (path, other, saved) = (dir.path().join("record.mcap"), dir.path().join("record in order.mcap"), dir.path().join("saved.mcap"));
    let begin = Instant::now();
    let reader = Reader::open(&path)?;
    let mut read = 0_u64;
    for entry in reader.messages()? {
        read += u64::from(entry?.message(&path)?.is_some());
    }
    assert_eq!(read, MESSAGES);
    report("read and decode", begin);
    let begin = Instant::now();
    assert!(diff(&reader, &Reader::open(&other)?, &DiffOptions::default())?.same);
    report("compare two bags", begin);
    let bytes = std::fs::read(&path)?;
    std::fs::write(&path, &bytes[..bytes.len() - 100])?;
    let begin = Instant::now();
    assert_eq!(recover(&path, &saved, false)?.messages, MESSAGES);
    report("recover", begin);
    Ok(())
}
