//! What a comparison gave.

use backdrive_stability::compare::Cell;

/// What was compared, for text, page and JSON.
pub struct Compared<'a> {
    /// The file.
    pub session: String,
    /// What the hand does there.
    pub title: &'a str,
    /// mu and lambda at which the results are given.
    pub gains: [f64; 2],
    /// Highest mu*lambda up to which critical gains were searched.
    pub highest: f64,
    /// The cells that were done, condition by condition.
    pub cells: &'a [Cell],
    /// How many were asked for.
    pub asked: usize,
    /// What a reader has to know.
    pub notes: &'a [String],
}
