//! A window on a running loop, and on bags: a page on the loopback interface with strip charts, the devices drawn to scale, gains and a stop.
//!
//! - `tap`: what a run sends, taken over beside the recorder; `decimate`: minima and maxima of 1/60 s; `picture`: what a viewer has to be shown
//! - `steer`: what a viewer may change, and its bounds; `access`: who may
//! - `serve`: the page and its WebSocket; `frames`: what goes over it; `page`: the page itself
//! - `scene`: what is drawn, and where its walls stand
//! - `bag`: the same page on recordings
//! - `onset`: when a loop begins to shake; `heal`: why, and what is done about it

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod access;
pub mod bag;
mod channels;
mod decimate;
mod error;
mod frames;
pub mod heal;
mod hub;
mod onset;
mod page;
mod picture;
pub mod run;
mod scene;
mod serve;
mod steer;
mod tap;

pub use error::LiveError;
pub use steer::Bounds;
