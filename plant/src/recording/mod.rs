//! Recordings: what a device did, one signal per input and output of its model.

mod columns;
mod csv_file;
mod hold;
mod joints;
mod record;
mod separator;
mod text_table;
pub mod units;

pub use columns::{Cell, ColumnRule, Columns, Piece, Source, read_columns};
pub use csv_file::{NO_HEADING, is_no_heading, read_csv, read_headings, read_signals_of, write_csv};
pub use hold::{resample, segments};
pub use joints::JointColumns;
pub(crate) use joints::read_joints;
pub use record::{Gap, Jitter, LARGEST, Recording, RecordingError, signals_of};
pub use text_table::{TextTable, comma_remark};
