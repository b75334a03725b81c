//! Where the files come from that a graph names.

use backdrive_plant::tomlfile::{FileError, read_text};
use std::path::Path;

/// Where the files that a graph names are read from: the disk, or a bag that holds them.
pub enum Files<'a> {
    /// The file system.
    Disk,
    /// (path as in the graph's text, text) of every file in the bag. A bag may come from a stranger, so that nothing that its graph names is ever read from
    /// the disk; what the user exchanges with an option is.
    Bag(&'a [(String, String)]),
}

/// The files of one graph: where they are read from, and which of them the user chose.
pub(super) struct Sources<'a> {
    pub(super) files: &'a Files<'a>,
    /// Names that the command line put in, which are read from the disk whatever the graph comes from.
    pub(super) chosen: Vec<String>,
    /// The graph, for errors.
    pub(super) of: String,
}

impl Files<'_> {
    /// The text of a file in the bag.
    fn held(&self, name: &str) -> Option<&str> {
        match self {
            Files::Disk => None,
            Files::Bag(files) => files.iter().find(|(file, _)| file == name).map(|(_, text)| text.as_str()),
        }
    }

    /// Whether a name is one on the disk.
    pub(super) fn are_on_disk(&self) -> bool {
        matches!(self, Files::Disk)
    }
}

impl Sources<'_> {
    /// What `read` makes of a file's text, its name and its folder. The first time, a text from which the same is read without a folder goes into `seen`. It
    /// is the file's own text, or, where it names further files (a robot, a network), the output of `written`. So what a bag holds stands alone.
    pub(super) fn read_whole<T>(
        &self,
        path: &Path,
        seen: &mut Vec<(String, String)>,
        read: impl Fn(&str, &str, Option<&Path>) -> Result<T, FileError>,
        written: impl Fn(&T) -> String,
    ) -> Result<T, FileError> {
        let (name, mut read_here) = (path.display().to_string(), Vec::new());
        let text = self.read(path, &mut read_here)?;
        let (whole, alone) = match read(&text, &name, None) {
            Ok(whole) => (whole, text),
            // What a file in a bag names besides is not looked for outside of the bag.
            Err(error) if self.files.held(&name).is_some() => return Err(error),
            Err(_) => {
                let whole = read(&text, &name, path.parent())?;
                let alone = written(&whole);
                (whole, alone)
            }
        };
        if !seen.iter().any(|(file, _)| *file == name) {
            seen.push((name, alone));
        }
        Ok(whole)
    }

    /// The text of a file; the first time it goes into `seen`.
    pub(super) fn read(&self, path: &Path, seen: &mut Vec<(String, String)>) -> Result<String, FileError> {
        let name = path.display().to_string();
        let text = match self.files.held(&name) {
            Some(text) => text.to_owned(),
            None if self.files.are_on_disk() || self.chosen.contains(&name) => read_text(path)?,
            None => {
                let what = "which is not in the bag. Files outside a bag are never read; exchange the part with an option, or record the \
                            run again";
                return Err(FileError::whole(&self.of, format!("its graph names the file \"{name}\", {what}")));
            }
        };
        if !seen.iter().any(|(file, _)| *file == name) {
            seen.push((name, text.clone()));
        }
        Ok(text)
    }
}
