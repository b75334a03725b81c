//! A test that cannot run here reports this where it is seen: `tests/run` names a file, and shows its content at its end.

use std::io::Write;

/// Reports that the test of this thread is skipped, and why.
pub fn skipped(why: impl std::fmt::Display) {
    let test = std::thread::current().name().unwrap_or("a test").to_string();
    eprintln!("skipped: {why}");
    if let Some(path) = std::env::var_os("BACKDRIVE_SKIPPED") {
        // One write: tests of several programs append at the same time.
        let line = format!("{test}: {}\n", why.to_string().lines().next().unwrap_or_default());
        let file = std::fs::File::options().append(true).create(true).open(path);
        file.and_then(|mut file| file.write_all(line.as_bytes())).expect("BACKDRIVE_SKIPPED names a file that can be written");
    }
}
