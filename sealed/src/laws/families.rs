//! Names of effects that verdicts have, by family.

pub(super) const FRICTION: &[&str] =
    &["coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit", "dahl", "lugre", "maxwell_slip", "preisach_lugre"];
pub(super) const PRESLIDING: &[&str] = &["maxwell_slip", "lugre", "dahl", "preisach_lugre"];
pub(super) const LOOPS: &[&str] = &["hysteretic_spring", "bouc_wen"];
pub(crate) const VISCOUS: &[&str] = &["damper", "asymmetric_damper", "quadratic_drag", "back_emf"];
pub(super) const ELASTIC: &[&str] = &["spring", "cubic_spring", "hysteretic_spring", "bouc_wen", "backlash", "contact", "hunt_crossley"];
