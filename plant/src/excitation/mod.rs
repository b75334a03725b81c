//! Excitation of a device: named excitations as functions of time.
//!
//! An excitation is written `sweep:amplitude=2,from=1,to=200,duration=10` on a command line, and as a table with
//! `kind = "sweep"` in a file. Amplitudes are in the unit of the input that is driven (N, N m, m or rad).

mod error;
mod multisine;
mod parse;
mod shape;
mod shapes;
mod signal;

pub use error::ExcitationError;
pub use parse::{Experiment, load_experiments};
pub use shape::{Grid, Shape, Spacing};
pub use signal::{Excitation, Signal};
