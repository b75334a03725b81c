//! Passes to the program the commit it was built from, for `--version`.
//!
//! `BACKDRIVE_COMMIT` states it where there is no git (a container, a package's build); otherwise git is asked. A source without either has its version
//! alone.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What git answers, or nothing: no git, no repository, no such thing.
fn git(question: &[&str]) -> Option<String> {
    let done = Command::new("git").args(question).output().ok().filter(|done| done.status.success())?;
    let said = String::from_utf8(done.stdout).ok()?.trim().to_string();
    (!said.is_empty()).then_some(said)
}

/// Whether the repository is this source's own, not one that this source was unpacked into.
fn is_ours(top: &str) -> bool {
    let here = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).and_then(|path| path.canonicalize().ok());
    here.is_some() && here == Path::new(top).canonicalize().ok()
}

/// Files that change when another commit is checked out or made: HEAD, its branch (loose or packed), its log.
fn watched() -> Vec<String> {
    let mut names = vec!["HEAD".to_string(), "packed-refs".to_string(), "logs/HEAD".to_string()];
    names.extend(git(&["symbolic-ref", "--quiet", "HEAD"]));
    // A file that is not there would have cargo rebuild this every time.
    names.iter().filter_map(|name| git(&["rev-parse", "--git-path", name])).filter(|path| Path::new(path).exists()).collect()
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=BACKDRIVE_COMMIT");
    let given = std::env::var("BACKDRIVE_COMMIT").ok().map(|text| text.trim().to_string()).filter(|text| !text.is_empty());
    let commit = given.or_else(|| {
        git(&["rev-parse", "--show-toplevel"]).filter(|top| is_ours(top))?;
        watched().iter().for_each(|path| println!("cargo::rerun-if-changed={path}"));
        let day = git(&["show", "--no-patch", "--format=%cs", "HEAD"])?;
        git(&["rev-parse", "--short=10", "HEAD"]).map(|commit| format!("{commit}, {day}"))
    });
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let text = commit.map_or(version.clone(), |commit| format!("{version} ({commit})"));
    println!("cargo::rustc-env=BACKDRIVE_VERSION={text}");
}
