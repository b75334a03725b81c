//! What of a bag is not its messages.

mod common;

use backdrive_bags::{Reader, Recorder, RecorderOptions, check, info, recover};
use std::path::Path;

/// Bytes of a file by type of record, with what stands before the body.
fn by_type(path: &Path) -> [u64; 256] {
    let (bytes, mut at, mut found) = (std::fs::read(path).expect("it reads"), 8, [0; 256]);
    while at + 9 <= bytes.len() {
        let len = 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes"));
        found[usize::from(bytes[at])] += len;
        at += len as usize;
    }
    found
}

const CHUNK: usize = 6;
const MESSAGE_INDEX: usize = 7;
const CHUNK_INDEX: usize = 8;
const OUR_INDEX: usize = 0x80;

/// Share of all indices in a bag and its chunks.
fn index_share(path: &Path) -> f64 {
    let found = by_type(path);
    let index = found[MESSAGE_INDEX] + found[CHUNK_INDEX] + found[OUR_INDEX];
    index as f64 / (index + found[CHUNK]) as f64
}

#[test]
fn indices_are_at_most_a_tenth_of_a_bag() {
    let dir = tempfile::tempdir().expect("a directory");
    let (lockstep, realtime, copy) = (dir.path().join("lockstep.mcap"), dir.path().join("realtime.mcap"), dir.path().join("copy.mcap"));
    common::record(&lockstep, 20_000);
    // Times of arrival as a machine makes them: late by up to a quarter of a millisecond, each by something else.
    let mut random = common::Random(5);
    let mut recorder = Recorder::create(
        &realtime,
        &common::header(),
        &RecorderOptions { when_full: backdrive_bags::WhenFull::Wait, ..RecorderOptions::default() },
    )
    .expect("it starts");
    for (count, (topic, message)) in common::run(20_000).into_iter().enumerate() {
        let late = random.below(250_000) as i64;
        recorder.push(topic, message, 1_700_000_000_000_000_000 + count as i64 * 200_000 + late).expect("it writes");
    }
    recorder.finish().expect("it finishes");
    for path in [&lockstep, &realtime] {
        let (share, bytes) = (index_share(path), std::fs::metadata(path).expect("it is there").len());
        println!("{}: {share:.4} of {bytes} bytes", path.display());
        assert!(share > 0.0 && share <= 0.1, "{}: {share}", path.display());
        assert_eq!(by_type(path)[MESSAGE_INDEX], 0);
        // With MCAP's own, as a copy has them, it would be more: so the share above is no matter of large messages.
        let _ = std::fs::remove_file(&copy);
        recover(path, &copy, false).expect("it is copied");
        let theirs = index_share(&copy);
        assert!(theirs > 0.15 && by_type(&copy)[OUR_INDEX] == 0, "{theirs}");
        assert_eq!(common::texts(&common::read(&copy)), common::texts(&common::read(path)));
        assert_eq!(info(&copy).expect("it is summed up").topics, info(path).expect("it is summed up").topics);
    }
}

#[test]
fn what_stands_at_the_end_says_the_same_as_all_messages() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    common::record(&path, 3_000);
    let (short, whole) = (info(&path).expect("it is summed up"), check(&path).expect("it is read"));
    assert!(!short.read_whole && whole.read_whole);
    assert_eq!(backdrive_bags::BagInfo { read_whole: true, ..short }, whole);
    assert!(Reader::open(&path).expect("it opens").damage().is_empty());
    // Where the end is missing all is read, and that is reported.
    let bytes = std::fs::read(&path).expect("it reads");
    std::fs::write(&path, &bytes[..bytes.len() - 20]).expect("it writes");
    let cut = info(&path).expect("it is summed up");
    assert!(cut.read_whole && !cut.ended_cleanly && cut.messages == whole.messages);
    assert!(cut.to_string().contains("has no summary at its end, so all of it was read"), "{cut}");
}
