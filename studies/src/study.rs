//! A study, and what it is given.

use crate::error::StudyError;
use crate::table::Report;
use std::path::Path;

/// A study.
pub struct Study {
    /// Its name: of its folder in `studies/`, and on the command line.
    pub name: &'static str,
    /// What it shows, in one line.
    pub about: &'static str,
    /// Folder of its recordings in the data folder, and the files it needs from there; none where it makes its recordings itself.
    pub needs: (&'static str, &'static [&'static str]),
    /// Runs it: where its recordings are, where its results go.
    pub(crate) run: fn(&Context) -> Result<Report, StudyError>,
}

/// What a study is given.
pub struct Context<'a> {
    /// The folder of its models and sets.
    pub folder: &'a Path,
    /// The folder of its recordings.
    pub data: &'a Path,
    /// The folder for its results, which is there.
    pub out: &'a Path,
    /// Whether only the short part is wanted, less than half a minute on a machine that is free.
    pub quick: bool,
    /// How many times more than usual each search may compute.
    pub longer: f64,
}
