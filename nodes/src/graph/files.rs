//! Where the files come from that a graph names.

use backdrive_plant::tomlfile::{FileError, read_text};
use std::path::Path;

/// Where the files that a graph names are read from: the disk, or a bag that holds them.
pub enum Files<'a> {
    /// The file system.
    Disk,
    /// (path as in the graph's text, text); what is not there is read from the disk.
    Bag(&'a [(String, String)]),
}

impl Files<'_> {
    /// Whether the bag holds a file of this name.
    pub(super) fn holds(&self, name: &str) -> bool {
        matches!(self, Files::Bag(files) if files.iter().any(|(file, _)| file == name))
    }

    /// What `read` makes of a file's text, its name and its folder. The first time a text goes into `seen` from which the same is read without a folder: the
    /// file's own, or where it names further files (a robot, a network), what `written` makes of it. So what a bag holds stands alone.
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
        let held = match self {
            Files::Disk => None,
            Files::Bag(files) => files.iter().find(|(file, _)| *file == name).map(|(_, text)| text.clone()),
        };
        let text = match held {
            Some(text) => text,
            None => read_text(path)?,
        };
        if !seen.iter().any(|(file, _)| *file == name) {
            seen.push((name, text.clone()));
        }
        Ok(text)
    }
}
