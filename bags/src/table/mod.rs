//! To and from tables: CSV, parquet and MATLAB files.

mod arrays;
mod bag_columns;
mod csv_file;
mod formats;
mod from_bag;
mod mapping;
mod mat_array;
mod mat_format;
mod mat_in;
mod mat_out;
mod npz_in;
mod parquet_in;
mod parquet_out;
mod time_column;
mod to_bag;
mod types;
mod zip_members;

pub use bag_columns::columns_of;
pub(crate) use bag_columns::was_table;
pub(crate) use csv_file::Missing;
pub(crate) use formats::read_table;
pub use formats::{TableFormat, export_csv, export_table, frame_of, import_csv, import_frame, import_table};
pub(crate) use from_bag::table_of;
pub use mapping::{ColumnMap, ImportOptions, ImportReport, Quantity, topic_of};
pub(crate) use to_bag::write_bag;
pub(crate) use types::{Cells, Column, Table, name_of, unit_of};
