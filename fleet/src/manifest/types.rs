//! The recordings of a manifest, and how each is read.

use crate::date::Date;
use crate::error::FleetError;
use backdrive_bags::{ImportOptions, LerobotOptions, RawRecording, raw_lerobot, raw_table};
use backdrive_plant::recording::Frame;
use backdrive_plant::set::RecordingSet;
use std::path::PathBuf;

/// The recordings of a fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// What stands for it in messages.
    pub name: String,
    /// Keys of `set.toml` that hold for every recording, as TOML: `[joints]`, `[columns]` and so on.
    pub settings: String,
    /// For `stability`: the file that states which topic is which.
    pub roles: Option<PathBuf>,
    /// The recordings, by name.
    pub entries: Vec<Entry>,
}

/// One recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Its name in the table, unique in the manifest.
    pub name: String,
    /// Where it is.
    pub source: Source,
    /// The unit: the device that it was recorded on.
    pub unit: String,
    /// When it was recorded, if that is known.
    pub date: Option<Date>,
    /// Temperature of the device, °C.
    pub temperature: Option<f64>,
    /// Time since the device was started, s.
    pub since_start: Option<f64>,
    /// Its nominal model.
    pub model: Option<PathBuf>,
}

/// Where a recording is.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A file of its own.
    File(PathBuf),
    /// An episode of a LeRobot dataset.
    Episode(PathBuf, u64),
}

/// A source whose bytes were read once: what its answer depends on.
pub struct Loaded {
    /// For the key of the answer: the bytes of the file, or the numbers of the episode.
    pub content: Content,
    /// Columns in memory, where the file is neither CSV nor MCAP.
    frame: Option<Frame>,
}

/// What identifies a recording.
pub enum Content {
    /// The file's bytes are hashed from the file.
    File(PathBuf),
    /// These bytes.
    Bytes(Vec<u8>),
}

impl Manifest {
    /// The entries of a shard, numbered from 1: every `of`-th.
    pub fn shard(&self, (number, of): (usize, usize)) -> Vec<&Entry> {
        self.entries.iter().enumerate().filter(|(index, _)| index % of.max(1) + 1 == number).map(|(_, entry)| entry).collect()
    }

    /// The set of one recording alone.
    ///
    /// # Errors
    /// The settings are wrong.
    pub fn set_of(&self, entry: &Entry, loaded: &Loaded) -> Result<RecordingSet, FleetError> {
        let file = match (&loaded.frame, &entry.source) {
            (Some(frame), _) => frame.name().to_string(),
            (None, Source::File(path)) => std::path::absolute(path).unwrap_or_else(|_| path.clone()).display().to_string(),
            (None, Source::Episode(..)) => entry.name.clone(),
        };
        let mut document: toml_edit::DocumentMut = self.settings.parse().map_err(|e| FleetError::input(format!("{}: {e}", self.name)))?;
        document.insert("fit", toml_edit::value(toml_edit::Array::from_iter([file])));
        let frames = loaded.frame.iter().cloned().collect();
        let set = RecordingSet::in_memory(&document.to_string(), PathBuf::new(), frames);
        let mut set = set.map_err(|e| FleetError::input(e.to_string().replace("set.toml", &self.name)))?;
        set.model = entry.model.clone();
        Ok(set)
    }
}

impl Entry {
    /// Reads what is neither CSV nor MCAP into memory; the others are read where they are used.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn load(&self) -> Result<Loaded, FleetError> {
        match &self.source {
            Source::File(path) => {
                let content = Content::File(path.clone());
                let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
                if ending == "csv" || ending == "mcap" {
                    return Ok(Loaded { content, frame: None });
                }
                let raw = raw_table(path, &ImportOptions::default()).map_err(FleetError::input)?;
                Ok(Loaded { content, frame: Some(frame_of(&self.name, raw)?) })
            }
            Source::Episode(folder, episode) => {
                let options = LerobotOptions { episodes: Some(vec![*episode]), ..LerobotOptions::default() };
                let raw = raw_lerobot(folder, &options).map_err(FleetError::input)?.into_iter().next();
                let raw = raw.ok_or_else(|| FleetError::input(format!("{}: has no episode {episode}", folder.display())))?;
                let frame = frame_of(&self.name, raw)?;
                let mut bytes = Vec::new();
                for (heading, values) in frame.clone().into_columns() {
                    bytes.extend(heading.as_bytes());
                    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
                }
                Ok(Loaded { content: Content::Bytes(bytes), frame: Some(frame) })
            }
        }
    }
}

impl Loaded {
    /// The columns of what is neither CSV nor MCAP.
    pub fn columns(&self) -> Option<Vec<(String, Vec<f64>)>> {
        self.frame.clone().map(Frame::into_columns)
    }
}

/// The columns of numbers of a table.
fn frame_of(name: &str, raw: RawRecording) -> Result<Frame, FleetError> {
    let columns = raw.streams.into_iter().flat_map(|stream| stream.columns).filter(|column| column.other.is_none());
    let headed = columns.map(|column| match column.unit {
        Some(unit) => (format!("{} [{}]", column.name, unit.name), column.values),
        None => (column.name, column.values),
    });
    Frame::new(name, headed.collect()).map_err(FleetError::input)
}
