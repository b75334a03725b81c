//! Graph files: which nodes there are, what each runs, how they are connected, at which rate and gains.
//!
//! `parse` reads a file, `overrides` writes the command line's changes into it, `check` refuses what cannot
//! run, `draw` shows it.

pub mod bench;
mod check;
mod choices;
mod controller;
pub mod coupling;
mod draw;
mod files;
mod hosts;
mod kinds;
mod overrides;
mod parse;
mod recorded;
mod swap;
mod together;
mod types;

pub use check::step_order;
pub use choices::{Hand, Limits, Sensors};
pub use draw::draw;
pub use files::Files;
pub use kinds::{Direction, NodeKind, PortKind, StageKind};
pub use overrides::{Overrides, with_files_renamed};
pub use parse::MAX_RATE_HZ;
pub use types::{Connection, DeviceFiles, Experiment, Graph, Host, Node, ObserverFiles, RealDevice, Settings};
