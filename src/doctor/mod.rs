//! `backdrive doctor`: what of this machine would hurt a run.

mod machine;
mod net;

use crate::cli;
use crate::failure::{Failure, code};
use crate::network::network;
use crate::output;
use serde::Serialize;
use std::fmt;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
enum Grade {
    /// As it should be.
    Fine,
    /// A run works, less well than it could.
    Weak,
    /// Some runs do not work.
    Bad,
}

/// What was found of one part of the machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Finding {
    part: &'static str,
    grade: Grade,
    /// What was found.
    found: String,
    /// What to do about it; empty where all is fine.
    advice: String,
}

impl Finding {
    fn fine(part: &'static str, found: impl Into<String>) -> Finding {
        Finding { part, grade: Grade::Fine, found: found.into(), advice: String::new() }
    }

    fn weak(part: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Finding {
        Finding { part, grade: Grade::Weak, found: found.into(), advice: advice.into() }
    }

    fn bad(part: &'static str, found: impl Into<String>, advice: impl Into<String>) -> Finding {
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

/// Looks at shared memory, real-time rights, timers, processors, network and clock. Exit code 0 unless something is bad, then 5.
pub fn doctor(options: &cli::Doctor) -> Result<u8, Failure> {
    let network = network(&options.network)?;
    let mut findings = machine::look();
    findings.extend(net::look(&network, options.listen_s));
    if options.json {
        output::json(&findings)?;
    } else {
        findings.iter().try_for_each(output::line)?;
    }
    Ok(if findings.iter().any(|f| f.grade == Grade::Bad) { code::MACHINE } else { 0 })
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
