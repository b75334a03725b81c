//! A problem that was turned round: its motion as input, its force as output; [`crate::equation_error`] does that.

use super::Problem;
use backdrive_plant::write::{Edit, Value};
use std::sync::Arc;

/// What a problem that was turned round is of.
#[derive(Debug, Clone)]
pub struct Inverse {
    /// The problem as it was recorded.
    pub recorded: Arc<Problem>,
    /// The output that is now the motion.
    pub motion: String,
    /// The input that is now compared; the first where several forces act on the body.
    pub force: String,
}

impl Inverse {
    /// Edits of the model that was turned round, as those of the model as its file has it. A motion that is ahead of its recording is a force that acts late; the
    /// other way round no model of a device that is driven by forces can have it.
    pub fn in_file(&self, edits: Vec<Edit>) -> Vec<Edit> {
        let delay = format!("inputs.{}.delay", self.motion);
        let one = |edit: Edit| match edit {
            Edit::Set { path, value: Value::Number(late), comment } if path == delay => {
                let path = format!("inputs.{}.delay", self.force);
                (late < 0.0).then_some(Edit::Set { path, value: Value::Number(-late), comment })
            }
            other => Some(other),
        };
        edits.into_iter().filter_map(one).collect()
    }
}
