//! Answers kept by content: what was answered once is not computed again, by whichever process, and a process that is killed loses no finished answer.
//!
//! `answers/KEY.json` is an answer; its key is the SHA-256 of version, question, options, model and recording. `done/NAME.json` points from a recording's
//! name to its key. Both are written under another name and moved to their own, so that a reader never sees half a file and two writers never mix.

mod kept;
mod key;
mod run;

pub use kept::Store;
pub use key::{Keys, Version};
pub use run::{Done, Progress, Work, run};
