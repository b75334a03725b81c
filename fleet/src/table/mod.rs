//! The table of a fleet: one row for each recording and joint, in the order of the recordings' names.

mod parquet_file;
mod rows;

pub use parquet_file::{read, write};
pub use rows::{NUMBERS, TEXTS, Table, TableRow};
