//! Recordings: what a device did, one signal per input and output of its model.

mod columns;
mod csv_file;
mod frame;
mod headings;
mod hold;
mod joints;
mod record;
mod rows;
mod separator;
mod table_source;
mod text_table;
pub mod units;

pub use columns::{Cell, ColumnRule, Columns, Piece, Source, read_columns};
pub use csv_file::{NO_HEADING, is_no_heading, read_csv, read_headings, write_csv};
pub use frame::Frame;
pub use hold::{resample, segments};
pub use joints::JointColumns;
pub(crate) use joints::read_joints;
pub use record::{Gap, Jitter, LARGEST, Recording, RecordingError, signals_of};
pub use table_source::TableSource;
pub use text_table::{TextTable, comma_remark};
