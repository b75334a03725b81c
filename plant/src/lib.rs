//! Devices as networks of bodies and elements.
//!
//! A [`model::Model`] is the content of a model file. It compiles to a stepper, is linearised, is driven by a recording or an excitation, and takes
//! fragments (a grip, an environment) at a port.

// Printing panics where the other end is full or gone.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

pub mod correlation;
pub mod describe;
pub mod elements;
pub mod excitation;
pub mod fragment;
pub mod input_file;
pub mod isolate;
pub mod linear;
pub mod load;
pub mod model;
pub mod parse;
pub mod preisach;
pub mod recording;
pub mod robot;
pub mod servo;
pub mod set;
pub mod stepper;
pub mod tomlfile;
pub mod write;
