//! Dynamixel servos of the X series over protocol 2: frames, registers and the bus.

mod bus;
pub mod frame;
pub mod registers;

pub use bus::Dynamixel;
