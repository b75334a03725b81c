//! What was commanded of one joint and where it stood, with what gravity does to it there.

/// A recording of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The file, as the set names it.
    pub name: String,
    /// Times of the samples, s; rising.
    pub t: Vec<f64>,
    /// Commanded position, rad or m: held from its sample to the next.
    pub command: Vec<f64>,
    /// Recorded position, rad or m.
    pub position: Vec<f64>,
    /// Torque of gravity at the joint by sample, N m, as `a cos q + b sin q + c` of its own angle q, the other joints as recorded.
    pub gravity: Vec<[f64; 3]>,
}
