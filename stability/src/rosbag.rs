//! Which MCAP files a path stands for: one file, or a rosbag2 folder with one or several.

use crate::signal_role::SessionError;
use std::path::{Path, PathBuf};

/// The MCAP files of a recording in the order in which they were written.
///
/// # Errors
/// Nothing there; a storage or a compression that is not read: the error explains how to convert it.
pub(crate) fn mcap_files(path: &Path) -> Result<Vec<PathBuf>, SessionError> {
    let storage = |what: String| SessionError::Storage { path: path.to_owned(), what };
    if path.is_dir() {
        return of_folder(path);
    }
    let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    if name == "metadata.yaml" {
        return of_folder(path.parent().unwrap_or(Path::new(".")));
    }
    if name.ends_with(".db3") {
        return Err(storage(sqlite_advice()));
    }
    if name.ends_with(".bag") {
        let advice = "rosbags-convert --src FILE.bag --dst FOLDER --dst-storage mcap";
        return Err(storage(format!("is a ROS 1 bag; convert it to MCAP: `{advice}` (pip install rosbags)")));
    }
    if name.ends_with(".zstd") || name.ends_with(".zst") {
        return Err(storage(compressed_advice("this file")));
    }
    Ok(vec![path.to_owned()])
}

fn sqlite_advice() -> String {
    "is a rosbag2 recording in sqlite3 storage; convert it to MCAP: `rosbags-convert --src FOLDER --dst NEW --dst-storage mcap` \
     (pip install rosbags), or `ros2 bag convert -i FOLDER -o to_mcap.yaml` with output_bags: [{uri: NEW, storage_id: mcap, all_topics: true}]"
        .to_owned()
}

fn compressed_advice(what: &str) -> String {
    format!(
        "{what} is compressed as a whole; unpack it (`zstd -d FILE.mcap.zstd`) and name the file, or convert the folder with \
         `ros2 bag convert`: MCAP compresses its own chunks, and those are read"
    )
}

fn of_folder(folder: &Path) -> Result<Vec<PathBuf>, SessionError> {
    let storage = |what: String| SessionError::Storage { path: folder.to_owned(), what };
    let metadata = folder.join("metadata.yaml");
    if !metadata.exists() {
        let entries = std::fs::read_dir(folder).map_err(|e| storage(format!("cannot be read: {e}")))?;
        let mut files: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).filter(|p| has_ending(p, "mcap")).collect();
        files.sort();
        if files.is_empty() {
            return Err(storage("contains neither a metadata.yaml nor an .mcap file: is it a rosbag2 folder?".to_owned()));
        }
        return Ok(files);
    }
    let text = backdrive_plant::input_file::read_to_string(&metadata).map_err(|e| storage(format!("metadata.yaml cannot be read: {e}")))?;
    let told = Metadata::parse(&text);
    if told.storage.as_deref().is_some_and(|s| s == "sqlite3") || told.files.iter().any(|f| f.ends_with(".db3")) {
        return Err(storage(sqlite_advice()));
    }
    if let Some(other) = told.storage.as_deref().filter(|s| *s != "mcap" && !s.is_empty()) {
        return Err(storage(format!("is in {other:?} storage; only MCAP is read: `ros2 bag convert` makes one")));
    }
    let mode = told.compression_mode.unwrap_or_default().to_uppercase();
    if mode == "FILE" || told.files.iter().any(|f| f.ends_with(".zstd") || f.ends_with(".zst")) {
        return Err(storage(compressed_advice("each of its files")));
    }
    if mode == "MESSAGE" {
        let what = "has every message compressed by rosbag2; convert it with `ros2 bag convert` and compression_mode: none";
        return Err(storage(what.to_owned()));
    }
    if told.files.is_empty() {
        return Err(storage("metadata.yaml names no file under relative_file_paths".to_owned()));
    }
    let files: Vec<PathBuf> = told.files.iter().map(|f| folder.join(f)).collect();
    match files.iter().find(|f| !f.exists()) {
        Some(file) => Err(storage(format!("metadata.yaml names {}, which is not there", file.display()))),
        None => Ok(files),
    }
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// What matters of a metadata.yaml. Its keys are unique in it, so that a walk over its lines is enough.
#[derive(Debug, Default, PartialEq)]
struct Metadata {
    storage: Option<String>,
    compression_mode: Option<String>,
    files: Vec<String>,
}

impl Metadata {
    fn parse(text: &str) -> Metadata {
        let mut told = Metadata::default();
        let bare = |value: &str| value.trim().trim_matches(|c| c == '"' || c == '\'').to_owned();
        let mut listing = false;
        for line in text.lines() {
            let line = line.trim();
            if listing && let Some(file) = line.strip_prefix("- ") {
                told.files.push(bare(file));
                continue;
            }
            listing = false;
            let Some((key, value)) = line.split_once(':') else { continue };
            match key {
                "relative_file_paths" => match value.trim().strip_prefix('[').and_then(|v| v.strip_suffix(']')) {
                    Some(inline) => told.files.extend(inline.split(',').map(bare).filter(|f| !f.is_empty())),
                    None => listing = true,
                },
                "storage_identifier" => told.storage = Some(bare(value)),
                "compression_mode" => told.compression_mode = Some(bare(value)),
                _ => {}
            }
        }
        told
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metadata_file_is_read_in_both_of_its_styles() {
        let block = "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  relative_file_paths:\n    - a_0.mcap\n    \
            - \"a_1.mcap\"\n  compression_format: \"\"\n  compression_mode: \"\"\n  files:\n    - path: a_0.mcap\n";
        let told = Metadata::parse(block);
        assert_eq!((told.storage.as_deref(), told.files.clone()), (Some("mcap"), vec!["a_0.mcap".to_owned(), "a_1.mcap".to_owned()]));
        assert_eq!(told.compression_mode.as_deref(), Some(""));
        assert_eq!(Metadata::parse("relative_file_paths: [x.mcap, 'y.mcap']").files, ["x.mcap", "y.mcap"]);
    }

    #[test]
    fn what_is_not_read_says_how_to_convert_it() {
        let dir = tempfile::tempdir().unwrap();
        let says = |text: &str, what: &str| {
            std::fs::write(dir.path().join("metadata.yaml"), text).unwrap();
            let error = mcap_files(dir.path()).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        };
        says("storage_identifier: sqlite3\nrelative_file_paths:\n  - a_0.db3\n", "rosbags-convert");
        says("storage_identifier: mcap\nrelative_file_paths:\n  - a.mcap.zstd\ncompression_mode: FILE\n", "zstd -d");
        says("storage_identifier: mcap\nrelative_file_paths:\n  - gone.mcap\n", "gone.mcap");
        says("nothing: here\n", "names no file");
        assert!(mcap_files(Path::new("x/old.db3")).unwrap_err().to_string().contains("sqlite3"));
        assert!(mcap_files(Path::new("x/old.bag")).unwrap_err().to_string().contains("ROS 1"));
    }
}
