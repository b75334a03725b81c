//! Options of `backdrive gate`.

use clap::Args;
use std::path::PathBuf;

/// Examples and exit codes.
pub const HELP: &str = "Examples:
  backdrive gate before/ after/ --model arm.toml --bounds bounds.toml --junit gate.xml
  backdrive gate main.mcap change.mcap --json

OLD and NEW are recordings, folders of recordings or manifests of a fleet: arms by torque, servo joints by command and position, motors, or bags
of a loop. Of bags of a loop the stability limits are compared. A bound is a line of a TOML file, such as dry = 0.15 for 15 % of dry friction;
[joints.elbow] has those of one joint. Every bound and its default: docs/fleet.md.

Exit codes: 0 no change beyond the bounds, 1 a change beyond them, 2 usage, 3 wrong input, 5 a file cannot be written, 7 not known. Not known is a
quantity that the old recordings determine to within its bound and the new ones do not.";

/// `backdrive gate`
#[derive(Debug, Args)]
pub struct Gate {
    /// The recordings of before.
    #[arg(value_name = "OLD")]
    pub old: PathBuf,
    /// The recordings to be judged.
    #[arg(value_name = "NEW")]
    pub new: PathBuf,
    /// The nominal model of both.
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// File that states which topic or column is which, for loops of others (docs/roles-example.toml).
    #[arg(long, value_name = "FILE")]
    pub roles: Option<PathBuf>,
    /// How large a change has to be to matter; without it the defaults.
    #[arg(long, value_name = "FILE")]
    pub bounds: Option<PathBuf>,
    /// Write the checks as JUnit XML.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Print all checks as JSON.
    #[arg(long)]
    pub json: bool,
}
