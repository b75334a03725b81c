//! Bags in which the frame id of a sample holds what a `JointState` has no field for are read unchanged.

mod common;

use backdrive_bags::{Reader, Signal, recover, signals};
use backdrive_msgs::{Message, Sample, ros};
use std::collections::BTreeMap;
use std::path::Path;

/// A sample as bags had it: little-endian CDR, everything in the frame id, an empty array for a quantity that no axis has.
fn payload(sample: &Sample, axes: &[String]) -> Vec<u8> {
    let mut cdr: Vec<u8> = Vec::new();
    let align = |cdr: &mut Vec<u8>, to: usize| cdr.resize(cdr.len().next_multiple_of(to), 0);
    let text = |cdr: &mut Vec<u8>, text: &str| {
        align(cdr, 4);
        cdr.extend((text.len() as u32 + 1).to_le_bytes());
        cdr.extend(text.as_bytes());
        cdr.push(0);
    };
    cdr.extend(((sample.stamp_ns / 1_000_000_000) as i32).to_le_bytes());
    cdr.extend(((sample.stamp_ns % 1_000_000_000) as u32).to_le_bytes());
    let Sample { step, sequence, source, flags, layout, .. } = sample;
    text(&mut cdr, &format!("step={step} seq={sequence} src={source:08x} axes={} flags={flags} layout={layout}", sample.len()));
    align(&mut cdr, 4);
    cdr.extend((axes.len() as u32).to_le_bytes());
    axes.iter().for_each(|name| text(&mut cdr, name));
    for values in [&sample.position, &sample.velocity, &sample.effort].map(|values| &values[..sample.len()]) {
        let values = if values.iter().all(|value| value.is_nan()) { &[] } else { values };
        align(&mut cdr, 4);
        cdr.extend((values.len() as u32).to_le_bytes());
        for value in values {
            align(&mut cdr, 8);
            cdr.extend(value.to_le_bytes());
        }
    }
    [vec![0, 1, 0, 0], cdr].concat()
}

fn write(path: &Path, steps: u64) {
    let file = std::fs::File::create(path).unwrap();
    let mut out = mcap::WriteOptions::new().profile("ros2").create(file).unwrap();
    let header = common::header();
    let ids: Vec<u16> = header
        .topics
        .iter()
        .map(|info| {
            let (name, text) = ros::schema(info.topic.kind);
            let schema = out.add_schema(name, "ros2msg", text.as_bytes()).unwrap();
            out.add_channel(schema, &info.topic.name, "cdr", &BTreeMap::new()).unwrap()
        })
        .collect();
    let mut bytes = Vec::new();
    for (topic, message) in common::run(steps) {
        match &message {
            Message::Sample(sample) => bytes = payload(sample, &header.topics[topic].axes),
            other => ros::encode(other, &[], &mut bytes).unwrap(),
        }
        let (sequence, at) = (message.sequence() as u32, message.stamp_ns() as u64);
        let head = mcap::records::MessageHeader { channel_id: ids[topic], sequence, log_time: at, publish_time: at };
        out.write_to_known_channel(&head, &bytes).unwrap();
    }
    out.finish().unwrap();
}

#[test]
fn an_older_bag_reads_as_it_did() {
    let dir = tempfile::tempdir().unwrap();
    let (path, saved) = (dir.path().join("older.mcap"), dir.path().join("saved.mcap"));
    write(&path, 700);
    let sent = common::texts(&common::run(700));
    assert_eq!(common::texts(&common::read(&path)), sent);
    // Aligned by step, which is only in the frame id.
    let wanted = [Signal::new("x", "/master/measured_js", "position[0]"), Signal::new("f", "/master/servo_jf", "effort[0]")];
    let table = signals(&Reader::open(&path).unwrap(), &wanted).unwrap();
    assert!(table.alignment.by_step && table.steps.as_ref().is_some_and(|steps| steps.iter().copied().eq(0..700)));
    recover(&path, &saved, false).unwrap();
    assert_eq!(common::texts(&common::read(&saved)), sent, "and so does its copy");
}
