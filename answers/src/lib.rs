//! One diagnosis for any device: a question is opened, searched, and answered as files and words.
//!
//! [`open()`](opened::open) reads what a question [`asks`](asked::Asked), and decides by the model and the columns of the recordings what the device is:
//! one axis, an arm, or servo joints. [`diagnose`](found::diagnose) searches. What it gives has the same form for all three. Nothing is written here.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod asked;
pub mod checks;
pub mod error;
pub mod found;
pub mod opened;
pub mod sentences;
mod text;
