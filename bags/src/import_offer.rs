//! The command that makes a bag of a recording in another format.

use crate::offer::{free, path_word};
use crate::{is_lerobot, is_rosbag};
use std::path::Path;

/// The command that makes a bag, or a folder of them, of a recording in another format, in the working folder under a name that is free;
/// `None` where it is no such recording.
pub fn import_command(recording: &Path) -> Option<String> {
    let ending = recording.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let stem = recording.file_stem()?.to_string_lossy().into_owned();
    let is_table = recording.is_file() && ["parquet", "mat", "tsv"].contains(&ending.as_str());
    let bag = match (is_lerobot(recording), is_table || (recording.exists() && is_rosbag(recording))) {
        (true, _) => free(Path::new(""), &format!("{stem}-bags"), ""),
        (false, true) => free(Path::new(""), &stem, ".mcap"),
        (false, false) => return None,
    };
    // A command that cannot be passed to a shell is no offer.
    recording.to_str()?;
    Some(format!("backdrive bag import {} --bag {}", path_word(recording), path_word(&bag)))
}
