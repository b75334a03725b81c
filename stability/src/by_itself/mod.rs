//! Every node of a graph by itself: what it makes of its recorded inputs, beside what was recorded of it.
//!
//! Here is the one place where a recorded signal is compared with its graph. `stability`, `replay` and the others that judge ask [`against`], `why` looks
//! closer for what it is that differs.

pub mod against;
pub mod alone;
pub mod compared;
mod devices;
pub mod recorded;
pub mod shapes;
mod ways;
mod windows;
