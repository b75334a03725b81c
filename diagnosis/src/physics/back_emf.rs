//! The voltage that a motor generates against its drive: force lost in proportion to speed.

use crate::hypothesis::builder::{even, key, stated};
use crate::hypothesis::sites::Reach;
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::InputKind;

pub(super) const PHYSICS: Physics = Physics {
    name: "back_emf",
    family: Family::Damping,
    words: "back-EMF",
    size: "back_emf",
    against: Against::Velocity,
    state: State::WithItsVariable,
    mark: Mark::Viscous,
    facts: Facts {
        proportional: true,
        twin: Some(
            "back-EMF and a damper to ground on the driven body are the same force: measure the motor's current, or let the device coast \
                with the winding open",
        ),
        contains: &["damper"],
        ..Facts::NONE
    },
    propose: |sites| {
        let inputs = sites.model.inputs.iter().filter(|i| i.kind == InputKind::Force && i.back_emf == 0.0);
        let one = |input: &backdrive_plant::model::Input| {
            let site = sites.pairs.iter().find(|s| s.reach == Reach::Ground && s.ends[0] == Some(input.on))?;
            let b = site.force / site.speed;
            let new = key(sites, &PHYSICS, "inputs", &input.name, "N s/m", even(0.0, 1000.0 * b, 0.0), &[0.05 * b, 0.5 * b]);
            // The same force as that of a damper to ground, which the model may have already.
            Some(new.same_as(stated(sites.model, input.on, "damper", "damping")).class(format!("damper@{}-ground", site.between[0])))
        };
        inputs.filter_map(one).collect()
    },
};
