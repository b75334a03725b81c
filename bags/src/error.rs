//! What can go wrong with a bag.

use crate::offer::recover_command;
use backdrive_msgs::ros::RosError;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// What can go wrong with a bag or a table.
#[derive(Debug, thiserror::Error)]
pub enum BagError {
    /// The operating system refused to read it.
    #[error("{}: {}", path.display(), unreadable(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// Its message.
        source: std::io::Error,
    },
    /// It cannot be written, or not created.
    #[error("{}: cannot be written: {source}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The operating system's message.
        source: std::io::Error,
    },
    /// What is there already was not given up.
    #[error("{}: exists {}", path.display(), if *is_bag { "already; --overwrite replaces it, or name another" } else { "and is not a bag, so it is not replaced; name another" })]
    Exists {
        /// The file.
        path: PathBuf,
        /// Whether it is a bag, which may be replaced if that is asked for.
        is_bag: bool,
    },
    /// Somebody else writes it at this moment.
    #[error("{}: is being written by another run; wait for its end, or name another", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// It is something else.
    #[error("{} is not an MCAP file: it does not start with the MCAP magic bytes", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// Bytes inside it are wrong.
    #[error("{}, byte {offset}: {what}; `{}` recovers the intact part", path.display(), recover_command(path))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the damaged record starts.
        offset: u64,
        /// What is wrong with it.
        what: String,
    },
    /// A message does not have the content that its topic requires.
    #[error("{}, byte {offset}, {topic}: {source}", path.display())]
    Message {
        /// The file.
        path: PathBuf,
        /// Where the record, or the chunk around it, starts.
        offset: u64,
        /// Its topic.
        topic: String,
        /// What is wrong with it.
        source: RosError,
    },
    /// A message cannot be put into its ROS form.
    #[error("{topic}: {source}")]
    Encode {
        /// Its topic.
        topic: String,
        /// Why.
        source: RosError,
    },
    /// The bag can no longer be written, and everything pushed from now on is lost.
    #[error("{name}: writing stopped: {what}; what was written before is kept: {}", recover_command(Path::new(name)))]
    Write {
        /// The file.
        name: String,
        /// What the writer met.
        what: String,
    },
    /// What backdrive wrote about the run cannot be read.
    #[error("{}: metadata record {record:?}, key {key:?}: {what}", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// `backdrive.run` or `backdrive.completeness`.
        record: &'static str,
        /// The key.
        key: &'static str,
        /// What is wrong with it.
        what: String,
    },
    /// A topic index beyond the header's list of topics.
    #[error("topic {index} does not exist: the header lists {count}")]
    NoSuchIndex {
        /// What was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A topic that the bag does not have.
    #[error("{} has no topic {topic}; it has {}", path.display(), available.join(", "))]
    NoTopic {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        topic: String,
        /// What there is.
        available: Vec<String>,
    },
    /// A field that a topic does not have, or that is no number.
    #[error("{topic}: field {field:?}: {what}")]
    Field {
        /// The topic.
        topic: String,
        /// What was asked for.
        field: String,
        /// What is wrong, and what there is.
        what: String,
    },
    /// A file does not have the content that it should; `what` gives the place in it.
    #[error("{}: {what}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the row, the column or the byte.
        what: String,
    },
    /// A table cannot be read.
    #[error("{}, line {line}: {what}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong.
        what: String,
    },
    /// The signals make no recording.
    #[error(transparent)]
    Recording(#[from] backdrive_plant::recording::RecordingError),
    /// An option that does not go with the others, or with the file.
    #[error("{0}")]
    Option(String),
    /// What was asked for makes no sense.
    #[error("{0}")]
    Usage(String),
}

/// Why a file cannot be read, in the words that are used for every file.
fn unreadable(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        ErrorKind::PermissionDenied => "may not be read: permission denied".to_owned(),
        ErrorKind::IsADirectory => "is a folder, expected a file".to_owned(),
        _ => format!("cannot be read: {error}"),
    }
}

impl BagError {
    pub(crate) fn create(path: &Path) -> impl FnOnce(std::io::Error) -> BagError + use<> {
        let path = path.to_owned();
        move |source| BagError::Create { path, source }
    }

    pub(crate) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> BagError + use<> {
        let path = path.to_owned();
        move |source| BagError::Io { path, source }
    }
}
