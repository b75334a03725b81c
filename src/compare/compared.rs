//! What a comparison gave.

use backdrive_stability::compare::Cell;

/// What was compared, for text, page and JSON.
pub(super) struct Compared<'a> {
    /// The file.
    pub(super) session: String,
    /// What the hand does there.
    pub(super) title: &'a str,
    /// mu and lambda at which the numbers are told.
    pub(super) gains: [f64; 2],
    /// Highest mu*lambda up to which edges were looked for.
    pub(super) highest: f64,
    /// The cells that were done, condition by condition.
    pub(super) cells: Vec<Cell>,
    /// How many were asked for.
    pub(super) asked: usize,
    /// What a reader has to know.
    pub(super) notes: &'a [String],
}
