//! What every report on a diagnosis is given beside the results.

use crate::offered::Step;

/// What stands around the results.
pub(super) struct About<'a> {
    /// The set, for the title.
    pub name: &'a str,
    /// What a reader should know first.
    pub notes: &'a [&'a str],
    /// What to do next.
    pub steps: &'a [Step],
}
