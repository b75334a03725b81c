//! How this program was called. In the process of another program, such as Python's, the arguments and the program are not those of the process.

use std::ffi::OsString;
use std::sync::OnceLock;

/// How it was called.
#[derive(Debug, Clone, Default)]
pub struct Called {
    /// The arguments behind the program's name.
    pub arguments: Vec<OsString>,
    /// Program and first arguments that start another process of it; empty where that is the program of this process.
    pub command: Vec<String>,
}

static CALLED: OnceLock<Called> = OnceLock::new();

/// How the command line of this process was called.
pub(crate) fn called() -> &'static Called {
    CALLED.get_or_init(|| Called { arguments: std::env::args_os().skip(1).collect(), command: Vec::new() })
}

/// States it, once and before anything else.
pub(crate) fn state(called: Called) {
    // The first statement is the one of the caller; a second one would be of the same process.
    let _ = CALLED.set(called);
}
