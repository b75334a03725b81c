//! What a search of an arm begins with.

use crate::arms::fit::Structure;
use crate::arms::physics::{At, Physics, Term};
use crate::arms::regression::Data;

/// Effects that every joint has more or less of: they take no other's place.
pub(crate) const COMMON: [Physics; 4] = [Physics::Coulomb, Physics::Damper, Physics::Bias, Physics::Inertia];

/// What a search begins with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// The nominal structure.
    AsGiven,
    /// The same with friction and armature at every joint that has a motor.
    WithFriction,
    /// The same with a constant there too, and free inertial parameters.
    Common,
}

/// Friction and armature, which every joint with a motor has.
const FRICTION: [Physics; 3] = [Physics::Damper, Physics::Coulomb, Physics::Inertia];

/// The structure that a search begins with.
pub(crate) fn begun(data: &Data, pool: &[Term], nominal: &Structure, from: Start) -> Structure {
    match from {
        Start::AsGiven => nominal.clone(),
        Start::WithFriction => at_every_motor(data, pool, nominal, &FRICTION),
        Start::Common => common(data, pool, nominal),
    }
}

/// A structure with more effects at every joint that has a motor.
fn at_every_motor(data: &Data, pool: &[Term], structure: &Structure, effects: &[Physics]) -> Structure {
    let is_driven = |t: &&Term| matches!(t.at, At::Joint(j) if !data.is_passive(j));
    let missing =
        pool.iter().filter(|t| effects.contains(&t.physics) && !structure.terms.iter().any(|own| own.is_like(t))).filter(is_driven);
    Structure { terms: structure.terms.iter().chain(missing).cloned().collect(), ..structure.clone() }
}

/// A structure with everything that is common: [`COMMON`] at every joint that has a motor, and inertial parameters as free as they may be.
pub(crate) fn common(data: &Data, pool: &[Term], structure: &Structure) -> Structure {
    Structure { tolerance: data.most_tolerance, ..at_every_motor(data, pool, structure, &COMMON) }
}
