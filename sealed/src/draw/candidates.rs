//! Which effects have a place in a device.

use crate::effects::{Effect, Site};
use crate::laws::Law;
use crate::network::{Element, GROUND, InputKind, Network, Place};

/// Effects that are drawn: of what model files name, what a joint of a hand-held device can have, and the forms that are not in
/// model files. Not drawn are stops (no device is driven into them), laws that differ from a drawn one only in detail
/// (Bouc-Wen, Preisach) and faults of sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Coulomb,
    AsymmetricCoulomb,
    Stribeck,
    FrictionDeficit,
    Dahl,
    Lugre,
    MaxwellSlip,
    BristleField,
    WarmFriction,
    LoadFriction,
    Damper,
    AsymmetricDamper,
    QuadraticDrag,
    Cogging,
    Bias,
    Inertia,
    CubicSpring,
    HystereticSpring,
    Backlash,
    RoundedGap,
    JointBristles,
    SeriesCompliance,
    Delay,
    Bandwidth,
    BackEmf,
    Saturation,
}

impl Kind {
    pub fn is_linear(self) -> bool {
        let constant = matches!(self, Kind::Damper | Kind::Bias | Kind::Inertia | Kind::SeriesCompliance);
        constant || matches!(self, Kind::Delay | Kind::Bandwidth | Kind::BackEmf)
    }
}

const FRICTION: [Kind; 10] = [
    Kind::Coulomb,
    Kind::AsymmetricCoulomb,
    Kind::Stribeck,
    Kind::FrictionDeficit,
    Kind::Dahl,
    Kind::Lugre,
    Kind::MaxwellSlip,
    Kind::BristleField,
    Kind::WarmFriction,
    Kind::LoadFriction,
];

const AT_BODIES: [Kind; 6] = [Kind::Damper, Kind::AsymmetricDamper, Kind::QuadraticDrag, Kind::Cogging, Kind::Bias, Kind::Inertia];

const AT_JOINTS: [Kind; 6] =
    [Kind::CubicSpring, Kind::HystereticSpring, Kind::Backlash, Kind::RoundedGap, Kind::JointBristles, Kind::SeriesCompliance];

const AT_INPUTS: [Kind; 4] = [Kind::Delay, Kind::Bandwidth, Kind::BackEmf, Kind::Saturation];

/// An effect without its numbers.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    pub kind: Kind,
    pub site: Site,
    pub replaces: Vec<String>,
    /// The element that it is sized by: the joint's spring, or the spring that presses.
    pub joint: Option<usize>,
}

impl Candidate {
    /// Whether it can be told from what is chosen already: another place, or nothing alike at the same one.
    pub fn goes_with(&self, chosen: &[Effect]) -> bool {
        chosen
            .iter()
            .all(|effect| !effect.site.is_same_place(&self.site) && !self.replaces.iter().any(|name| effect.replaces.contains(name)))
    }
}

/// Every candidate, kind after kind.
pub(super) fn all(network: &Network) -> Vec<Candidate> {
    let mut all = Vec::new();
    for kind in FRICTION {
        bodies(network).for_each(|body| all.extend(friction(kind, body, network)));
    }
    for kind in AT_BODIES {
        bodies(network).for_each(|body| all.extend(at_body(kind, body, network)));
    }
    for kind in AT_JOINTS {
        all.extend(joints(network).map(|index| joint(kind, index, network)));
    }
    for kind in AT_INPUTS {
        for input in network.inputs.iter().filter(|input| input.kind == InputKind::Force) {
            all.push(Candidate { kind, site: Site::Signal(input.name.clone()), replaces: Vec::new(), joint: None });
        }
    }
    all
}

/// Bodies that move freely.
fn bodies(network: &Network) -> impl Iterator<Item = usize> {
    (0..network.bodies.len()).filter(|body| !network.is_moved(*body))
}

fn to_ground(network: &Network, body: usize) -> Site {
    Site::Between([network.bodies[body].name.clone(), GROUND.to_string()])
}

/// Elements of the device between two places, in either order.
fn at(network: &Network, between: [Place; 2]) -> impl Iterator<Item = (usize, &Element)> {
    let reversed = [between[1], between[0]];
    let matches = move |element: &Element| !element.of_grip && (element.between == between || element.between == reversed);
    network.elements.iter().enumerate().filter(move |(_, element)| matches(element))
}

/// Dry friction of a body against ground. It takes the place of Coulomb friction that the model states; beside another law it would be that law
/// with other numbers.
fn friction(kind: Kind, body: usize, network: &Network) -> Option<Candidate> {
    let stated: Vec<&Element> =
        at(network, [Some(body), None]).map(|(_, element)| element).filter(|element| element.law.is_friction()).collect();
    let replaces = match stated.as_slice() {
        [] => Vec::new(),
        [one] if matches!(one.law, Law::Coulomb(_)) && kind != Kind::Coulomb => vec![one.name.clone()],
        _ => return None,
    };
    let joint = if kind == Kind::LoadFriction {
        Some(joints(network).find(|index| network.elements[*index].between.contains(&Some(body)))?)
    } else {
        None
    };
    Some(Candidate { kind, site: to_ground(network, body), replaces, joint })
}

/// What a body has beside friction. A damper that the model states would only be that damper with another number; one that is
/// lopsided takes its place.
fn at_body(kind: Kind, body: usize, network: &Network) -> Option<Candidate> {
    let stated = at(network, [Some(body), None]).find(|(_, element)| matches!(element.law, Law::Damper(_)));
    if kind == Kind::Damper && stated.is_some() {
        return None;
    }
    let replaced = stated.filter(|_| kind == Kind::AsymmetricDamper);
    let replaces = replaced.iter().map(|(_, element)| element.name.clone()).collect();
    Some(Candidate { kind, site: to_ground(network, body), replaces, joint: replaced.map(|(index, _)| index) })
}

/// Linear springs of the device between two bodies, at least one of which moves freely.
fn joints(network: &Network) -> impl Iterator<Item = usize> {
    (0..network.elements.len()).filter(|index| {
        let element = &network.elements[*index];
        let sprung = matches!(&element.law, Law::Spring(spring) if spring.stiffness > 0.0 && spring.rest == 0.0);
        sprung
            && !element.of_grip
            && element.between.iter().all(Option::is_some)
            && element.between.iter().flatten().any(|body| !network.is_moved(*body))
    })
}

fn joint(kind: Kind, index: usize, network: &Network) -> Candidate {
    let element = &network.elements[index];
    let mut replaces = match kind {
        Kind::CubicSpring | Kind::HystereticSpring | Kind::Backlash | Kind::RoundedGap => vec![element.name.clone()],
        _ => Vec::new(),
    };
    if matches!(kind, Kind::Backlash | Kind::RoundedGap) {
        // A gap stands in the place of the joint's dampers too.
        replaces.extend(at(network, element.between).filter(|(_, e)| matches!(e.law, Law::Damper(_))).map(|(_, e)| e.name.clone()));
    }
    let site = Site::Between(element.between.map(|place| network.place_name(place).to_string()));
    Candidate { kind, site, replaces, joint: Some(index) }
}
