//! The one way out of this program: the output of a verb, and the files that it writes.
//!
//! Results go to standard output. One that cannot be written ends the verb with exit code 5 and a sentence; a reader who has enough (`| head`) is no error.
//! Everything else goes to standard error, and a failure to write there cannot be reported. A file that was asked for is there whole or not at all: it is
//! written beside its place and then moved there (`move_into_place` of the bags, which are written in the same way).

#![allow(clippy::print_stdout, clippy::print_stderr)]

use crate::caller;
use crate::failure::{Failure, code};
use crate::offered::own_command;
use crate::program::called;
use backdrive_bags::move_into_place;
use backdrive_pages::parts::symbols;
use backdrive_plant::recording::{Recording, write_csv};
use backdrive_report::Page;
use clap::Parser;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

/// A result on standard output, with a line feed behind it.
///
/// # Errors
/// When it cannot be written; not when the reader has closed the pipe.
pub fn line(result: impl Display) -> Result<(), Failure> {
    text(format_args!("{result}\n"))
}

/// A result on standard output, unchanged.
///
/// # Errors
/// As [`line()`].
pub fn text(result: impl Display) -> Result<(), Failure> {
    // At once: a text that is half written before the error is of no more use than none.
    let bytes = result.to_string();
    if caller::kept(&bytes) {
        return Ok(());
    }
    SAID.store(true, Ordering::SeqCst);
    let mut stdout = io::stdout().lock();
    written(stdout.write_all(bytes.as_bytes()).and_then(|()| stdout.flush()))
}

/// A result on standard output as JSON that a person can read.
///
/// # Errors
/// As [`line()`].
pub fn json(result: &impl serde::Serialize) -> Result<(), Failure> {
    line(serde_json::to_string_pretty(result).map_err(Failure::input)?)
}

fn written(result: io::Result<()>) -> Result<(), Failure> {
    match result {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Failure::machine(format!("standard output: cannot be written: {e}"))),
        _ => Ok(()),
    }
}

/// A line on standard error: a note, a warning, an error. Where that is full or closed it is lost.
pub fn note(told: impl Display) {
    let line = format!("{told}\n");
    if caller::noted(&line) {
        return;
    }
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// Whether a result was printed.
static SAID: AtomicBool = AtomicBool::new(false);

/// How a program ends that fails: its one message, for a program that asked for JSON as JSON too, and its exit code.
pub fn fail(failure: &Failure) -> ExitCode {
    note(format_args!("error: {}", failure.message));
    tell_program(failure);
    ExitCode::from(failure.code)
}

/// How a verb ends that gives a code. Where JSON was asked for there is some, whatever the code.
pub fn ended(code: u8) -> ExitCode {
    if code != 0 {
        tell_program(&Failure { code, message: "ended without a result; see standard error".to_string() });
    }
    ExitCode::from(code)
}

/// A failure as JSON, if that was asked for and no result was printed before.
fn tell_program(failure: &Failure) {
    if wants_json() && !SAID.load(Ordering::SeqCst) {
        // Where standard output takes nothing the message on standard error is all there is.
        let _ = json(&failure.json());
    }
}

/// Whether the command line asks for JSON. Of wrong usage nothing else is known.
fn wants_json() -> bool {
    called().arguments.iter().take_while(|argument| *argument != "--").any(|argument| argument == "--json")
}

/// The command line of this program, or how it ends: wrong usage with 2, help and version with 0.
///
/// # Errors
/// The exit code; everything is said by then.
pub fn parsed<P: Parser>() -> Result<P, ExitCode> {
    let words = std::iter::once("backdrive".into()).chain(called().arguments.iter().cloned());
    P::try_parse_from(words).map_err(|wrong| {
        let printed = wrong.print().and_then(|()| io::stdout().flush());
        match written(printed) {
            Err(failure) if !wrong.use_stderr() => fail(&failure),
            _ if !wrong.use_stderr() => ExitCode::SUCCESS,
            _ => {
                let message = wrong.render().to_string();
                tell_program(&Failure { code: code::USAGE, message: message.trim_start_matches("error: ").trim_end().to_string() });
                ExitCode::from(code::USAGE)
            }
        }
    })
}

/// A file with these contents, in place of one that is there.
///
/// # Errors
/// When it cannot be written; then what was there is there still, and nothing new.
pub fn file(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Failure> {
    replace(path, |beside| std::fs::write(beside, contents).map_err(|e| Failure::write(beside, e)))
}

/// A recording as CSV, in place of a file that is there.
///
/// # Errors
/// As [`file()`].
pub fn csv(recording: &Recording, path: &Path) -> Result<(), Failure> {
    replace(path, |beside| Ok(write_csv(recording, beside)?))
}

/// A page, with the command and the version that made it at its foot.
///
/// # Errors
/// As [`file()`].
pub fn page(path: &Path, page: Page) -> Result<(), Failure> {
    file(path, html(page))
}

/// The text of a page, with the version that made it at its foot, and the command where there is one.
pub fn html(mut page: Page) -> String {
    let with = own_command().map_or_else(String::new, |command| format!(" with: {command}"));
    symbols(&mut page);
    page.text(&format!("Made by backdrive {}{with}", env!("CARGO_PKG_VERSION")));
    page.html()
}

/// A file that `write` makes: at a path beside the one that is asked for, where nothing is yet and to which it may return as often as it
/// likes. Once it is whole it is moved to its place; onto a device or a pipe it is copied. Folders above it are made where they are not there.
///
/// # Errors
/// The error of `write`, with the path that was asked for, and exit code 5 where that is about the file.
pub fn replace<T>(path: &Path, write: impl FnOnce(&Path) -> Result<T, Failure>) -> Result<T, Failure> {
    let failed = |e: io::Error| Failure::write(path, e);
    let name = path.file_name().ok_or_else(|| Failure::machine(format!("{}: is not a file name", path.display())))?;
    let stream = is_stream(path);
    // A link stays a link: what it points at is replaced.
    let place = if path.is_file() { path.canonicalize().map_err(failed)? } else { path.to_path_buf() };
    if path.is_dir() {
        return Err(failed(io::Error::from(ErrorKind::IsADirectory)));
    }
    let folder = if stream { std::env::temp_dir() } else { folder_of(&place) };
    std::fs::create_dir_all(&folder).map_err(failed)?;
    let beside = tempfile::Builder::new().prefix(".backdrive-").tempdir_in(&folder).map_err(|e| {
        // The name of a folder that nobody knows of would not help.
        failed(e.raw_os_error().map_or_else(|| io::Error::from(e.kind()), io::Error::from_raw_os_error))
    })?;
    let made = beside.path().join(name);
    let result = write(&made).map_err(|failure| about(failure, &made, path))?;
    let moved = match stream {
        true => copy(&made, path),
        false => move_into_place(&made, &place),
    };
    moved.map(|()| result).map_err(failed)
}

/// A table that is there already is replaced only where that was asked for.
///
/// # Errors
/// It is a folder, or there and not to be replaced.
pub fn may_replace(table: &Path, overwrite: bool) -> Result<(), Failure> {
    if table.is_dir() {
        return Err(Failure::write(table, io::ErrorKind::IsADirectory.into()));
    }
    match table.exists() && !is_stream(table) && !overwrite {
        true => Err(Failure::input(format!("{}: exists already; --overwrite replaces it, or name another", table.display()))),
        false => Ok(()),
    }
}

/// Whether a path is a device or a pipe: what is written there cannot be read again.
pub fn is_stream(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Checks before long work whether a file could be written after it.
///
/// # Errors
/// When it could not.
pub fn writable(path: &Path) -> Result<(), Failure> {
    if is_stream(path) {
        return Ok(());
    }
    match path.is_dir() {
        true => Err(Failure::write(path, io::Error::from(ErrorKind::IsADirectory))),
        false => {
            // Of folders that are made later the nearest that is there has to take files.
            let folder = folder_of(path);
            let there = folder.ancestors().find(|f| f.exists() || f.as_os_str().is_empty()).unwrap_or(&folder);
            let there = if there.as_os_str().is_empty() { Path::new(".") } else { there };
            tempfile::tempfile_in(there).map(drop).map_err(|e| Failure::write(path, e))
        }
    }
}

/// Makes a folder for files, with those above it, if it is not there.
///
/// # Errors
/// When it cannot be made.
pub fn folder(path: &Path) -> Result<(), Failure> {
    if path.as_os_str().is_empty() {
        return Ok(());
    }
    std::fs::create_dir_all(path).map_err(|e| Failure::write(path, e))
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|f| !f.as_os_str().is_empty()).map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

/// A failure about the file beside is one about the file that was asked for.
fn about(failure: Failure, made: &Path, path: &Path) -> Failure {
    let ours = made.display().to_string();
    match failure.message.contains(&ours) {
        true => Failure { code: code::MACHINE, message: failure.message.replace(&ours, &path.display().to_string()) },
        false => failure,
    }
}

fn copy(made: &Path, stream: &Path) -> io::Result<()> {
    let mut to = File::options().write(true).open(stream)?;
    match io::copy(&mut File::open(made)?, &mut to).and_then(|_| to.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        std::fs::read_dir(folder).unwrap().flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_file_is_there_whole_or_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        file(&path, "one").unwrap();
        let failure = replace(&path, |beside| -> Result<(), Failure> {
            std::fs::write(beside, "tw").unwrap();
            Err(Failure::input(format!("{}: No space left on device", beside.display())))
        });
        let failure = failure.unwrap_err();
        assert_eq!((failure.code, failure.message), (code::MACHINE, format!("{}: No space left on device", path.display())));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "one");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn what_is_no_matter_of_the_file_keeps_its_code() {
        let folder = tempfile::tempdir().unwrap();
        let failure = replace(&folder.path().join("a"), |_| -> Result<(), Failure> { Err(Failure::input("b: holds nothing")) });
        assert_eq!(failure.unwrap_err().code, code::BAD_INPUT);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_full_device_and_what_is_no_folder_are_told_with_the_path_that_was_asked_for() {
        let full = file(Path::new("/dev/full"), "x").unwrap_err();
        assert_eq!(full.code, code::MACHINE);
        assert!(full.message.starts_with("/dev/full: cannot be written: No space left"), "{}", full.message);
        let absent = file(Path::new("/dev/null/x"), "x").unwrap_err();
        assert_eq!(absent.code, code::MACHINE);
        assert!(absent.message.starts_with("/dev/null/x: cannot be written: "), "{}", absent.message);
        assert_eq!(writable(Path::new("/dev/null/x")).unwrap_err().code, code::MACHINE);
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("new/folder/x");
        writable(&below).unwrap();
        assert!(names(folder.path()).is_empty(), "nothing is made before it is needed");
        file(&below, "x").unwrap();
        assert_eq!(std::fs::read_to_string(below).unwrap(), "x");
    }

    #[test]
    fn a_link_and_the_rights_of_a_file_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a"), folder.path().join("b"));
        std::fs::write(&path, "one").unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("a", &link).unwrap();
        file(&link, "two").unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "two");
        assert!(link.is_symlink());
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}
