//! Options of the verbs that only a supervisor gives: `backdrive node` and `backdrive sealed-master`.

use clap::Args;
use std::path::PathBuf;

/// `backdrive node`
#[derive(Debug, Args)]
pub struct Node {
    /// The run's folder.
    #[arg(long)]
    pub run: PathBuf,
    /// Name of the node.
    #[arg(long)]
    pub name: String,
}

/// Examples and exit codes of `backdrive step`.
pub const STEP_HELP: &str = "Example, as the command of a node in a graph file:
  command = [\"backdrive\", \"step\", \"python3\", \"examples/own_master.py\"]

The program reads a line of JSON about its node, then a frame of numbers for each step, and answers each with a frame (docs/own-nodes.md). Paths are
relative to the folder that the run is started in. `backdrive run` adds --run and --name.

Exit codes: 0 the run ended, 2 usage, 3 the graph is wrong, 5 the run cannot be joined, 6 the program ended or did not answer.";

/// `backdrive step`
#[derive(Debug, Args)]
pub struct Step {
    /// The program and its arguments; the supervisor adds `--run DIR --name NAME`.
    #[arg(value_name = "PROGRAM", required = true, trailing_var_arg = true, allow_hyphen_values = true)]
    pub words: Vec<String>,
}

impl Step {
    /// The program with its arguments, the run's folder, and the node's name; `None` where no supervisor gave these.
    pub fn parts(&self) -> Option<(&[String], &str, &str)> {
        match self.words.as_slice() {
            [program @ .., run, folder, name, node] if run == "--run" && name == "--name" => Some((program, folder, node)),
            _ => None,
        }
    }
}

/// `backdrive sealed-master`
#[derive(Debug, Args)]
pub struct SealedMaster {
    /// The run's folder.
    #[arg(long)]
    pub run: PathBuf,
    /// Name of the node.
    #[arg(long)]
    pub name: String,
    /// The command line of the hidden plant, word by word.
    #[arg(long, allow_hyphen_values = true)]
    pub word: Vec<String>,
}
