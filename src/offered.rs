//! Commands that are offered to the user: on a terminal, on a page and in JSON.
//!
//! An offered command works when it is pasted into the shell in which this program ran. So it is built from typed parts only. The arguments are parsed as
//! the command line parses them. A file that is read exists or is written by an earlier command of the same offer. A file that is written does not exist
//! yet. What fails one of these is no offer: [`Builder::build`] gives `None`, and only the sentence beside it is shown.

use crate::caller;
use crate::cli::Cli;
use crate::program::called;
use backdrive_bags::{free, shell_word};
pub use backdrive_pages::offered::{Offered, Step};
use clap::Parser;
use std::ffi::OsString;
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// The command that makes a clean copy of a bag that was cut off or is damaged.
pub fn recover(bag: &Path) -> Option<Offered> {
    let stem = bag.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    Builder::verb("bag recover").reads(bag).option_writes("--bag", &bag.with_file_name(format!("{stem}-saved.mcap"))).build()
}

/// A sentence with the command that does it in it, where there is one: `what it holds is used; make a clean copy: backdrive ...`.
pub fn with_recover(sentence: &str, bag: &Path) -> String {
    recover(bag).map_or_else(|| sentence.to_string(), |command| format!("{sentence}; make a clean copy: {command}"))
}

/// Digits as a command takes them: three behind the point, or three that count.
pub fn plain(value: f64) -> String {
    let digits = if value > 0.0 && value < 0.1 { (2.0 - value.log10().floor()).clamp(3.0, 12.0) as usize } else { 3 };
    let text = format!("{value:.digits$}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// Lines of steps for a terminal: the label before the first, the commands beneath each sentence.
pub fn lines(label: &str, width: usize, steps: &[Step]) -> Vec<String> {
    let mut lines = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let label = if index == 0 { label } else { "" };
        lines.push(format!("{label:<width$}{}", step.sentence));
        lines.extend(step.commands.iter().map(|command| format!("{:<width$}  {command}", "")));
    }
    lines
}

/// A command in the making.
#[derive(Debug, Clone)]
pub struct Builder {
    words: Vec<String>,
    possible: bool,
}

impl Builder {
    /// A command of a verb, such as `replay` or `bag recover`.
    pub fn verb(verb: &str) -> Builder {
        Builder { words: verb.split_whitespace().map(str::to_string).collect(), possible: true }
    }

    /// The command that is running, to be changed and repeated.
    pub fn again() -> Builder {
        let words: Option<Vec<String>> = own_arguments().into_iter().map(|word| word.into_string().ok()).collect();
        Builder { possible: words.is_some(), words: words.unwrap_or_default() }
    }

    /// A word that is no option, such as a name.
    pub fn word(mut self, word: impl Display) -> Builder {
        self.words.push(word.to_string());
        self
    }

    /// An option without a value.
    pub fn flag(self, name: &str) -> Builder {
        self.word(name)
    }

    /// The value of an option, where it has one.
    pub fn value_of(&self, name: &str) -> Option<String> {
        let joined = format!("{name}=");
        let at = self.words.iter().position(|word| word == name);
        let apart = at.and_then(|at| self.words.get(at + 1)).cloned();
        apart.or_else(|| self.words.iter().find_map(|word| word.strip_prefix(&joined).map(str::to_string)))
    }

    /// Several words that another part of this program made.
    pub fn words(self, words: impl IntoIterator<Item = String>) -> Builder {
        words.into_iter().fold(self, Builder::word)
    }

    /// An option with a value, in place of the value that it has.
    pub fn option(mut self, name: &str, value: impl Display) -> Builder {
        self = self.without(name, true);
        self.word(name).word(value)
    }

    /// Takes an option away, with its value where it has one.
    pub fn without(mut self, name: &str, has_value: bool) -> Builder {
        let joined = format!("{name}=");
        let mut kept = Vec::new();
        let mut words = std::mem::take(&mut self.words).into_iter();
        while let Some(word) = words.next() {
            if word == name {
                if has_value {
                    words.next();
                }
            } else if !word.starts_with(&joined) {
                kept.push(word);
            }
        }
        self.words = kept;
        self
    }

    /// A file or folder that is read; it has to be there.
    pub fn reads(mut self, path: &Path) -> Builder {
        self.possible &= path.exists();
        self.path(path)
    }

    /// The same as the value of an option.
    pub fn option_reads(mut self, name: &str, path: &Path) -> Builder {
        self = self.without(name, true);
        self.word(name).reads(path)
    }

    /// A file that an earlier command of the same offer writes.
    pub fn reads_later(mut self, path: &Path) -> Builder {
        self = self.path(path);
        self
    }

    /// An option whose value is a file that is written, by this name or one like it that is free; [`free`].
    pub fn option_writes(mut self, name: &str, path: &Path) -> Builder {
        self = self.without(name, true);
        self.word(name).path(&free(path))
    }

    fn path(mut self, path: &Path) -> Builder {
        match shown(path).to_str() {
            // What begins like an option would be read as one.
            Some(text) if text.starts_with('-') => self.words.push(format!("./{text}")),
            Some(text) => self.words.push(text.to_string()),
            None => self.possible = false,
        }
        self
    }

    /// The command; `None` where it would not work as it stands.
    pub fn build(self) -> Option<Offered> {
        let takes = || Cli::try_parse_from(std::iter::once("backdrive").chain(self.words.iter().map(String::as_str))).is_ok();
        (self.possible && takes()).then_some(())?;
        Some(Offered::of(self.words))
    }
}

/// The arguments of this program, or those with which a caller in the same process called a verb.
pub fn own_arguments() -> Vec<OsString> {
    match caller::caller() {
        Some(caller) => caller.arguments().into_iter().map(OsString::from).collect(),
        None => called().arguments.clone(),
    }
}

/// The command line of this process, for the foot of a page; `None` where a caller in the same process gave no arguments.
pub fn own_command() -> Option<String> {
    let words: Vec<String> = own_arguments().iter().map(|w| shell_word(&w.to_string_lossy())).collect();
    (!words.is_empty()).then(|| format!("backdrive {}", words.join(" ")))
}

/// A path as a user types it: relative where it lies below the working folder.
pub fn shown(path: &Path) -> PathBuf {
    let below = std::env::current_dir().ok().and_then(|here| path.strip_prefix(here).ok().map(Path::to_path_buf));
    match below {
        Some(below) if below.as_os_str().is_empty() => PathBuf::from("."),
        Some(below) => below,
        None => path.to_path_buf(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_cut_them() {
        assert_eq!(shell_word("out/run-1.mcap"), "out/run-1.mcap");
        assert_eq!(shell_word("my run.mcap"), "'my run.mcap'");
        assert_eq!(shell_word("x [mm]"), "'x [mm]'");
        assert_eq!(shell_word("it's"), "'it'\\''s'");
        assert_eq!(shell_word(""), "''");
    }

    #[test]
    fn only_what_can_be_pasted_is_offered() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("a bag.mcap");
        std::fs::write(&there, "").unwrap();
        let replay = || Builder::verb("replay").reads(&there);
        let text = replay().option("--lambda", 0.5).build().unwrap().to_string();
        assert_eq!(text, format!("backdrive replay '{}' --lambda 0.5", there.display()));
        // An option without its value, one that there is not, a value that is none, a file that is not there.
        assert_eq!(replay().flag("--lambda").build(), None);
        assert_eq!(replay().option("--lambad", 0.5).build(), None);
        assert_eq!(replay().option("--lambda", "LAMBDA").build(), None);
        assert_eq!(Builder::verb("replay").reads(&folder.path().join("none.mcap")).build(), None);
    }

    #[test]
    fn an_option_is_changed_however_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let words = |list: &[&str]| Builder { words: list.iter().map(|w| w.to_string()).collect(), possible: true };
        let bag = folder.path().join("x.mcap");
        std::fs::write(&bag, "").unwrap();
        let bag = bag.display().to_string();
        for given in [&["replay", &bag, "--lambda", "3", "--json"][..], &["replay", &bag, "--lambda=3", "--json"]] {
            let changed = words(given).option("--lambda", 1).without("--json", false).build().unwrap();
            assert_eq!(changed.to_string(), format!("backdrive replay {} --lambda 1", shell_word(&bag)));
        }
        let first = folder.path().join("page.html");
        assert_eq!(free(&first), first);
        std::fs::write(&first, "").unwrap();
        assert_eq!(free(&first), folder.path().join("page-2.html"));
    }
}
