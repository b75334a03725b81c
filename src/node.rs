//! `backdrive node`: one process of a running graph.

use crate::cli;
use std::process::ExitCode;

/// Joins the run as the named node.
pub fn node(options: &cli::Node) -> ExitCode {
    backdrive_launch::join::join_as(&options.run, &options.name)
}
