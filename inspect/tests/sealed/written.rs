//! Draws as files, for other programs: `BACKDRIVE_SEALED_OUT=DIR` has each written into a folder of its own.

use super::draw::{Column, Role};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The folder for draws, where one is asked for.
pub fn folder() -> Option<PathBuf> {
    std::env::var_os("BACKDRIVE_SEALED_OUT").map(PathBuf::from)
}

fn role(column: &Column) -> &'static str {
    match column.role {
        Role::Time => "time",
        Role::Command | Role::Leader => "command",
        Role::Position => "position",
        Role::Velocity => "velocity",
        Role::Drive => "drive",
    }
}

/// Writes pieces of a recording as tables. Each heading is the role, the joint and the column's own heading.
pub fn write(folder: &Path, name: &str, pieces: &[Vec<Column>]) {
    std::fs::create_dir_all(folder).unwrap();
    for (number, columns) in pieces.iter().enumerate() {
        let headings: Vec<String> = columns.iter().map(|c| format!("{}:{}:{}", role(c), c.joint, c.heading.replace(',', " "))).collect();
        let mut text = headings.join(",") + "\n";
        for row in 0..columns[0].values.len() {
            let values: Vec<String> = columns.iter().map(|c| format!("{:?}", c.values[row])).collect();
            let _ = writeln!(text, "{}", values.join(","));
        }
        std::fs::write(folder.join(format!("{name}-{number}.csv")), text).unwrap();
    }
}
