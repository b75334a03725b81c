//! What is asked of each recording.

use std::fmt;
use std::str::FromStr;

/// What is asked of each recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// Audit, common parameters by regression, and the residual: a few hundredths of a second.
    Triage,
    /// A whole diagnosis.
    Diagnose,
    /// The model's parameters, its structure unchanged.
    Fit,
    /// The stability of a recorded loop.
    Stability,
}

impl What {
    /// All of them.
    pub const ALL: [What; 4] = [What::Triage, What::Diagnose, What::Fit, What::Stability];

    /// Its name on the command line, and that of its table.
    pub fn name(self) -> &'static str {
        match self {
            What::Triage => "triage",
            What::Diagnose => "diagnose",
            What::Fit => "fit",
            What::Stability => "stability",
        }
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for What {
    type Err = String;

    fn from_str(text: &str) -> Result<What, String> {
        let names: Vec<&str> = What::ALL.iter().map(|what| what.name()).collect();
        What::ALL.into_iter().find(|what| what.name() == text).ok_or_else(|| format!("{text:?} is none of {}", names.join(", ")))
    }
}
