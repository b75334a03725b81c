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
