//! Studies: recordings of real devices, diagnosed by the code of `backdrive diagnose` and held against what was published of them.
//!
//! A study is a folder of `studies/` (model files, sets, a README with its table) and a file here with a line in [`STUDIES`]. The recordings
//! are not part of the project: [`data::Data`] says where they are looked for.

pub mod csv_columns;
pub mod data;
pub mod filter;
pub mod run;
pub mod table;

mod ball_screw;
mod brfd_friction_damper;
mod emps;
mod engine_bench;
mod kuka_kr300;
mod odrive_cogging;
mod papers;
mod piezo_p885;
mod silverbox;
pub mod steering;

use backdrive::failure::{Failure, code};
use data::Data;
use std::path::Path;
use table::Report;

/// A study.
pub struct Study {
    /// Its name: of its folder in `studies/`, and on the command line.
    pub name: &'static str,
    /// What it shows, in one line.
    pub about: &'static str,
    /// Folder of its recordings in the data folder, and the files it needs from there; none where it makes its recordings itself.
    pub needs: (&'static str, &'static [&'static str]),
    /// Runs it: where its recordings are, where its results go.
    run: fn(&Context) -> Result<Report, StudyError>,
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

/// Every study; a new one has its line here.
pub const STUDIES: &[&Study] = &[
    &ball_screw::STUDY,
    &brfd_friction_damper::STUDY,
    &emps::STUDY,
    &kuka_kr300::STUDY,
    &odrive_cogging::STUDY,
    &piezo_p885::STUDY,
    &silverbox::STUDY,
    &papers::ball_screw::STUDY,
    &papers::steering_compensator::STUDY,
    &papers::impulse_engine::STUDY,
    &papers::engine_bench::STUDY,
    &engine_bench::STUDY,
    &steering::STUDY,
];

/// Why a study has no result.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The recordings are not here; the study is to be skipped.
    #[error("{0}")]
    NoData(String),
    /// There is no study of this name.
    #[error("there is no study \"{0}\"; there are {names}", names = names())]
    Unknown(String),
    /// A file cannot be read, or does not hold what is needed.
    #[error("{0}")]
    File(String),
    /// A file or folder of results cannot be written.
    #[error("{0}")]
    Write(String),
    /// A file of the format of models, sets or recordings is wrong.
    #[error(transparent)]
    Format(#[from] backdrive_plant::tomlfile::FileError),
    /// The diagnosis failed.
    #[error("{0}")]
    Diagnosis(String),
    /// What `backdrive diagnose` would fail with.
    #[error("{}", .0.message)]
    Failure(Failure),
}

impl StudyError {
    /// The exit code of `study`, as `backdrive` has them ([`code`]).
    pub fn code(&self) -> u8 {
        match self {
            StudyError::NoData(_) | StudyError::Diagnosis(_) => code::CANNOT_TELL,
            StudyError::Unknown(_) | StudyError::File(_) | StudyError::Format(_) => code::BAD_INPUT,
            StudyError::Write(_) => code::MACHINE,
            StudyError::Failure(failure) => failure.code,
        }
    }
}

impl From<Failure> for StudyError {
    fn from(failure: Failure) -> StudyError {
        StudyError::Failure(failure)
    }
}

/// Names of all studies, separated by commas.
fn names() -> String {
    STUDIES.iter().map(|s| s.name).collect::<Vec<_>>().join(", ")
}

/// The study of a name.
///
/// # Errors
/// When there is none.
pub fn study_named(name: &str) -> Result<&'static Study, StudyError> {
    STUDIES.iter().copied().find(|s| s.name == name).ok_or_else(|| StudyError::Unknown(name.to_string()))
}

impl Study {
    /// Runs the study, or of a long one its short part; its results go into a folder of its name in `out`, beside a `table.md`. Each search may
    /// last `longer` times as long as usual, above 0.
    ///
    /// # Errors
    /// [`StudyError::NoData`] where the recordings are not here; else when a file or the diagnosis fails.
    pub fn run(&self, data: &Data, out: &Path, quick: bool, longer: f64) -> Result<Report, StudyError> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(self.name);
        let recordings = data.folder(self)?;
        let out = out.join(self.name);
        std::fs::create_dir_all(&out).map_err(|e| StudyError::Write(format!("{}: cannot be made: {e}", out.display())))?;
        let report = (self.run)(&Context { folder: &folder, data: &recordings, out: &out, quick, longer })?;
        run::write(&out.join("table.md"), &report.markdown())?;
        Ok(report)
    }
}
