//! Everything that is whole in a bag that was cut off anywhere can be recovered.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_bags::{Reader, check, info, recover};
use common::Random;
use naming::assert_names;
use std::path::Path;

/// Ends of the top-level records of a file, and whether each is a chunk.
fn records(bytes: &[u8]) -> Vec<(usize, bool)> {
    let (mut at, mut found) = (8, Vec::new());
    while at + 9 <= bytes.len() {
        let len = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        let chunk = bytes[at] == 6;
        at += 9 + len;
        found.push((at, chunk));
    }
    found
}

fn cut_and_recover(dir: &Path, bytes: &[u8], at: usize, all: &[String]) -> usize {
    let (cut, saved) = (dir.join("cut.mcap"), dir.join("saved.mcap"));
    std::fs::write(&cut, &bytes[..at]).expect("it writes");
    let _ = std::fs::remove_file(&saved);
    let report = recover(&cut, &saved, false).expect("a cut file is recovered");
    let kept = common::texts(&common::read(&saved));
    assert_eq!(kept, all[..kept.len()], "cut at {at}: what is kept is the beginning, unchanged");
    assert_eq!(report.messages, kept.len() as u64);
    assert!(!report.was_clean && report.damaged.is_empty());
    let copy = Reader::open(&saved).expect("the copy opens");
    assert!(copy.ended_cleanly());
    if copy.header().is_some() {
        let verdict = copy.completeness().expect("the copy has a verdict");
        assert_eq!(verdict.written(), kept.len() as u64);
        assert_eq!(verdict.lost(), 0);
    }
    // Reading the cut file itself gives the same.
    assert_eq!(common::texts(&common::read(&cut)), kept, "cut at {at}");
    kept.len()
}

#[test]
fn a_bag_cut_anywhere_loses_only_the_chunk_that_was_open() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("run.mcap");
    common::record(&path, 1_500);
    let bytes = std::fs::read(&path).expect("it reads");
    let all = common::texts(&common::read(&path));
    let records = records(&bytes);
    let end_of_data = records.iter().rev().find(|record| record.1).expect("there are chunks").0;
    let mut random = Random(9);
    let mut places: Vec<usize> = (8..40).chain((0..120).map(|_| 8 + random.below(bytes.len() - 9))).collect();
    // The ends of the records, and a byte to each side.
    places.extend(records.iter().flat_map(|record| [record.0 - 1, record.0, record.0 + 1]).filter(|at| *at < bytes.len()));
    for at in places {
        let kept = cut_and_recover(dir.path(), &bytes, at, &all);
        if at >= end_of_data {
            assert_eq!(kept, all.len(), "cut at {at}, behind the last chunk");
        }
    }
    // At the end of each chunk, everything up to it is there.
    let mut least = 0;
    for (end, _) in records.iter().filter(|record| record.1) {
        let kept = cut_and_recover(dir.path(), &bytes, *end, &all);
        assert!(kept >= least);
        least = kept;
    }
    assert_eq!(least, all.len());
}

#[test]
fn graph_and_models_survive() {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, cut, saved) = (dir.path().join("run.mcap"), dir.path().join("cut.mcap"), dir.path().join("saved.mcap"));
    common::record(&path, 1_500);
    let bytes = std::fs::read(&path).expect("it reads");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("it writes");
    let report = recover(&cut, &saved, false).expect("it is recovered");
    assert_eq!(Reader::open(&saved).expect("it opens").header(), Some(&common::header()));
    assert!(report.completeness.is_some_and(|verdict| verdict.recovered && !verdict.is_complete()));
    assert!(report.last_step.is_some_and(|step| step > 100));
    let summary = info(&cut).expect("it is summed up");
    assert_eq!((summary.ended_cleanly, summary.complete, summary.lost, summary.damage), (false, Some(false), Some(0), None));
}

#[test]
fn a_clean_bag_is_copied_with_its_verdict() {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, saved) = (dir.path().join("run.mcap"), dir.path().join("saved.mcap"));
    common::record(&path, 300);
    let report = recover(&path, &saved, false).expect("it is copied");
    assert!(report.was_clean);
    assert_eq!(Reader::open(&saved).expect("it opens").completeness(), Reader::open(&path).expect("it opens").completeness());
    assert_eq!(common::texts(&common::read(&saved)), common::texts(&common::read(&path)));
    assert!(recover(&path, &saved, false).is_err(), "a file that exists is not overwritten");
}

#[test]
fn a_damaged_chunk_is_saved_as_far_as_it_can_be_read_and_told_with_its_place() {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, saved) = (dir.path().join("run.mcap"), dir.path().join("saved.mcap"));
    common::record(&path, 1_500);
    let mut bytes = std::fs::read(&path).expect("it reads");
    let records = records(&bytes);
    let chunks: Vec<usize> = (0..records.len()).filter(|index| records[*index].1).collect();
    let (from, to) = (records[chunks[1] - 1].0, records[chunks[1]].0);
    bytes[(from + to) / 2] ^= 0x55;
    std::fs::write(&path, &bytes).expect("it writes");
    let error = Reader::open(&path).expect("it opens").messages().expect("it reads").find_map(Result::err).expect("damage is an error");
    assert!(error.to_string().contains(&format!("byte {from}")), "{error}");
    assert!(check(&path).expect("it is read").damage.is_some());
    let report = recover(&path, &saved, false).expect("the rest is saved");
    assert_eq!(report.damaged.len(), 1);
    let whole = info(&path).is_ok().then(|| Reader::open(&path).expect("it opens").counts().iter().sum::<u64>());
    assert_eq!(report.expected, whole, "the statistics say how many there were");
    assert_eq!(report.messages + report.missing.values().sum::<u64>(), whole.expect("it is summed up"));
    assert!(report.is_lossy());
    assert!(report.damaged[0].contains(&format!("byte {from}")), "{:?}", report.damaged);
    let verdict = report.completeness.expect("it has a verdict");
    assert!(verdict.recovered && !verdict.is_complete());
    assert!(report.unconfirmed > 0, "what was saved of the chunk has no checksum, and that is counted");
    assert_eq!(verdict.lost(), report.missing.values().sum::<u64>(), "and so is the hole, if there is one");
}

#[test]
fn any_byte_may_be_wrong() {
    let dir = tempfile::tempdir().expect("a directory");
    let (path, bad, saved) = (dir.path().join("run.mcap"), dir.path().join("bad.mcap"), dir.path().join("saved.mcap"));
    common::record(&path, 200);
    let bytes = std::fs::read(&path).expect("it reads");
    let mut random = Random(11);
    for round in 0..1_500 {
        let mut damaged = bytes.clone();
        // The structure is at the beginning, at the end, and in the headers: aim there in two rounds of three.
        let at = match round % 3 {
            0 => random.below(bytes.len()),
            1 => random.below(2_000),
            _ => bytes.len() - 1 - random.below(2_500),
        };
        for byte in damaged.iter_mut().skip(at).take(1 + random.below(4)) {
            *byte = random.bits() as u8;
        }
        std::fs::write(&bad, &damaged).expect("it writes");
        let _ = std::fs::remove_file(&saved);
        // Errors are welcome, panics and endless loops are not.
        let _ = info(&bad);
        if recover(&bad, &saved, false).is_ok() {
            let copy = Reader::open(&saved).expect("the copy opens");
            assert!(copy.ended_cleanly() && copy.damage().is_empty(), "round {round}: {:?}", copy.damage());
            assert!(copy.messages().expect("it reads").all(|entry| entry.is_ok()), "round {round}");
        }
    }
}

#[test]
fn what_is_no_bag_is_told() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("x.mcap");
    for bytes in [&b""[..], b"t,x\n0,1\n", b"\x89MCAP"] {
        std::fs::write(&path, bytes).expect("it writes");
        let error = Reader::open(&path).expect_err("not a bag").to_string();
        assert!(error.contains("not an MCAP file"), "{error}");
    }
    assert_names(Reader::open(&dir.path().join("absent.mcap")).expect_err("it is not there").to_string(), &["absent.mcap"]);
}
