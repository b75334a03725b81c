//! Hidden effects: a law of force, or something that is none.

use crate::laws::Law;
use crate::network::allowed::Allowed::{NotNegative, Positive};
use serde::{Deserialize, Serialize};

/// A hidden effect. In a truth file it is `physics`, its name, and `parameters`, its true values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "physics", content = "parameters", rename_all = "snake_case")]
pub enum Physics {
    /// More inertia on a body.
    Inertia {
        /// kg.
        inertia: f64,
    },
    /// A body in between that gives a joint a second spring: what joined the two before stays on the first one's side.
    SeriesCompliance {
        /// N/m, of the second spring.
        stiffness: f64,
        /// N s/m, beside it.
        damping: f64,
        /// kg, of the body in between.
        inertia: f64,
    },
    /// Dead time of an actuator.
    Delay {
        /// s.
        delay: f64,
    },
    /// First-order lag of an actuator.
    Bandwidth {
        /// Hz.
        bandwidth: f64,
    },
    /// Force that a motor loses to its speed.
    BackEmf {
        /// N per m/s.
        back_emf: f64,
    },
    /// Limit of an actuator's force.
    Saturation {
        /// N.
        saturation: f64,
    },
    /// A law of force between two places.
    #[serde(untagged)]
    Law(Law),
}

impl Physics {
    /// Its name, which for a law is the law's kind.
    pub fn name(&self) -> &'static str {
        match self {
            Physics::Law(law) => law.kind(),
            Physics::Inertia { .. } => "inertia",
            Physics::SeriesCompliance { .. } => "series_compliance",
            Physics::Delay { .. } => "delay",
            Physics::Bandwidth { .. } => "bandwidth",
            Physics::BackEmf { .. } => "back_emf",
            Physics::Saturation { .. } => "saturation",
        }
    }

    /// Whether a linear model can imitate it exactly, from wherever it rests.
    pub fn is_linear(&self) -> bool {
        match self {
            Physics::Law(law) => law.is_linear(),
            Physics::Saturation { .. } => false,
            Physics::Inertia { .. } | Physics::SeriesCompliance { .. } => true,
            Physics::Delay { .. } | Physics::Bandwidth { .. } | Physics::BackEmf { .. } => true,
        }
    }

    /// Whether model files have exactly this form. The others are the hidden plant's own.
    pub fn is_in_formats(&self) -> bool {
        match self {
            Physics::Law(law) => law.is_in_formats(),
            Physics::Inertia { .. } | Physics::SeriesCompliance { .. } => true,
            Physics::Delay { .. } | Physics::Bandwidth { .. } | Physics::BackEmf { .. } | Physics::Saturation { .. } => true,
        }
    }

    /// The key, the value and what it must be, of the first number that the equations do not take.
    pub(super) fn unsound(&self) -> Option<(&'static str, f64, &'static str)> {
        let numbers = match self {
            Physics::Law(law) => law.numbers(),
            Physics::Inertia { inertia } => vec![("inertia", *inertia, Positive)],
            Physics::SeriesCompliance { stiffness, damping, inertia } => {
                vec![("stiffness", *stiffness, Positive), ("damping", *damping, NotNegative), ("inertia", *inertia, Positive)]
            }
            Physics::Delay { delay } => vec![("delay", *delay, NotNegative)],
            Physics::Bandwidth { bandwidth } => vec![("bandwidth", *bandwidth, Positive)],
            Physics::BackEmf { back_emf } => vec![("back_emf", *back_emf, NotNegative)],
            Physics::Saturation { saturation } => vec![("saturation", *saturation, Positive)],
        };
        let wrong = numbers.into_iter().find(|(_, value, allowed)| !allowed.holds(*value));
        wrong.map(|(key, value, allowed)| (key, value, allowed.words()))
    }
}
