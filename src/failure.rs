//! Why a command fails, and its exit code.

use backdrive_answers::error::AnswerError;
use backdrive_bags::BagError;
use backdrive_inspect::InspectError;
use backdrive_launch::asked::AskedError;
use backdrive_launch::{CarryError, LaunchError};
use backdrive_nodes::build::BuildError;
use backdrive_plant::tomlfile::FileError;
use backdrive_predict::PredictError;
use backdrive_sets::SetError;
use backdrive_stability::summary::SummaryError;
use std::fmt::Display;

/// A command that fails: one message and an exit code.
#[derive(Debug)]
pub struct Failure {
    /// See [`code`].
    pub code: u8,
    /// What was wrong, where, and what to do.
    pub message: String,
}

/// Exit codes.
pub mod code {
    /// The finding is negative: not stable, bags differ.
    pub const NEGATIVE: u8 = 1;
    /// Usage; most of it comes from the argument parser.
    pub const USAGE: u8 = 2;
    /// A file is missing, broken, or does not hold what is needed.
    pub const BAD_INPUT: u8 = 3;
    /// Data was lost.
    pub const LOST_DATA: u8 = 4;
    /// This machine does not let it: shared memory, disk, permission.
    pub const MACHINE: u8 = 5;
    /// A node failed or died.
    pub const NODE: u8 = 6;
    /// The recording does not tell.
    pub const CANNOT_TELL: u8 = 7;
    /// Interrupted by the user.
    pub const INTERRUPTED: u8 = 130;

    /// The word for a code, such as `bad_input`.
    pub fn word(code: u8) -> &'static str {
        match code {
            NEGATIVE => "negative",
            USAGE => "usage",
            BAD_INPUT => "bad_input",
            LOST_DATA => "lost_data",
            MACHINE => "machine",
            NODE => "node",
            CANNOT_TELL => "cannot_tell",
            INTERRUPTED => "interrupted",
            _ => "failed",
        }
    }
}

/// The commands of a message, which stand between backticks.
fn commands_in(message: &str) -> Vec<&str> {
    let quoted = message.split('`').skip(1).step_by(2);
    quoted.filter(|text| text.starts_with("backdrive ") || text.starts_with("kill ")).collect()
}

impl Failure {
    /// A file or an argument is wrong.
    pub fn input(message: impl Display) -> Failure {
        Failure { code: code::BAD_INPUT, message: message.to_string() }
    }

    /// This machine does not let it.
    pub fn machine(message: impl Display) -> Failure {
        Failure { code: code::MACHINE, message: message.to_string() }
    }

    /// A bag or a table cannot be read, or not written.
    pub fn bag(error: BagError) -> Failure {
        let code = match &error {
            BagError::Option(_) => code::USAGE,
            BagError::Create { .. } | BagError::Write { .. } => code::MACHINE,
            BagError::Io { .. }
            | BagError::Exists { .. }
            | BagError::InUse { .. }
            | BagError::NotMcap { .. }
            | BagError::Damaged { .. }
            | BagError::Message { .. }
            | BagError::Encode { .. }
            | BagError::Metadata { .. }
            | BagError::NoSuchIndex { .. }
            | BagError::NoTopic { .. }
            | BagError::Field { .. }
            | BagError::Table { .. }
            | BagError::File { .. }
            | BagError::Recording(_)
            | BagError::Usage(_) => code::BAD_INPUT,
        };
        Failure { code, message: error.to_string() }
    }

    /// For programs, where a verb was asked for JSON and has none to give: what was wrong, and the commands that the message offers.
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "error": { "code": self.code, "kind": code::word(self.code), "message": self.message, "hints": commands_in(&self.message) }
        })
    }

    /// A file of ours cannot be written.
    pub fn write(path: &std::path::Path, error: std::io::Error) -> Failure {
        Failure::machine(format!("{}: cannot be written: {error}", path.display()))
    }
}

impl From<InspectError> for Failure {
    fn from(error: InspectError) -> Failure {
        match error {
            InspectError::Bag(error) => Failure::bag(error),
            InspectError::Recording { .. } => Failure::input(error),
        }
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Failure {
        Failure::input(error)
    }
}

impl From<SetError> for Failure {
    fn from(error: SetError) -> Failure {
        Failure::input(error)
    }
}

impl From<AskedError> for Failure {
    fn from(error: AskedError) -> Failure {
        Failure::input(error)
    }
}

impl From<CarryError> for Failure {
    fn from(error: CarryError) -> Failure {
        match error {
            CarryError::Input(message) => Failure::input(message),
            CarryError::Machine(message) => Failure::machine(message),
            CarryError::Launch(error) => Failure::from(error),
        }
    }
}

impl From<backdrive_stability::asked::AskedError> for Failure {
    fn from(error: backdrive_stability::asked::AskedError) -> Failure {
        Failure::input(error)
    }
}

impl From<backdrive_why::recording::RecordingError> for Failure {
    fn from(error: backdrive_why::recording::RecordingError) -> Failure {
        Failure::input(error)
    }
}

impl From<AnswerError> for Failure {
    fn from(error: AnswerError) -> Failure {
        match error {
            AnswerError::Input(message) => Failure::input(message),
            AnswerError::Usage(message) => Failure { code: code::USAGE, message },
        }
    }
}

impl From<PredictError> for Failure {
    fn from(error: PredictError) -> Failure {
        match error {
            PredictError::Input(message) => Failure::input(message),
            PredictError::Usage(message) => Failure { code: code::USAGE, message },
        }
    }
}

impl From<SummaryError> for Failure {
    fn from(error: SummaryError) -> Failure {
        Failure::input(error)
    }
}

impl From<BuildError> for Failure {
    fn from(error: BuildError) -> Failure {
        Failure::input(error)
    }
}

impl From<LaunchError> for Failure {
    fn from(error: LaunchError) -> Failure {
        let code = match &error {
            LaunchError::RunDir { .. }
            | LaunchError::SharedMemory { .. }
            | LaunchError::Runtime { .. }
            | LaunchError::Network { .. }
            | LaunchError::DomainTaken { .. } => code::MACHINE,
            LaunchError::NoNodes | LaunchError::NoSecret | LaunchError::Spawn { .. } => code::BAD_INPUT,
            LaunchError::NodeFailed { code, .. } => *code,
            LaunchError::NotReady { .. } | LaunchError::DiedAtStart { .. } => code::NODE,
            LaunchError::Stopped { .. } => code::INTERRUPTED,
        };
        Failure { code, message: error.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_as_json_has_its_code_a_word_for_it_and_the_commands_of_its_message() {
        let failure = Failure::machine("/dev/shm is nearly full: run `backdrive clean`, or see `ls`; `backdrive doctor` says more");
        let error = &failure.json()["error"];
        assert_eq!((&error["code"], &error["kind"]), (&5.into(), &"machine".into()));
        assert_eq!(error["hints"], serde_json::json!(["backdrive clean", "backdrive doctor"]));
        assert_eq!(error["message"], failure.message);
    }
}
