//! Dry friction under the force of a joint.

use super::ForceLaw;
use serde::{Deserialize, Serialize};

/// Coulomb friction of surfaces that a joint's spring presses together: `c = c0 + mu abs(f_joint)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadFriction {
    /// N, c0, without load.
    pub force: f64,
    /// mu, friction per load; it holds how the joint's force turns into a normal force (a wrap angle, a gear's pressure angle).
    pub coefficient: f64,
    /// The element whose force is the load.
    pub joint: String,
}

impl ForceLaw for LoadFriction {
    fn dry(&self, _: f64, load: f64, _: &[f64]) -> [f64; 2] {
        let level = self.force + self.coefficient * load;
        [level, level]
    }

    fn is_dry(&self) -> bool {
        true
    }

    fn loaded_by(&self) -> Option<&str> {
        Some(&self.joint)
    }
}
