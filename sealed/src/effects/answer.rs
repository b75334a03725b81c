//! One right answer.

use super::site::Site;
use serde::{Deserialize, Serialize};

/// One right answer. The first one of an effect is the effect itself, in the nearest words that verdicts have; others say the
/// same in other words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The place, as `between` or `signal`.
    #[serde(flatten)]
    pub site: Site,
    /// Names of effects, in the vocabulary of verdicts, any of which is right here; or the word of a verdict that names none: `parameters`, `none`.
    pub physics: Vec<String>,
    /// Names that findings at the same place must have besides, all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub together_with: Vec<String>,
    /// Whether it is right only where the recordings do not contain the hand's motion.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hand_hidden: bool,
}

impl Answer {
    /// These names at a place, whatever the recordings contain.
    pub(crate) fn at(site: &Site, physics: &[&str]) -> Answer {
        let physics = physics.iter().map(|name| name.to_string()).collect();
        Answer { site: site.clone(), physics, together_with: Vec::new(), hand_hidden: false }
    }
}
