//! Whether samples may be lost.

/// Whether samples may be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// Nothing is lost, and a lost packet holds up what follows: lockstep.
    Reliable,
    /// Samples may be lost and are never waited for: real time.
    BestEffort,
}
