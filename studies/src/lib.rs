//! Studies: recordings of real devices, diagnosed by the code of `backdrive diagnose` and compared with the published results.
//!
//! A study is a folder of `studies/` (model files, sets, a README with its table) and a file here with a line in [`STUDIES`]. The recordings are not
//! part of the project: [`data::Data`] knows where they are searched.

pub mod csv_columns;
pub mod data;
pub mod run;
pub mod table;

mod error;
mod study;

mod ball_screw;
mod brfd_friction_damper;
mod dfki_double_pendulum;
mod emps;
mod engine_bench;
mod kuka_kr300;
mod machines;
mod odrive_cogging;
mod papers;
mod piezo_p885;
mod silverbox;
pub mod steering;
mod tue_bilateral;

pub use error::StudyError;
pub use study::{Context, Study};

use data::Data;
use std::path::Path;
use table::Report;

/// Every study; a new one has its line here.
pub const STUDIES: &[&Study] = &[
    &ball_screw::STUDY,
    &brfd_friction_damper::STUDY,
    &dfki_double_pendulum::STUDY,
    &emps::STUDY,
    &kuka_kr300::STUDY,
    &machines::STUDY,
    &odrive_cogging::STUDY,
    &piezo_p885::STUDY,
    &silverbox::STUDY,
    &tue_bilateral::STUDY,
    &papers::ball_screw::STUDY,
    &papers::steering_compensator::STUDY,
    &papers::impulse_engine::STUDY,
    &papers::engine_bench::STUDY,
    &engine_bench::STUDY,
    &steering::STUDY,
];

/// Names of all studies, separated by commas.
fn names() -> String {
    STUDIES.iter().map(|s| s.name).collect::<Vec<_>>().join(", ")
}

/// The study of a name.
///
/// # Errors
/// When there is none.
pub fn study_named(name: &str) -> Result<&'static Study, StudyError> {
    STUDIES.iter().copied().find(|s| s.name == name).ok_or_else(|| StudyError::Unknown { name: name.to_string(), known: names() })
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
