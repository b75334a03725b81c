//! Devices as networks of bodies and elements.
//!
//! A [`model::Model`] is what a model file says. It compiles to a stepper, is linearised, is driven
//! by a recording or an excitation, and takes fragments (a grip, an environment) at a port.

pub mod elements;
pub mod model;
