//! What is recorded is read back, in order, and what is missing is counted.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_bags::{BagError, Clock, Reader, Recorder, RecorderOptions, WhenFull};
use backdrive_msgs::{Message, Sample};
use common::{FORCE, MEASURED, Random};
use naming::assert_names;
use std::io::{self, Seek, SeekFrom, Write};
use std::time::{Duration, Instant};

#[test]
fn a_run_is_read_back_bit_for_bit() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    let sent = common::run(2_000);
    let mut recorder = Recorder::create(&path, &common::header(), &RecorderOptions::default()).expect("it starts");
    for (topic, message) in &sent {
        recorder.push(*topic, *message, 0).expect("it writes");
    }
    let completeness = recorder.finish().expect("it finishes");
    assert!(completeness.is_complete());
    assert_eq!(completeness.written(), sent.len() as u64);
    assert_eq!((completeness.topics[MEASURED].first_step, completeness.topics[MEASURED].last_step), (Some(0), Some(1_999)));
    let reader = Reader::open(&path).expect("it opens");
    assert_eq!(reader.header(), Some(&common::header()));
    assert_eq!(reader.completeness(), Some(&completeness));
    assert!(reader.ended_cleanly());
    assert_eq!(reader.profile(), "ros2");
    assert_eq!(reader.counts().iter().sum::<u64>(), sent.len() as u64);
    assert_eq!(common::texts(&common::read(&path)), common::texts(&sent));
}

#[test]
fn log_time_is_the_stamp_in_lockstep_and_the_arrival_in_realtime() {
    let dir = tempfile::tempdir().expect("a directory");
    for (clock, expected) in [(Clock::Lockstep, 5_000_000), (Clock::Realtime, 77)] {
        let path = dir.path().join(format!("{clock:?}.mcap"));
        let mut header = common::header();
        header.clock = clock;
        let mut recorder = Recorder::create(&path, &header, &RecorderOptions::default()).expect("it starts");
        recorder.push(MEASURED, common::measured(5), 77).expect("it writes");
        assert_eq!(recorder.finish().expect("it finishes").lost(), 5);
        let entry = Reader::open(&path).expect("it opens").messages().expect("it reads").next().expect("a message").expect("whole");
        assert_eq!((entry.log_time_ns, entry.publish_time_ns, entry.sequence), (expected, 5_000_000, 5));
    }
}

/// Whatever the order of arrival between topics (within one it is the order of sending), the bag is the same.
#[test]
fn an_ordered_bag_does_not_depend_on_the_order_of_arrival() {
    let dir = tempfile::tempdir().expect("a directory");
    let sent = common::run(3_000);
    for seed in 0..6 {
        let mut random = Random(seed);
        let path = dir.path().join(format!("{seed}.mcap"));
        let mut recorder = Recorder::create(&path, &common::header(), &RecorderOptions::lockstep()).expect("it starts");
        // Passes over the topics, in each of which a topic delivers what has been sent up to some moment, as a poll loop sees it.
        let (mut next, mut moment) = ([0; 5], 0);
        while moment < sent.len() {
            for topic in 0..5 {
                moment = (moment + random.below(40)).min(sent.len());
                for (of, message) in &sent[next[topic]..moment] {
                    if *of == topic {
                        recorder.push(topic, *message, 0).expect("it writes");
                    }
                }
                next[topic] = moment;
            }
            recorder.checkpoint();
        }
        for topic in 0..5 {
            for (of, message) in &sent[next[topic]..] {
                if *of == topic {
                    recorder.push(topic, *message, 0).expect("it writes");
                }
            }
        }
        let completeness = recorder.finish().expect("it finishes");
        assert_eq!((completeness.lost(), completeness.late), (0, 0), "seed {seed}");
        assert_eq!(common::texts(&common::read(&path)), common::texts(&sent), "seed {seed}");
    }
}

#[test]
fn an_ordered_bag_without_checkpoints_is_in_order_too() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    let sent = common::run(500);
    let mut recorder = Recorder::create(&path, &common::header(), &RecorderOptions::lockstep()).expect("it starts");
    for topic in [4, 1, 3, 0, 2] {
        for (_, message) in sent.iter().filter(|(of, _)| *of == topic) {
            recorder.push(topic, *message, 0).expect("it writes");
        }
    }
    assert_eq!(recorder.finish().expect("it finishes").late, 0);
    assert_eq!(common::texts(&common::read(&path)), common::texts(&sent));
}

#[test]
fn gaps_are_counted_per_topic_and_stored() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    let mut recorder = Recorder::create(&path, &common::header(), &RecorderOptions::default()).expect("it starts");
    for step in (0..100).filter(|step| !(20..25).contains(step)) {
        recorder.push(MEASURED, common::measured(step), 0).expect("it writes");
    }
    for step in [0, 1, 1, 2, 4, 3] {
        recorder.push(FORCE, common::force(step), 0).expect("it writes");
    }
    assert_eq!(recorder.health().lost, 5);
    let completeness = recorder.finish().expect("it finishes");
    assert!(!completeness.is_complete());
    let (measured, force) = (&completeness.topics[MEASURED], &completeness.topics[FORCE]);
    assert_eq!((measured.written, measured.lost), (95, 5));
    assert_eq!((force.written, force.lost, force.repeated, force.backward), (6, 0, 1, 1));
    assert_eq!(Reader::open(&path).expect("it opens").completeness(), Some(&completeness));
}

/// A disk with room for this number of bytes, slow on request.
struct Disk {
    bytes: io::Cursor<Vec<u8>>,
    room: u64,
    slow: Duration,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        std::thread::sleep(self.slow);
        if self.bytes.position() + bytes.len() as u64 > self.room {
            return Err(io::Error::from(io::ErrorKind::StorageFull));
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

#[test]
fn what_the_queue_refuses_is_a_counted_loss_and_push_does_not_wait() {
    let disk = Disk { bytes: io::Cursor::default(), room: u64::MAX, slow: Duration::from_millis(30) };
    let options = RecorderOptions { queue: 16, chunk_bytes: 1024, ..RecorderOptions::default() };
    let mut recorder = Recorder::with_sink(disk, "slow disk", &common::header(), &options).expect("it starts");
    for step in 0..5_000 {
        recorder.push(MEASURED, common::measured(step), 0).expect("a full queue is no error");
    }
    let counted = recorder.health();
    let completeness = recorder.finish().expect("it finishes");
    let measured = &completeness.topics[MEASURED];
    assert!(measured.lost > 0, "had push waited for the disk, nothing would be lost");
    assert_eq!(counted.lost, measured.lost);
    assert_eq!(measured.written + measured.lost, 5_000);
}

#[test]
fn a_lockstep_recorder_makes_the_run_wait_instead_of_losing() {
    let disk = Disk { bytes: io::Cursor::default(), room: u64::MAX, slow: Duration::from_millis(1) };
    let options = RecorderOptions { queue: 16, chunk_bytes: 1024, when_full: WhenFull::Wait, ..RecorderOptions::lockstep() };
    let mut recorder = Recorder::with_sink(disk, "slow disk", &common::header(), &options).expect("it starts");
    let sent = common::run(2_000);
    for (topic, message) in &sent {
        recorder.push(*topic, *message, 0).expect("it writes");
    }
    let completeness = recorder.finish().expect("it finishes");
    assert_eq!((completeness.written(), completeness.lost()), (sent.len() as u64, 0));
}

#[test]
fn a_full_disk_stops_the_recording_and_says_so() {
    for room in [0, 100, 3_000, 20_000, 60_000] {
        let disk = Disk { bytes: io::Cursor::default(), room, slow: Duration::ZERO };
        let options = RecorderOptions { chunk_bytes: 4096, ..RecorderOptions::default() };
        let mut recorder = match Recorder::with_sink(disk, "/full/run.mcap", &common::header(), &options) {
            Ok(recorder) => recorder,
            Err(BagError::Write { what, .. }) => {
                assert!(what.contains("no storage space"), "{what}");
                continue;
            }
            Err(other) => panic!("{other}"),
        };
        let (mut refused, begin) = (None, Instant::now());
        let mut step = 0;
        while refused.is_none() && begin.elapsed() < Duration::from_secs(20) {
            refused = recorder.push(MEASURED, common::measured(step), 0).err();
            step += 1;
        }
        let refused = refused.expect("the error reaches the caller").to_string();
        assert_names(&refused, &["/full/run.mcap"]);
        assert!(recorder.health().error.is_some_and(|error| error.contains("no storage space")));
        assert!(matches!(recorder.finish(), Err(BagError::Write { .. })));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_that_is_full_is_an_error_too() {
    let device = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    match Recorder::with_sink(device, "/dev/full", &common::header(), &RecorderOptions::default()) {
        Err(BagError::Write { what, .. }) => assert!(what.contains("No space left"), "{what}"),
        other => panic!("expected an error, got {:?}", other.map(|recorder| recorder.health())),
    }
}

#[test]
fn a_bag_is_not_overwritten_unless_asked_for() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    std::fs::write(&path, "precious").expect("it writes");
    assert!(matches!(Recorder::create(&path, &common::header(), &RecorderOptions::default()), Err(BagError::Exists { .. })));
    assert_eq!(std::fs::read(&path).expect("it reads"), b"precious");
    let overwrite = RecorderOptions { overwrite: true, ..Default::default() };
    let refused = Recorder::create(&path, &common::header(), &overwrite);
    assert!(matches!(refused, Err(BagError::Exists { is_bag: false, .. })), "what is no bag is never replaced");
    common::record(&dir.path().join("bag.mcap"), 10);
    let recorder = Recorder::create(&dir.path().join("bag.mcap"), &common::header(), &overwrite).expect("a bag is");
    let second = Recorder::create(&dir.path().join("bag.mcap"), &common::header(), &overwrite);
    assert!(matches!(second, Err(BagError::InUse { .. })), "but not while it is being written");
    assert!(recorder.finish().is_ok());
}

#[test]
fn a_topic_that_the_header_does_not_list_is_an_error() {
    let disk = Disk { bytes: io::Cursor::default(), room: u64::MAX, slow: Duration::ZERO };
    let mut recorder = Recorder::with_sink(disk, "memory", &common::header(), &RecorderOptions::default()).expect("it starts");
    let error = recorder.push(99, Message::Sample(Sample::new(1)), 0).expect_err("there is no such topic");
    assert!(matches!(error, BagError::NoSuchIndex { index: 99, count: 5 }));
}

#[test]
fn a_recorder_that_is_dropped_closes_its_bag() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    let mut recorder = Recorder::create(&path, &common::header(), &RecorderOptions::lockstep()).expect("it starts");
    recorder.push(MEASURED, common::measured(0), 0).expect("it writes");
    drop(recorder);
    let reader = Reader::open(&path).expect("it opens");
    assert!(reader.ended_cleanly() && reader.completeness().is_some());
    assert_eq!(common::read(&path).len(), 1);
}
