//! EMPS.

use crate::table::Report;
use crate::{Context, Study, StudyError};

pub(crate) const STUDY: Study = Study {
    name: "emps",
    about: "a ball-screw axis, the field's reference benchmark: what its published models leave out",
    needs: ("emps", &["emps_train.csv", "emps_test_pulses.csv"]),
    run,
};

fn run(_: &Context) -> Result<Report, StudyError> {
    Ok(Report::new("EMPS"))
}
