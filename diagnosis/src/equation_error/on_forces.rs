//! What is kept of a search on forces.

use crate::belief::on_forces::Belief;
use crate::tuning::tuning;

/// Results of a search on forces for its structures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OnForces {
    /// The corner of the band of its fits, Hz.
    pub corner_hz: f64,
    /// The corners of all bands that were looked at, Hz.
    pub bands_hz: Vec<f64>,
    /// The structure that is claimed: ids of its effects, as [`crate::output_error::candidate`] joins them.
    pub claimed: String,
    /// How sure each of its effects is, by id.
    pub beliefs: Vec<(String, Belief)>,
    /// Effects that belong to another one, such as the zero of a spring, by id.
    pub companions: Vec<String>,
    /// Laws of it that are the same force as another one, which its place allows as well: one sentence each.
    pub same_force: Vec<String>,
    /// Residual of the claimed structure with its parameters refined by simulation, in noise standard deviations of the force's sensor in that band: rms.
    pub left: f64,
    /// Whether so much is left, of the force and beside the sensor's noise, that a law that is only simulated may be what is missing.
    pub is_beyond: bool,
    /// Structures that predict left-out stretches as well as the claimed one.
    pub alike: Vec<String>,
}

impl OnForces {
    /// Whether what is left is the noise of the force's sensor.
    pub fn is_at_noise(&self) -> bool {
        self.left < tuning().noise.unexplained
    }

    /// What counts as noise, in words.
    pub fn noise(&self) -> &'static str {
        if self.is_at_noise() { "the sensor noise" } else { "what none of the laws explains" }
    }
}
