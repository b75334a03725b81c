//! The Python that some tests need beside the program.

#[path = "skipped.rs"]
pub mod skipped;

use std::path::PathBuf;

/// The interpreter to use, or `None` to skip; `needs` describes what it must have, such as `that has tests/python/requirements.txt`.
pub fn python(needs: &str) -> Option<PathBuf> {
    if let Some(python) = std::env::var_os("BACKDRIVE_PYTHON") {
        return Some(python.into());
    }
    let why = format!("BACKDRIVE_PYTHON is not set: it names a Python {needs}");
    assert!(std::env::var_os("BACKDRIVE_REQUIRE_PYTHON").is_none_or(|required| required != "1"), "{why}");
    skipped::skipped(why);
    None
}
