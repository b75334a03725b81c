//! The pages of backdrive: sections made of verdicts, runs and comparisons, on top of the base that `backdrive_report` gives.
//!
//! A page is a pure function from what was found to a [`backdrive_report::Page`]. It knows neither the command line nor files.
//! Words and numbers that a terminal shows in the same way are public here, so that both say the same.
//!
//! [`offered`] has the commands that a page offers, [`parts`] what all pages have, and one module a page follows.

pub mod compare;
pub mod diagnose;
pub mod fleet;
pub mod inspect;
pub mod offered;
pub mod parts;
pub mod prove;
pub mod run;
pub mod stability;
pub mod why;
