//! Motors with the frames of the MIT mini cheetah over CAN, as Damiao and others speak them.

mod bus;
pub mod can;
pub mod frame;

pub use bus::Mit;
