//! Options of `backdrive completions` and `backdrive man`.

use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const COMPLETIONS_HELP: &str = "Examples:
  backdrive completions bash > ~/.local/share/bash-completion/completions/backdrive
  backdrive completions zsh > ~/.zfunc/_backdrive
  backdrive completions fish > ~/.config/fish/completions/backdrive.fish

Exit codes: 0 done, 2 usage, 5 standard output cannot be written.";

/// Examples and exit codes.
pub const MAN_HELP: &str = "Example:
  backdrive man --out ~/.local/share/man/man1 && man backdrive-run

Exit codes: 0 done, 2 usage, 5 the folder cannot be written.";

/// `backdrive completions`
#[derive(Debug, Args)]
pub struct Completions {
    /// The shell.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// `backdrive man`
#[derive(Debug, Args)]
pub struct Man {
    /// Folder for the pages; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}
