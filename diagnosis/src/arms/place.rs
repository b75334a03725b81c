//! Where a term acts, as verdicts have it.

use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::Data;
use crate::hypothesis::Place;

/// Where a term acts, as verdicts have it.
pub fn place(data: &Data, term: &Term) -> Place {
    let joint = |j: usize| data.problem.joints.get(j).cloned().unwrap_or_default();
    let last = data.problem.joints.len().saturating_sub(1);
    match (term.physics, term.at) {
        (Physics::Gain | Physics::Delay, At::Joint(j)) => Place::Signal(format!("{}.torque", joint(j))),
        (Physics::Offset, At::Joint(j)) => Place::Signal(format!("{}.position", joint(j))),
        (Physics::Gain, At::Base) => Place::Signal("torque of all joints".to_string()),
        (Physics::Payload, _) => Place::Between(joint(last), "ground".to_string()),
        (Physics::GravityDirection, _) => Place::Between("base".to_string(), "ground".to_string()),
        (Physics::Compliance | Physics::Backlash, At::Joint(j)) => Place::Between(joint(j), format!("{}.rotor", joint(j))),
        (_, At::Joint(j)) => Place::Between(joint(j), "ground".to_string()),
        (_, At::Pair(j, k)) => Place::Between(joint(j), joint(k)),
        (_, At::Base) => Place::Between("base".to_string(), "ground".to_string()),
    }
}
