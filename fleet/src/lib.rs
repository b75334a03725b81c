//! Many recordings of many units: one stateless answer for each recording, and what the answers show together.
//!
//! A [`manifest`] lists recordings with unit and date. [`answer`] gives one recording's rows: [`triage`], a diagnosis, a fit or the stability of a loop.
//! [`store`] keeps answers by content, so that shards, restarts and several writers give the same [`table`]. [`analysis`] reads that table: parameters of each
//! unit by partial pooling, change points, and units that differ from the others. [`gate`] compares two sets of recordings for continuous integration.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod analysis;
pub mod answer;
pub mod answered;
pub mod date;
pub mod error;
pub mod gate;
pub mod manifest;
pub mod parameter;
pub mod simulated;
pub mod store;
pub mod table;
pub mod triage;
pub mod what;
