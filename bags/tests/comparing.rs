//! Two bags are the same when their messages are.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_bags::{Clock, DiffOptions, Reader, Recorder, RecorderOptions, diff};
use backdrive_msgs::Message;
use naming::assert_names;
use std::collections::HashMap;
use std::path::Path;

fn record(path: &Path, clock: Clock, messages: impl IntoIterator<Item = (usize, Message)>) -> Reader {
    let mut header = common::header();
    header.clock = clock;
    let mut recorder = Recorder::create(path, &header, &RecorderOptions::default()).expect("it starts");
    for (receive_ns, (topic, message)) in messages.into_iter().enumerate() {
        recorder.push(topic, message, receive_ns as i64).expect("it writes");
    }
    recorder.finish().expect("it finishes");
    Reader::open(path).expect("it opens")
}

#[test]
fn the_same_run_is_the_same_bag_in_any_order() {
    let dir = tempfile::tempdir().expect("a directory");
    let a = record(&dir.path().join("a.mcap"), Clock::Lockstep, common::run(1_000));
    let mut sent = common::run(1_000);
    sent.sort_by_key(|(topic, _)| *topic);
    let b = record(&dir.path().join("b.mcap"), Clock::Lockstep, sent);
    let report = diff(&a, &b, &DiffOptions::default()).expect("they are compared");
    assert!(report.same && report.first.is_none(), "{report}");
    assert_eq!(report.topics.iter().map(|topic| topic.compared).sum::<u64>(), a.counts().iter().sum::<u64>());
    assert!(report.same, "{report}");
}

#[test]
fn one_bit_is_found() {
    let dir = tempfile::tempdir().expect("a directory");
    let a = record(&dir.path().join("a.mcap"), Clock::Lockstep, common::run(1_000));
    let nudged = common::run(1_000).into_iter().map(|(topic, mut message)| {
        if let Message::Sample(sample) = &mut message
            && topic == common::FORCE
            && sample.step >= 700
        {
            sample.effort[0] = f64::from_bits(sample.effort[0].to_bits() + 1);
        }
        (topic, message)
    });
    let b = record(&dir.path().join("b.mcap"), Clock::Lockstep, nudged);
    let report = diff(&a, &b, &DiffOptions::default()).expect("they are compared");
    let (topic, first) = report.first.clone().expect("they differ");
    assert_eq!((topic.as_str(), first.step, first.sequence, first.field.as_str()), ("/master/servo_jf", 700, 700, "effort[0]"));
    assert!(first.a != first.b);
    assert_eq!(report.topics[common::FORCE].differing, 300);
    assert!(report.topics[common::FORCE].largest > 0.0 && report.topics[common::FORCE].largest < 1e-10);
    assert!(!report.same, "{report}");
    assert_names(report.to_string(), &["700", "/master/servo_jf"]);
    let tolerances = HashMap::from([("/master/servo_jf".to_owned(), 1e-9)]);
    assert!(diff(&a, &b, &DiffOptions { tolerances, ..Default::default() }).expect("they are compared").same);
    let ignore = vec!["/master/servo_jf".to_owned()];
    let report = diff(&a, &b, &DiffOptions { ignore, ..Default::default() }).expect("they are compared");
    assert!(report.same && report.ignored == ["/master/servo_jf"]);
}

#[test]
fn missing_messages_and_topics_are_found() {
    let dir = tempfile::tempdir().expect("a directory");
    let a = record(&dir.path().join("a.mcap"), Clock::Lockstep, common::run(500));
    let without =
        common::run(500).into_iter().filter(|(topic, message)| *topic != common::EVENTS && (*topic != 0 || message.step() != 123));
    let mut b = record(&dir.path().join("b.mcap"), Clock::Lockstep, without);
    let report = diff(&a, &b, &DiffOptions::default()).expect("they are compared");
    assert_eq!((report.topics[0].only_in_a, report.topics[0].only_in_b, report.topics[0].differing), (1, 0, 0));
    assert_eq!(report.first.as_ref().map(|(topic, first)| (topic.as_str(), first.step)), Some(("/master/events", 3)));
    let mut header = common::header();
    header.topics.truncate(2);
    let path = dir.path().join("c.mcap");
    let mut recorder = Recorder::create(&path, &header, &RecorderOptions::default()).expect("it starts");
    for (topic, message) in common::run(500).into_iter().filter(|(topic, _)| *topic < 2) {
        recorder.push(topic, message, 0).expect("it writes");
    }
    recorder.finish().expect("it finishes");
    b = Reader::open(&path).expect("it opens");
    let report = diff(&a, &b, &DiffOptions::default()).expect("they are compared");
    assert_eq!(report.only_in_a, ["/scaling/gains", "/master/events", "/master/status"]);
    assert!(!report.same);
}

#[test]
fn stamps_of_realtime_bags_do_not_count() {
    let dir = tempfile::tempdir().expect("a directory");
    let later = |message: &mut Message| {
        if let Message::Sample(sample) = message {
            sample.stamp_ns += 1_000;
        }
    };
    for (clock, same) in [(Clock::Realtime, true), (Clock::Lockstep, false)] {
        let samples = |shift: bool| {
            (0..100).map(move |step| {
                let mut message = common::measured(step);
                if shift {
                    later(&mut message);
                }
                (common::MEASURED, message)
            })
        };
        let a = record(&dir.path().join(format!("a{clock:?}")), clock, samples(false));
        let b = record(&dir.path().join(format!("b{clock:?}")), clock, samples(true));
        assert_eq!(diff(&a, &b, &DiffOptions::default()).expect("they are compared").same, same, "{clock:?}");
    }
}
