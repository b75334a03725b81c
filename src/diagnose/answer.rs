//! What a diagnosis reports beside its verdict: what to do next.

use crate::failure::Failure;
use crate::offered::{Step, lines};
use crate::output;
use backdrive_diagnosis::verdict::Verdict;
use serde::Serialize;

/// What `--json` prints: the verdict as its file has it, and what to do next.
#[derive(Serialize)]
pub struct Answer<'a> {
    /// The verdict.
    #[serde(flatten)]
    pub verdict: &'a Verdict,
    /// What to do next.
    pub next: &'a [Step],
}

/// Prints the steps that a command does.
///
/// # Errors
/// Standard output cannot be written.
pub fn to_do(steps: &[Step]) -> Result<(), Failure> {
    let with_commands: Vec<Step> = steps.iter().filter(|step| !step.commands.is_empty()).cloned().collect();
    lines("to do", 10, &with_commands).iter().try_for_each(output::line)
}
