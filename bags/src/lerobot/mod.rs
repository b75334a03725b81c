//! LeRobot datasets, version 3: a folder of parquet files with `meta/info.json`, in and out.

mod contract;
mod info;
mod read;
mod statistics;
mod write;

pub use contract::{CommandedAt, Contract, PerJoint};
pub(crate) use read::episode_tables;
pub use read::{Episode, LerobotOptions, import_lerobot, is_lerobot};
pub use write::{LerobotReport, export_lerobot};
