//! Where the recordings are.

use crate::{Study, StudyError};
use std::path::{Path, PathBuf};

/// Environment variable with the folder of the recordings.
pub const VARIABLE: &str = "BACKDRIVE_DATA";
/// Where they are looked for without it, from the root of the project.
const BESIDE: &str = "../shared/data";

/// The folder that holds a folder of recordings per device.
#[derive(Debug, Clone)]
pub struct Data {
    root: PathBuf,
    /// How it was found, for the message where something is missing.
    how: String,
}

impl Data {
    /// In the folder of the environment variable, else the caller's folder, else beside the project.
    pub fn find(given: Option<&Path>) -> Data {
        let named = std::env::var_os(VARIABLE).filter(|v| !v.is_empty()).map(PathBuf::from);
        Data::of(named, given)
    }

    fn of(named: Option<PathBuf>, given: Option<&Path>) -> Data {
        match (named, given) {
            (Some(root), _) => Data { root, how: format!("{VARIABLE} names this folder") },
            (None, Some(root)) => Data { root: root.to_path_buf(), how: "--data names this folder".to_string() },
            (None, None) => {
                let project = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."));
                Data { root: project.join(BESIDE), how: format!("set {VARIABLE} or --data to where they are") }
            }
        }
    }

    /// The folder of a study's recordings, all of which are there.
    ///
    /// # Errors
    /// [`StudyError::NoData`] where one is not there.
    pub fn folder(&self, study: &Study) -> Result<PathBuf, StudyError> {
        let (folder, files) = study.needs;
        let path = self.root.join(folder);
        match files.iter().find(|f| !path.join(f).is_file()) {
            None => Ok(path.canonicalize().unwrap_or(path)),
            Some(file) => Err(StudyError::NoData(format!(
                "{}: the recordings are not here: there is no {} ({}); studies/{}/README.md says where the public originals are",
                study.name,
                path.join(file).display(),
                self.how,
                study.name
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variable_leads_then_the_option() {
        let given = Path::new("/given");
        assert_eq!(Data::of(Some("/named".into()), Some(given)).root, Path::new("/named"));
        assert_eq!(Data::of(None, Some(given)).root, given);
        assert!(Data::of(None, None).root.ends_with(BESIDE));
    }

    #[test]
    fn absent_recordings_are_told_with_what_to_do() {
        for study in crate::STUDIES.iter().filter(|s| !s.needs.1.is_empty()) {
            let error = Data::of(None, Some(Path::new("/nowhere"))).folder(study).unwrap_err();
            assert!(matches!(&error, StudyError::NoData(text) if text.contains(study.name) && text.contains("--data")), "{error}");
        }
    }
}
