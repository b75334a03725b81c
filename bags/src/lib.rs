//! Bags: MCAP files in which every message of a run is, and that any ROS 2 tool opens.
//!
//! [`Recorder`] writes one while a graph runs, on a thread of its own; [`Reader`] reads one, whoever wrote it and however it ended. Around them: [`info()`]
//! sums a bag up, [`recover()`] saves what a killed recorder left behind, [`diff()`] compares two bags, [`merge()`] joins those of several hosts, and
//! [`signals()`] picks the columns of a recording. [`import_table`], [`import_lerobot`] and [`import_rosbag`] take recordings of other formats,
//! [`export_table`] and [`export_lerobot`] write them, and [`play()`] sends a bag's messages again.
//!
//! Payloads are CDR with ros2msg schemas whatever the live transport was; the graph, the models and a
//! verdict on completeness are in the file.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod account;
mod arrow_schema;
mod cdr;
mod cdr_bytes;
mod claim;
mod clock_check;
mod clock_offset;
mod completeness;
mod diff;
mod error;
mod export;
mod field_path;
mod foreign_code;
mod framing;
mod header;
mod import;
mod import_offer;
mod index;
mod info;
mod json_message;
mod lengths;
mod lerobot;
mod memory;
mod merge;
mod number_type;
mod offer;
mod order;
mod parquet_file;
mod parquet_writer;
mod play;
mod protobuf_message;
mod raw;
mod reader;
mod recorder;
mod recording;
mod recover;
mod ros_bags;
mod signals;
mod span;
mod steps;
mod table;
mod whole;
mod without;
mod writer;

pub use account::{Account, Fault};
pub use cdr::{FieldPath, Schema};
pub use claim::check_target;
pub use clock_check::{ClockFault, ClockFaultKind, clock_faults, clock_remarks};
pub use clock_offset::{CLOCK_OFFSET, ClockOffset};
pub use completeness::{Completeness, TopicCompleteness};
pub use diff::{DiffOptions, DiffReport, Divergence, TopicDiff, diff};
pub use error::BagError;
pub use export::{Export, ExportFormat, Missing, PlannedExport};
pub use header::{BagHeader, Clock, TopicInfo};
pub use import::{Import, Imported, Planned, Report};
pub use import_offer::import_command;
pub use info::{BagInfo, TopicSummary, check, info};
pub use lerobot::{CommandedAt, Contract, Episode, LerobotOptions, LerobotReport, PerJoint, export_lerobot, import_lerobot, is_lerobot};
pub use memory::MOST_BYTES;
pub use merge::{MergeReport, merge};
pub use number_type::NumberType;
pub use offer::{recover_command, shell_word};
pub use play::{PlayOptions, PlayReport, Sink, play};
pub use raw::{RawColumn, RawRecording, RawStream, raw_bag, raw_lerobot, raw_table};
pub use reader::{Entry, Messages, Reader, TopicRef};
pub use recorder::{Health, Recorder, RecorderOptions, WhenFull};
pub use recording::{recording, recording_up_to};
pub use recover::{RecoverReport, recover};
pub use ros_bags::{RosbagReport, RosbagTopic, import_rosbag, is_rosbag};
pub use signals::{Alignment, Signal, Signals, signals};
pub use table::{
    ColumnMap, ImportOptions, ImportReport, Quantity, TableFormat, columns_of, export_csv, export_table, frame_of, import_csv,
    import_frame, import_table, topic_of,
};
pub use whole::{free, move_into_place};
pub use without::without;
