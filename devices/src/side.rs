//! On which side of the loop a device is.

/// On which side of the loop a device is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Inputs `intent` (not heard: the hand is a real one) and `force`; outputs `measured` and `user` (not known).
    Master,
    /// Inputs `command` and `force`; output `measured`.
    Slave,
}
