//! Messages are sent again when they were sent.

mod common;

use backdrive_bags::{BagError, Entry, PlayOptions, Reader, Sink, play};
use backdrive_msgs::Message;
use std::time::{Duration, Instant};

/// Notes when each message was due instead of waiting for it.
#[derive(Default)]
struct Notes {
    due: Duration,
    sent: Vec<(Duration, String, u64)>,
    most: Option<usize>,
}

impl Sink for Notes {
    fn send(&mut self, entry: &Entry, message: Option<&Message>) -> Result<(), BagError> {
        self.sent.push((self.due, entry.topic.name.clone(), message.map_or(0, Message::step)));
        Ok(())
    }

    fn wait(&mut self, _: Instant, due: Duration) -> bool {
        self.due = due;
        self.most.is_none_or(|most| self.sent.len() < most)
    }
}

fn bag() -> (tempfile::TempDir, Reader) {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    common::record(&path, 400);
    let reader = Reader::open(&path).expect("it opens");
    (dir, reader)
}

#[test]
fn every_message_is_due_at_its_time() {
    let (_dir, reader) = bag();
    for rate in [1.0, 4.0, 0.5] {
        let mut notes = Notes::default();
        let report = play(&reader, &PlayOptions { rate, ..Default::default() }, &mut notes).expect("it plays");
        assert!(report.finished);
        assert_eq!(report.sent, reader.counts().iter().sum::<u64>());
        for (due, _, step) in &notes.sent {
            assert!((due.as_secs_f64() - *step as f64 * 1e-3 / rate).abs() < 1e-9);
        }
    }
}

#[test]
fn a_part_can_be_played() {
    let (_dir, reader) = bag();
    let mut notes = Notes::default();
    let topics = vec!["/master/servo_jf".to_owned()];
    let options = PlayOptions { topics, from_s: 0.1, until_s: 0.2, rate: f64::INFINITY };
    assert_eq!(play(&reader, &options, &mut notes).expect("it plays").sent, 101);
    assert!(notes.sent.iter().all(|(due, topic, step)| due.is_zero() && topic == "/master/servo_jf" && (100..=200).contains(step)));
}

#[test]
fn it_can_be_stopped_and_refuses_nonsense() {
    let (_dir, reader) = bag();
    let mut notes = Notes { most: Some(10), ..Notes::default() };
    let report = play(&reader, &PlayOptions::default(), &mut notes).expect("it stops");
    assert_eq!((report.sent, report.finished), (10, false));
    for rate in [0.0, -1.0, f64::NAN] {
        assert!(play(&reader, &PlayOptions { rate, ..Default::default() }, &mut Notes::default()).is_err());
    }
    let topics = vec!["/nobody".to_owned()];
    assert!(play(&reader, &PlayOptions { topics, ..Default::default() }, &mut Notes::default()).is_err());
}

#[test]
fn the_clock_of_the_machine_is_followed() {
    struct Count(u64);
    impl Sink for Count {
        fn send(&mut self, _: &Entry, _: Option<&Message>) -> Result<(), BagError> {
            self.0 += 1;
            Ok(())
        }
    }
    let (_dir, reader) = bag();
    let (mut count, begin) = (Count(0), Instant::now());
    play(&reader, &PlayOptions { rate: 4.0, ..Default::default() }, &mut count).expect("it plays");
    assert!(begin.elapsed() >= Duration::from_micros(99_750), "399 ms at four times the speed");
    assert_eq!(count.0, reader.counts().iter().sum::<u64>());
}
