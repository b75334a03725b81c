//! The records of this rig: their files, and one of them at its own rate.

/// The recordings: the second master, gains of the coupling a, b and c, and what the slave met.
pub(super) const FILES: [&str; 17] = [
    "m2_a_free_motion.csv",
    "m2_a_spring.csv",
    "m2_a_foam.csv",
    "m2_a_foam2.csv",
    "m2_a_foam3.csv",
    "m2_a_rigid.csv",
    "m2_b_free_motion.csv",
    "m2_b_spring.csv",
    "m2_b_foam.csv",
    "m2_b_foam2.csv",
    "m2_b_foam3.csv",
    "m2_b_rigid.csv",
    "m2_c_free_motion.csv",
    "m2_c_spring.csv",
    "m2_c_foam.csv",
    "m2_c_foam2.csv",
    "m2_c_rigid.csv",
];
/// What of their names is the same in all.
pub(super) const SAME: &str = "m2_";
/// Samples that are left out at either end, for the filters.
pub(super) const ENDS: usize = 100;

/// A record at its own rate, positions and torques through the same filter.
#[derive(Debug, Clone)]
pub(super) struct Record {
    /// Such as `b_spring`.
    pub(super) name: String,
    /// s
    pub(super) period_s: f64,
    /// rad
    pub(super) master: Vec<f64>,
    /// rad
    pub(super) slave: Vec<f64>,
    /// Torque of the hand on the master by its gauge, N m.
    pub(super) hand: Vec<f64>,
    /// Torque of the environment on the slave, N m.
    pub(super) contact: Vec<f64>,
    /// Torques of the motors, N m.
    pub(super) master_motor: Vec<f64>,
    pub(super) slave_motor: Vec<f64>,
}

/// The mean of some values; NaN of none.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
