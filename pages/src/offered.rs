//! What to do next, with commands that can be pasted. Who offers one has checked that the command line takes it.

use backdrive_bags::shell_word;
use serde::{Serialize, Serializer};
use std::fmt::{self, Display};

/// A command of this program that can be pasted as it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Offered(Vec<String>);

impl Offered {
    /// A command of these words, the verb first. The caller has checked that the command line takes them.
    pub fn of(words: Vec<String>) -> Offered {
        Offered(words)
    }

    /// Whether it is a command of this verb.
    pub fn is(&self, verb: &str) -> bool {
        self.0.first().is_some_and(|word| word == verb)
    }
}

impl Display for Offered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "backdrive")?;
        self.0.iter().try_for_each(|word| write!(f, " {}", shell_word(word)))
    }
}

impl Serialize for Offered {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

/// What to do next: a sentence, and the commands that do it, in their order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Step {
    /// The sentence.
    #[serde(rename = "do")]
    pub sentence: String,
    /// The commands; empty where no command does it.
    pub commands: Vec<Offered>,
}

impl Step {
    /// A sentence with the commands that do it; where one of them cannot be offered, none is.
    pub fn new(sentence: impl Into<String>, commands: impl IntoIterator<Item = Option<Offered>>) -> Step {
        let commands: Option<Vec<Offered>> = commands.into_iter().collect();
        Step { sentence: sentence.into(), commands: commands.unwrap_or_default() }
    }

    /// A sentence alone.
    pub fn said(sentence: impl Into<String>) -> Step {
        Step::new(sentence, [])
    }

    /// The commands as a shell takes them, one a line; `None` where there are none.
    pub fn pasted(&self) -> Option<String> {
        let lines: Vec<String> = self.commands.iter().map(Offered::to_string).collect();
        (!lines.is_empty()).then(|| lines.join("\n"))
    }
}
