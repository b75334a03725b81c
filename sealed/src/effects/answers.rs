//! What a verdict may say of an effect and be right.

use super::answer::Answer;
use super::physics::Physics;
use super::site::{GROUND, Site};
use crate::laws::Law;
use crate::laws::around::Around;
use crate::laws::families::VISCOUS;
use crate::network::{Element, InputKind, Network};

/// Names of effects of the same family as this one, which itself is among them where verdicts have a name for it.
pub(super) fn family(physics: &Physics) -> Vec<String> {
    let lists: &[&[&str]] = match physics {
        Physics::Law(law) => law.facts().family,
        Physics::Inertia { .. } => &[&["inertia", "inerter"]],
        Physics::SeriesCompliance { .. } => &[&["series_compliance", "backlash"]],
        Physics::Delay { .. } | Physics::Bandwidth { .. } => &[&["delay", "bandwidth"]],
        Physics::BackEmf { .. } => &[VISCOUS],
        Physics::Saturation { .. } => &[&["saturation", "gain"]],
    };
    lists.iter().flat_map(|list| list.iter()).map(|name| name.to_string()).collect()
}

/// Every right answer for an effect on this device: its own, and what the formats cannot distinguish from it.
pub(super) fn answers(physics: &Physics, site: &Site, replaces_something: bool, network: &Network) -> Vec<Answer> {
    let around = around(site, replaces_something, network);
    // What only moves a number of the model is nothing that a model leaves out.
    let in_the_numbers = || Answer::at(site, &["parameters"]);
    match physics {
        Physics::Law(law) => {
            let own = Answer::at(site, &law.names(site.is_at_ground()));
            std::iter::once(own).chain(law.same_as(&around)).collect()
        }
        Physics::Inertia { .. } => vec![Answer::at(site, &["inertia", "inerter"]), in_the_numbers()],
        // A spring in series with a spring is a softer one, up to the resonance of what little lies between.
        Physics::SeriesCompliance { .. } => {
            let own = Answer::at(site, &[physics.name()]);
            std::iter::once(own).chain(springs(site, network).then(in_the_numbers)).collect()
        }
        Physics::BackEmf { .. } => {
            let driven = around.force_inputs.iter().find(|(name, _)| *site == Site::Signal(name.clone()));
            let damper = driven.map(|(_, body)| Answer::at(&Site::Between([body.clone(), GROUND.to_string()]), &["damper"]));
            std::iter::once(Answer::at(site, &[physics.name()])).chain(damper).collect()
        }
        Physics::Delay { .. } | Physics::Bandwidth { .. } => {
            let mut all = vec![Answer::at(site, &[physics.name()])];
            // At the only input and the only output; the hand's motion is an input that only some recordings have.
            if around.force_inputs.len() == 1 && network.outputs.len() == 1 {
                let hand_hidden = network.inputs.len() > 1;
                all.push(Answer { hand_hidden, ..Answer::at(&Site::Signal(network.outputs[0].name.clone()), &["delay"]) });
            }
            all
        }
        Physics::Saturation { .. } => vec![Answer::at(site, &[physics.name()])],
    }
}

/// What is around an effect at this place.
fn around(site: &Site, replaces_something: bool, network: &Network) -> Around {
    let named = |name: &str| matches!(site, Site::Between(ends) if ends.iter().any(|end| end == name));
    let driven = |kind: InputKind| network.inputs.iter().filter(move |input| input.kind == kind);
    let body = |index: usize| network.bodies[index].name.clone();
    let in_grip = || network.elements.iter().filter(|element| element.of_grip);
    let places = |between: [Option<usize>; 2]| between.map(|place| network.place_name(place).to_string());
    Around {
        site: site.clone(),
        replaces_something,
        force_inputs: driven(InputKind::Force).map(|input| (input.name.clone(), body(input.on))).collect(),
        moved: driven(InputKind::Motion).map(|input| body(input.on)).collect(),
        stated: network.elements.iter().filter(|e| places(e.between).iter().all(|name| named(name))).map(|e| e.law.kind()).collect(),
        gripped_by: in_grip()
            .filter(|e| e.between.iter().flatten().any(|index| named(&network.bodies[*index].name)))
            .map(|e| e.law.kind())
            .collect(),
        grip_ends: in_grip().flat_map(|e| places(e.between).map(|name| (e.law.kind(), name))).collect(),
    }
}

/// Whether the elements of a joint are a spring and dampers.
fn springs(site: &Site, network: &Network) -> bool {
    let Site::Between(ends) = site else { return false };
    let is_there = |e: &&Element| {
        let places = e.between.map(|end| network.place_name(end));
        places.iter().all(|place| ends.iter().any(|end| end == place))
    };
    let mut laws = network.elements.iter().filter(is_there).map(|e| &e.law);
    laws.clone().any(|law| matches!(law, Law::Spring(_))) && laws.all(|law| matches!(law, Law::Spring(_) | Law::Damper(_)))
}
