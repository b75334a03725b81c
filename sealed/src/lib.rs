//! The hidden plant: a device whose joints hide effects that the fitting side does not know.
//!
//! A [`network::Network`] is the content of a nominal model file. [`draw::draw`] draws a [`truth::Truth`] for it from a seed: hidden effects,
//! parameters that differ from the file's, another grip, sensors. [`seal::seal`] turns the truth into bytes and their SHA-256 before anything moves.
//! A [`plant::SealedPlant`] is the device that the truth describes, and a [`master::SealedMaster`] is what a graph sees of it. [`process`] has it in
//! a process of its own, the only one that reads the truth.
//!
//! The crate shares nothing with the code that fits and diagnoses but the file formats. SI units throughout; on a rotational axis
//! every N, kg and m reads N m, kg m2 and rad. The force of an element is positive when `between[0]` is ahead of `between[1]`: it
//! pushes the first body back and the second one on.

#![warn(missing_docs)]

pub mod draw;
pub mod effects;
pub mod laws;
pub mod master;
pub mod network;
pub mod plant;
pub mod process;
pub mod seal;
pub mod truth;
