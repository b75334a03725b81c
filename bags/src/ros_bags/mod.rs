//! Bags of ROS 1, and of rosbag2 in sqlite3, become MCAP: every message verbatim as far as ROS 2 has it.

mod definitions;
mod import;
mod ros1;
mod ros1_message;
mod sqlite;
mod target;

pub use import::{import_rosbag, is_rosbag};
pub use target::{RosbagReport, RosbagTopic};
