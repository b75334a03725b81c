//! `backdrive node` and `backdrive step`: one process of a running graph.

use crate::failure::{Failure, code};
use crate::{cli, output};
use std::path::Path;
use std::process::ExitCode;

/// Joins the run as the named node.
pub fn node(options: &cli::Node) -> ExitCode {
    backdrive_launch::join::join_as(&options.run, &options.name)
}

/// Joins the run as a node whose steps are a program's.
pub fn step(options: &cli::Step) -> ExitCode {
    match options.parts() {
        Some((program, run, name)) => backdrive_launch::step_program::step_program(program, Path::new(run), name),
        None => {
            let why = "a program of `backdrive step` is a node of a graph: name it as `command` of a node, and `backdrive run` starts it";
            output::fail(&Failure { code: code::USAGE, message: why.to_string() })
        }
    }
}
