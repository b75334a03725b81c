//! Which kind of ROS bag a path is, and its import.

use super::target::{RosbagReport, Target};
use super::{ros1, sqlite};
use crate::BagError;
use crate::foreign_code::guarded;
use std::io::Read;
use std::path::{Path, PathBuf};

const ROS1: &[u8] = b"#ROSBAG V";
const SQLITE: &[u8] = b"SQLite format 3\0";

/// Whether a path is a ROS 1 bag, or a rosbag2: its folder, which may have lost its `metadata.yaml`, or a sqlite3 file of it.
pub fn is_rosbag(path: &Path) -> bool {
    path.join("metadata.yaml").is_file()
        || std::fs::read_dir(path).is_ok_and(|entries| entries.flatten().any(|entry| has_ending(&entry.path(), "db3")))
        || begins(path, ROS1)
        || begins(path, SQLITE)
        || has_ending(path, "db3")
        || has_ending(path, "bag")
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found == ending)
}

fn begins(path: &Path, with: &[u8]) -> bool {
    let mut start = Vec::new();
    // A pipe cannot be read twice.
    path.is_file()
        && backdrive_plant::input_file::open(path).is_ok_and(|file| file.take(with.len() as u64).read_to_end(&mut start).is_ok())
        && start == with
}

/// Copies the messages of a ROS bag into an MCAP file that any ROS 2 tool opens: those of rosbag2 verbatim, those of ROS 1 in the form of ROS 2. A topic whose
/// definition cannot be read is kept unchanged, and reported.
///
/// `most_bytes` is what one chunk of a ROS 1 bag may unpack to, see [`crate::MOST_BYTES`].
///
/// # Errors
/// It is neither, is damaged or compressed as a whole; the bag exists or cannot be written.
pub fn import_rosbag(from: &Path, bag: &Path, overwrite: bool, most_bytes: u64) -> Result<RosbagReport, BagError> {
    let wrong = |what: &str| BagError::File { path: from.to_owned(), what: what.to_owned() };
    let files = if from.is_dir() { files_of(from)? } else { vec![from.to_owned()] };
    let is_ros1 = begins(from, ROS1);
    for file in &files {
        std::fs::metadata(file).map_err(BagError::io(file))?;
        if !is_ros1 && !begins(file, SQLITE) {
            let what = match file.extension().and_then(|ending| ending.to_str()) {
                Some("bag") => "is not a ROS 1 bag: it does not start with #ROSBAG V2.0",
                _ => "is not a sqlite3 file: it does not start with \"SQLite format 3\"",
            };
            return Err(BagError::File { path: file.clone(), what: what.to_owned() });
        }
    }
    let mut target = Target::create(bag, overwrite)?;
    let done = match is_ros1 {
        true => guarded(|| ros1::copy(from, &mut target, most_bytes))
            .unwrap_or_else(|why| Err(wrong(&format!("cannot be read as a ROS 1 bag: {why}; it is damaged")))),
        false => files.iter().try_for_each(|file| sqlite::copy(file, &mut target)),
    };
    let report = done.and_then(|()| target.finish())?;
    if report.messages == 0 { Err(wrong("holds no messages")) } else { Ok(report) }
}

/// The sqlite3 files of a rosbag2's folder, in the order in which they were recorded.
fn files_of(folder: &Path) -> Result<Vec<PathBuf>, BagError> {
    let wrong = |what: String| BagError::File { path: folder.to_owned(), what };
    let entries = std::fs::read_dir(folder).map_err(BagError::io(folder))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let mut files: Vec<PathBuf> = paths.iter().filter(|path| has_ending(path, "db3")).cloned().collect();
    if let Some(packed) = paths.iter().find(|path| has_ending(path, "zstd") || has_ending(path, "zst")) {
        return Err(BagError::File {
            path: packed.clone(),
            what: "is compressed; unpack it with `zstd -d`, or convert the bag with `ros2 bag convert`".to_owned(),
        });
    }
    if files.is_empty() {
        return Err(match paths.iter().find(|path| has_ending(path, "mcap")) {
            Some(mcap) => wrong(format!("is a rosbag2 in MCAP already: every command takes {}", mcap.display())),
            None => wrong("is a rosbag2 without a sqlite3 file (.db3)".to_owned()),
        });
    }
    let metadata = backdrive_plant::input_file::read_to_string(&folder.join("metadata.yaml")).unwrap_or_default();
    if metadata.lines().any(|line| {
        line.trim().strip_prefix("compression_mode:").is_some_and(|mode| mode.trim().trim_matches('"').eq_ignore_ascii_case("message"))
    }) {
        return Err(wrong("has its messages compressed one by one; convert the bag with `ros2 bag convert`".to_owned()));
    }
    // NAME_2.db3 comes before NAME_10.db3.
    let number = |path: &PathBuf| path.file_stem().and_then(|stem| stem.to_str()?.rsplit_once('_')?.1.parse::<u64>().ok());
    files.sort_by_key(|path| (number(path), path.clone()));
    Ok(files)
}
