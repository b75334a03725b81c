//! What was found of one part of the machine.

use serde::Serialize;
use std::fmt;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// As it should be.
    Fine,
    /// A run works, less well than it could.
    Weak,
    /// Some runs do not work.
    Bad,
}

/// What was found of one part of the machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    part: &'static str,
    /// How much it matters.
    pub grade: Grade,
    /// What was found.
    pub found: String,
    /// What to do about it; empty where all is fine.
    pub advice: String,
}

impl Finding {
    pub(super) fn fine(part: &'static str, found: impl Into<String>) -> Finding {
        Finding { part, grade: Grade::Fine, found: found.into(), advice: String::new() }
    }

    pub(super) fn weak(part: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Finding {
        Finding { part, grade: Grade::Weak, found: found.into(), advice: advice.into() }
    }

    pub(super) fn bad(part: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Finding {
        Finding { grade: Grade::Bad, ..Finding::weak(part, found, advice) }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let grade = match self.grade {
            Grade::Fine => "fine",
            Grade::Weak => "weak",
            Grade::Bad => "BAD ",
        };
        write!(f, "{grade}  {:<14} {}", self.part, self.found)?;
        if self.advice.is_empty() { Ok(()) } else { write!(f, "\n{:>22}{}", "", self.advice) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_says_what_to_do_below_it() {
        let told = Finding::weak("timer slack", "50 us", "nothing").to_string();
        assert!(told.starts_with("weak  timer slack") && told.ends_with("\n                      nothing"), "{told}");
    }
}
