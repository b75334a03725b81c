//! A stable gain that was measured, with a canceller and a hand.

use serde::{Serialize, Serializer};

/// Name of the diagnosed canceller that estimates the hand.
pub const ESTIMATED: &str = "hand estimated";

/// How a hand holds in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hand {
    /// As firmly as in the session, times this factor.
    Grip(f64),
    /// It changes its grip while it pushes.
    Changing,
}

impl Hand {
    /// The hand of the session.
    pub const SESSION: Hand = Hand::Grip(1.0);
}

impl std::fmt::Display for Hand {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Hand::Grip(factor) => write!(f, "grip x{factor}"),
            Hand::Changing => write!(f, "changing grip"),
        }
    }
}

impl Serialize for Hand {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self {
            Hand::Grip(factor) => to.serialize_f64(*factor),
            Hand::Changing => to.serialize_str("changing"),
        }
    }
}

/// A stable gain that was measured.
#[derive(Debug, Clone, Serialize)]
pub struct Gain {
    /// Which canceller.
    pub canceller: &'static str,
    /// The hand: a factor on the true grip of the session, or `changing`.
    #[serde(rename = "grip")]
    pub hand: Hand,
    /// Highest mu*lambda found stable; 0 where not even the lowest of the search was.
    pub stable_to: f64,
    /// What ends the stable range, or that nothing does.
    pub because: String,
    /// Whether nothing ended it.
    pub whole_range: bool,
}
