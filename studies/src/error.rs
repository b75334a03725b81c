//! Why a study has no result.

use backdrive::failure::{Failure, code};

/// Why a study has no result.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The recordings are not here; the study is to be skipped.
    #[error("{0}")]
    NoData(String),
    /// There is no study of this name.
    #[error("there is no study \"{name}\"; there are {known}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// Names of all studies, separated by commas.
        known: String,
    },
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
            StudyError::Unknown { .. } | StudyError::File(_) | StudyError::Format(_) => code::BAD_INPUT,
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

impl From<backdrive_runs::RunError> for StudyError {
    fn from(error: backdrive_runs::RunError) -> StudyError {
        StudyError::Failure(error.into())
    }
}

/// A failed step of a study with its error.
pub(crate) fn failed(error: impl std::fmt::Display) -> StudyError {
    StudyError::Diagnosis(error.to_string())
}
