//! What a verdict may say of an effect and be right.

use super::{Effect, Physics, Site};
use crate::laws::Law;
use crate::network::{Element, GROUND, InputKind, Network};
use serde::{Deserialize, Serialize};

/// One right answer. The first one of an effect is the effect itself, in the nearest words that verdicts have; others say the
/// same in other words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The place, as `between` or `signal`.
    #[serde(flatten)]
    pub site: Site,
    /// Names of physics, in the vocabulary of verdicts, any of which is right here; or the word of a verdict that names none: `parameters`, `none`.
    pub physics: Vec<String>,
    /// Names that findings at the same place must have besides, all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub together_with: Vec<String>,
    /// Whether it is right only where the recordings do not tell what the hand does.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hand_hidden: bool,
}

const FRICTION: &[&str] =
    &["coulomb", "asymmetric_coulomb", "stribeck", "friction_deficit", "dahl", "lugre", "maxwell_slip", "preisach_lugre"];
const PRESLIDING: &[&str] = &["maxwell_slip", "lugre", "dahl", "preisach_lugre"];
const LOOPS: &[&str] = &["hysteretic_spring", "bouc_wen"];
const VISCOUS: &[&str] = &["damper", "asymmetric_damper", "quadratic_drag", "back_emf"];
const ELASTIC: &[&str] = &["spring", "cubic_spring", "hysteretic_spring", "bouc_wen", "backlash", "contact", "hunt_crossley"];

/// Names of physics of the same family as this one, which itself is among them where verdicts have a name for it.
pub(super) fn family(physics: &Physics) -> Vec<String> {
    let lists: &[&[&str]] = match physics {
        Physics::Law(law) => match law {
            Law::Spring(_) | Law::CubicSpring(_) => &[ELASTIC],
            Law::Backlash(_) | Law::RoundedGap(_) => &[ELASTIC, &["series_compliance"]],
            Law::Damper(_) | Law::AsymmetricDamper(_) | Law::QuadraticDrag(_) => &[VISCOUS],
            Law::Inerter(_) => &[&["inerter", "inertia"]],
            Law::Bias(_) => &[&["bias", "asymmetric_coulomb"]],
            Law::Cogging(_) => &[&["cogging"]],
            Law::HystereticSpring(_) => &[PRESLIDING, LOOPS],
            Law::Dahl(_) | Law::Lugre(_) | Law::MaxwellSlip(_) | Law::BristleField(_) => &[FRICTION, LOOPS],
            Law::Coulomb(_) | Law::AsymmetricCoulomb(_) | Law::Stribeck(_) | Law::FrictionDeficit(_) => &[FRICTION],
            Law::WarmFriction(_) | Law::LoadFriction(_) => &[FRICTION],
        },
        Physics::Inertia { .. } => &[&["inertia", "inerter"]],
        Physics::SeriesCompliance { .. } => &[&["series_compliance", "backlash"]],
        Physics::Delay { .. } | Physics::Bandwidth { .. } => &[&["delay", "bandwidth"]],
        Physics::BackEmf { .. } => &[VISCOUS],
        Physics::Saturation { .. } => &[&["saturation", "gain"]],
    };
    lists.iter().flat_map(|list| list.iter()).map(|name| name.to_string()).collect()
}

/// The names that verdicts have for this physics at this place: its own, or for a form of its own the nearest ones.
fn names(physics: &Physics, site: &Site) -> Vec<&'static str> {
    let to_ground = site.is_at_ground();
    match physics {
        // Friction whose force first rises with displacement: every law with presliding. Beside a joint's spring the same field
        // is a spring with a loop.
        Physics::Law(Law::BristleField(_)) if to_ground => PRESLIDING.to_vec(),
        Physics::Law(Law::BristleField(_)) => [PRESLIDING, LOOPS].concat(),
        Physics::Law(Law::RoundedGap(_)) => vec!["backlash"],
        // Heat lowers friction where it is fast: over a recording that is dry friction, falling with speed where it shows.
        Physics::Law(Law::WarmFriction(_)) => vec!["coulomb", "stribeck"],
        Physics::Law(Law::LoadFriction(_)) => vec!["coulomb"],
        Physics::Law(Law::Inerter(_)) if to_ground => vec!["inerter", "inertia"],
        Physics::Inertia { .. } => vec!["inertia", "inerter"],
        _ => vec![physics.name()],
    }
}

/// Every right answer for an effect on this device: its own, and what the formats cannot tell apart from it.
pub(super) fn answers(effect: &Effect, network: &Network) -> Vec<Answer> {
    let answer = |site: &Site, physics: &[&str]| Answer {
        site: site.clone(),
        physics: physics.iter().map(|name| name.to_string()).collect(),
        together_with: Vec::new(),
        hand_hidden: false,
    };
    let site = &effect.site;
    let mut all = vec![answer(site, &names(&effect.physics, site))];
    let forces: Vec<_> = network.inputs.iter().filter(|input| input.kind == InputKind::Force).collect();
    match (&effect.physics, site) {
        (Physics::BackEmf { .. }, Site::Signal(name)) => {
            if let Some(input) = forces.iter().find(|input| input.name == *name) {
                let ground = Site::Between([network.bodies[input.on].name.clone(), GROUND.to_string()]);
                all.push(answer(&ground, &["damper"]));
            }
        }
        (Physics::Law(Law::Damper(_)), Site::Between(ends)) if site.is_at_ground() => {
            for input in forces.iter().filter(|input| ends.contains(&network.bodies[input.on].name)) {
                all.push(answer(&Site::Signal(input.name.clone()), &["back_emf"]));
            }
        }
        // Lopsided friction is friction with a bias. Where the model states the friction, the bias alone is what it leaves out.
        (Physics::Law(Law::AsymmetricCoulomb(_)), _) => {
            let together_with = if effect.replaces.is_empty() { vec!["coulomb".to_string()] } else { Vec::new() };
            all.push(Answer { together_with, ..answer(site, &["bias"]) });
        }
        (Physics::Law(Law::Bias(_)), Site::Between(ends)) => {
            let rubs = |element: &&Element| {
                matches!(element.law, Law::Coulomb(_))
                    && element.between.iter().all(|end| ends.iter().any(|name| network.place_name(*end) == name))
            };
            if network.elements.iter().any(|element| rubs(&element)) {
                all.push(answer(site, &["asymmetric_coulomb"]));
            }
            // A constant force on a body is the same whether the ground takes the reaction or a body whose motion is prescribed, as the hand's.
            let moved: Vec<&str> = network
                .inputs
                .iter()
                .filter(|input| input.kind == InputKind::Motion)
                .map(|input| network.bodies[input.on].name.as_str())
                .collect();
            if let Some(body) = ends.iter().find(|end| *end != GROUND).filter(|_| site.is_at_ground()) {
                for hand in &moved {
                    all.push(answer(&Site::Between([body.clone(), hand.to_string()]), &["bias"]));
                }
            }
            // Where the reaction is taken by the body that the hand's spring holds, a hand somewhere else takes it on; one that nobody measured may be.
            for end in network.elements.iter().filter(|e| e.of_grip && matches!(e.law, Law::Spring(_))).flat_map(|e| e.between) {
                let held = network.place_name(end);
                let other = |name: &str| ends.iter().find(|end| *end == name).and_then(|_| ends.iter().find(|end| *end != name));
                if held == GROUND || moved.contains(&held) {
                    continue;
                }
                let same = match (other(GROUND), other(held)) {
                    (Some(body), _) if body != held => [body.clone(), held.to_string()],
                    (None, Some(body)) => [body.clone(), GROUND.to_string()],
                    _ => continue,
                };
                all.push(Answer { hand_hidden: true, ..answer(&Site::Between(same), &["bias"]) });
            }
        }
        // At the only input and the only output; the hand's motion is an input that only some recordings have.
        (Physics::Delay { .. } | Physics::Bandwidth { .. }, _) if forces.len() == 1 && network.outputs.len() == 1 => {
            let hand_hidden = network.inputs.len() > 1;
            all.push(Answer { hand_hidden, ..answer(&Site::Signal(network.outputs[0].name.clone()), &["delay"]) });
        }
        _ => {}
    }
    // What only moves a number of the model, or what a hand that nobody measured may do as well, is nothing that a model leaves out.
    let held = |is: fn(&Law) -> bool| network.elements.iter().any(|e| e.of_grip && is(&e.law) && ends_at(e, site, network));
    let in_the_numbers = |hand_hidden: bool, words: &[&str]| Answer { hand_hidden, ..answer(site, words) };
    match &effect.physics {
        Physics::Inertia { .. } => all.push(in_the_numbers(false, &["parameters"])),
        // A spring in series with a spring is a softer one, up to the resonance of what little lies between.
        Physics::SeriesCompliance { .. } if springs(site, network) => all.push(in_the_numbers(false, &["parameters"])),
        Physics::Law(Law::Damper(_)) if site.is_at_ground() && held(|law| matches!(law, Law::Damper(_))) => {
            all.push(in_the_numbers(true, &["parameters"]));
        }
        Physics::Law(Law::Bias(_)) if site.is_at_ground() && held(|law| matches!(law, Law::Spring(_))) => {
            all.push(in_the_numbers(true, &["parameters", "none"]));
        }
        _ => {}
    }
    all
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

/// Whether an element joins a body that the site names.
fn ends_at(element: &Element, site: &Site, network: &Network) -> bool {
    let Site::Between(ends) = site else { return false };
    element.between.iter().flatten().any(|body| ends.contains(&network.bodies[*body].name))
}
