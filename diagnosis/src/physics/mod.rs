//! The effects that a model may lack: one file each, which holds everything that diagnosis knows of it, and one line here.

#[cfg(test)]
mod lists;
#[cfg(test)]
mod tests;

use crate::hypothesis::sites::{Kin, Sites};
use crate::hypothesis::{Hypothesis, Physics, Scales};
use backdrive_plant::elements::Law;
use backdrive_plant::model::Model;

macro_rules! register {
    ($($physics:ident,)*) => {
        $(mod $physics;)*

        /// Every physics, simple ones first: of two that explain alike, the earlier is the simpler.
        pub static PHYSICS: &[&Physics] = &[$(&$physics::PHYSICS),*];
    };
}

register!(
    bias,
    offset,
    gain,
    inertia,
    damper,
    back_emf,
    spring,
    inerter,
    coulomb,
    quadratic_drag,
    delay,
    bandwidth,
    saturation,
    asymmetric_damper,
    asymmetric_coulomb,
    cubic_spring,
    dahl,
    stribeck,
    load_friction,
    gear_loss,
    friction_deficit,
    warm_friction,
    gravity,
    cogging,
    backlash,
    contact,
    hunt_crossley,
    series_compliance,
    creep,
    bouc_wen,
    lugre,
    hysteretic_spring,
    maxwell_slip,
    preisach_lugre,
);

/// Level of a dry friction at speed, N or N m.
fn level(physics: &Physics, law: &Law) -> f64 {
    let values = law.values();
    let of = |key: &&str| law.kind().parameters.iter().zip(&values).find(|(p, _)| p.key == *key).map_or(0.0, |(_, list)| list.iter().sum());
    let levels: Vec<f64> = physics.facts.sliding.iter().map(of).collect();
    levels.iter().sum::<f64>() / levels.len().max(1) as f64
}

/// Every hypothesis about a device. `scales` are those of the same model.
pub fn all(model: &Model, scales: &Scales) -> Vec<Hypothesis> {
    let kin = |law: &Law| {
        let physics = physics_named(law.kind().name);
        Kin { level: physics.filter(|p| !p.facts.sliding.is_empty()).map(|p| level(p, law)), holds: physics.is_some_and(|p| p.facts.holds) }
    };
    let sites = Sites::of(model, scales, kin);
    PHYSICS.iter().flat_map(|physics| (physics.propose)(&sites)).collect()
}

/// What is known of the effect of this name.
pub fn physics_named(name: &str) -> Option<&'static Physics> {
    PHYSICS.iter().copied().find(|p| p.name == name)
}

/// Whether one effect has another as a special or limiting case.
pub(crate) fn contains(physics: &Physics, simpler: &Physics) -> bool {
    physics.facts.contains.contains(&simpler.name)
}

/// Names of everything that goes when these are withheld: themselves and whatever contains one of them.
pub fn withheld(names: &[&str]) -> Vec<&'static str> {
    let mut gone: Vec<&'static str> = PHYSICS.iter().map(|p| p.name).filter(|name| names.contains(name)).collect();
    loop {
        let next: Vec<_> = PHYSICS
            .iter()
            .filter(|p| !gone.contains(&p.name) && p.facts.contains.iter().any(|c| gone.contains(c)))
            .map(|p| p.name)
            .collect();
        if next.is_empty() {
            return gone;
        }
        gone.extend(next);
    }
}

/// The hypotheses that remain when these effects, and all that contain one of them, are withheld.
pub fn without(hypotheses: Vec<Hypothesis>, names: &[&str]) -> Vec<Hypothesis> {
    let gone = withheld(names);
    hypotheses.into_iter().filter(|h| !gone.contains(&h.physics.name)).collect()
}
