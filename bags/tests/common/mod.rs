//! A small run to record: two sample topics, gains, events and status.
#![allow(dead_code)] // each test uses what it needs

use backdrive_bags::{BagHeader, Clock, Reader, TopicInfo};
use backdrive_msgs::text::Text;
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Event, Gains, LAYOUT, Message, NOT_MEASURED, Sample, Status, source_id};
use std::collections::BTreeMap;
use std::path::Path;

/// SplitMix64: the same draws on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

pub const MEASURED: usize = 0;
pub const FORCE: usize = 1;
pub const GAINS: usize = 2;
pub const EVENTS: usize = 3;
pub const STATUS: usize = 4;

pub fn header() -> BagHeader {
    let info = |name: &str, kind, axes: &[&str], publisher: &str| TopicInfo {
        topic: Topic { name: name.to_owned(), kind },
        axes: axes.iter().map(|axis| (*axis).to_owned()).collect(),
        publisher: publisher.to_owned(),
    };
    BagHeader {
        title: "a master pressed against a wall".to_owned(),
        graph_toml: "name = \"press\"\nrate_hz = 1000.0\n".to_owned(),
        files: vec![
            ("master.toml".to_owned(), "name = \"impulse-engine\"\n".to_owned()),
            ("wall.toml".to_owned(), "name = \"wall\"\n".to_owned()),
        ],
        versions: BTreeMap::from([("backdrive".to_owned(), "0.1.0".to_owned())]),
        seeds: BTreeMap::from([("noise".to_owned(), 7)]),
        clock: Clock::Lockstep,
        rate_hz: 1000.0,
        host: "bench".to_owned(),
        topics: vec![
            info("/master/measured_js", Kind::Sample, &["forward", "side"], "master"),
            info("/master/servo_jf", Kind::Sample, &["forward", "side"], "scaling"),
            info("/scaling/gains", Kind::Gains, &[], "scaling"),
            info("/master/events", Kind::Event, &[], "master"),
            info("/master/status", Kind::Status, &[], "master"),
        ],
        ..BagHeader::default()
    }
}

pub fn stamp_ns(step: u64) -> i64 {
    step as i64 * 1_000_000
}

pub fn measured(step: u64) -> Message {
    let mut sample = Sample::new(2);
    (sample.step, sample.sequence, sample.stamp_ns, sample.source) = (step, step, stamp_ns(step), source_id("master"));
    let t = step as f64 * 1e-3;
    sample.position[..2].copy_from_slice(&[0.01 * (7.0 * t).sin(), 0.02 * (5.0 * t).cos()]);
    sample.velocity[..2].copy_from_slice(&[0.07 * (7.0 * t).cos(), NOT_MEASURED]);
    Message::Sample(sample)
}

pub fn force(step: u64) -> Message {
    let mut sample = Sample::new(2);
    (sample.step, sample.sequence, sample.stamp_ns, sample.source) = (step, step, stamp_ns(step), source_id("scaling"));
    sample.effort[..2].copy_from_slice(&[-(step as f64).sqrt(), if step.is_multiple_of(3) { NOT_MEASURED } else { -0.0 }]);
    Message::Sample(sample)
}

pub fn gains(step: u64, sequence: u64, mu: f64) -> Message {
    let (layout, source, stamp_ns) = (LAYOUT, source_id("scaling"), stamp_ns(step));
    Message::Gains(Gains { layout, source, step, sequence, stamp_ns, mu, lambda: 0.5, ramp_s: 0.1 })
}

pub fn event(step: u64, sequence: u64) -> Message {
    let (layout, source, stamp_ns) = (LAYOUT, source_id("master"), stamp_ns(step));
    let (kind, text) = (Text::new("contact"), Text::new("the handle touched the wall"));
    Message::Event(Event { layout, source, step, sequence, stamp_ns, severity: 0, reserved: 0, value: NOT_MEASURED, kind, text })
}

pub fn status(step: u64, sequence: u64) -> Message {
    let (layout, source, stamp_ns) = (LAYOUT, source_id("master"), stamp_ns(step));
    let (missed_deadlines, lost, loop_p50_s, loop_p99_s) = (0, 0, 0.0, 0.0);
    Message::Status(Status { layout, source, step, sequence, stamp_ns, steps: step, missed_deadlines, lost, loop_p50_s, loop_p99_s })
}

/// Everything that is sent in a run, in the order (step, topic).
pub fn run(steps: u64) -> Vec<(usize, Message)> {
    let mut sent = Vec::new();
    for step in 0..steps {
        sent.push((MEASURED, measured(step)));
        sent.push((FORCE, force(step)));
        if step.is_multiple_of(500) {
            sent.push((GAINS, gains(step, step / 500, 1.0 + step as f64 * 1e-4)));
        }
        if step % 70 == 3 {
            sent.push((EVENTS, event(step, 2 * (step / 70))));
            sent.push((EVENTS, event(step, 2 * (step / 70) + 1)));
        }
        if step.is_multiple_of(100) {
            sent.push((STATUS, status(step, step / 100)));
        }
    }
    sent
}

/// Topic and bits of a message: equal text is an equal message.
pub fn text(topic: usize, message: &Message) -> String {
    format!("{topic} {message:?}")
}

/// Every message of a bag of ours.
pub fn read(path: &Path) -> Vec<(usize, Message)> {
    let reader = Reader::open(path).expect("the bag opens");
    let messages = reader.messages().expect("it can be read");
    messages
        .map(|entry| {
            let entry = entry.expect("it is whole");
            (entry.topic.index, entry.message(path).expect("it decodes").expect("it is ours"))
        })
        .collect()
}

pub fn texts(messages: &[(usize, Message)]) -> Vec<String> {
    messages.iter().map(|(topic, message)| text(*topic, message)).collect()
}

/// A bag of a run of this number of steps.
pub fn record(path: &Path, steps: u64) {
    use backdrive_bags::{Recorder, RecorderOptions};
    let options = RecorderOptions { overwrite: true, chunk_bytes: 64 << 10, ..RecorderOptions::lockstep() };
    let mut recorder = Recorder::create(path, &header(), &options).expect("it starts");
    for (topic, message) in run(steps) {
        recorder.push(topic, message, 0).expect("it writes");
    }
    assert!(recorder.finish().expect("it finishes").is_complete());
}
