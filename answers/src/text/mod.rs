//! What was found in lines for a terminal, by the kind of the device.

pub(crate) mod arm;
pub(crate) mod one_axis;
pub(crate) mod search;
pub(crate) mod servo;
