//! Feetech STS/SMS and SCS servos: frames, registers and the bus.

mod bus;
pub mod frame;
pub mod registers;

pub use bus::Feetech;
