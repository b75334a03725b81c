//! Shares of the work of a search.

use crate::output_error::work::{Budget, Steps};

/// How much work a search may do.
pub(super) struct Work<'a> {
    pub budget: Budget<'a>,
}

impl<'a> Work<'a> {
    /// So much of it.
    pub fn share(&self, share: f64) -> Steps {
        (share * self.budget.end() as f64) as Steps
    }

    /// A budget that ends when so much of it is gone.
    pub fn up_to(&self, share: f64) -> Budget<'a> {
        self.budget.extended(self.share(share))
    }

    /// Whether so much of it is gone, or the search is to stop.
    pub fn is_past(&self, share: f64) -> bool {
        self.up_to(share).is_over()
    }
}
