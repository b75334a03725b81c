//! Which effects have a place in a device.

use crate::effects::{Effect, Site};
use crate::laws::draw::{Draw, InJoint, StatedDamper};
use crate::laws::{KINDS, Kind, Law};
use crate::network::{Element, GROUND, InputKind, Network, Place};

/// An effect that is drawn: of what model files name, what a joint of a hand-held device can have, and the forms that are not in
/// model files. Not drawn are stops (no device is driven into them), laws that differ from a drawn one only in detail
/// (Bouc-Wen, Preisach) and faults of sensors.
#[derive(Clone, Copy)]
pub(super) enum What {
    /// A law at a sort of place.
    Law(&'static Kind, Draw),
    Inertia,
    SeriesCompliance,
    Delay,
    Bandwidth,
    BackEmf,
    Saturation,
}

impl What {
    /// Whether a linear model can imitate it; of a law, whether its kind is linear for any parameters.
    pub fn is_linear(self) -> bool {
        match self {
            What::Law(kind, _) => kind.is_linear,
            What::Inertia | What::SeriesCompliance | What::Delay | What::Bandwidth | What::BackEmf => true,
            What::Saturation => false,
        }
    }

    fn name(self) -> (&'static str, Option<Draw>) {
        match self {
            What::Law(kind, draw) => (kind.name, Some(draw)),
            What::Inertia => ("inertia", None),
            What::SeriesCompliance => ("series_compliance", None),
            What::Delay => ("delay", None),
            What::Bandwidth => ("bandwidth", None),
            What::BackEmf => ("back_emf", None),
            What::Saturation => ("saturation", None),
        }
    }
}

impl PartialEq for What {
    fn eq(&self, other: &What) -> bool {
        self.name() == other.name()
    }
}

const AT_INPUTS: [What; 4] = [What::Delay, What::Bandwidth, What::BackEmf, What::Saturation];

/// An effect without its parameters.
#[derive(Clone, PartialEq)]
pub(super) struct Candidate {
    pub what: What,
    pub site: Site,
    pub replaces: Vec<String>,
    /// The element that it is sized by: the joint's spring, or the spring that presses.
    pub joint: Option<usize>,
}

impl Candidate {
    /// Whether it can be distinguished from what is chosen already: another place, or nothing alike at the same one.
    pub fn goes_with(&self, chosen: &[Effect]) -> bool {
        chosen
            .iter()
            .all(|effect| !effect.site.is_same_place(&self.site) && !self.replaces.iter().any(|name| effect.replaces.contains(name)))
    }
}

/// Every candidate, kind after kind: friction, what else a body has, joints, inputs.
pub(super) fn all(network: &Network) -> Vec<Candidate> {
    let draws = || KINDS.iter().flat_map(|kind| kind.draws.iter().map(move |draw| (kind, *draw)));
    let mut all = Vec::new();
    for (kind, draw) in draws() {
        if let Draw::Friction { loaded } = draw {
            all.extend(bodies(network).filter_map(|body| friction(kind, loaded, body, network)));
        }
    }
    for (kind, draw) in draws() {
        if let Draw::Body(stated) = draw {
            all.extend(bodies(network).filter_map(|body| at_body(kind, stated, body, network)));
        }
    }
    let site = |body| to_ground(network, body);
    all.extend(bodies(network).map(|body| Candidate { what: What::Inertia, site: site(body), replaces: Vec::new(), joint: None }));
    for (kind, draw) in draws() {
        if let Draw::Joint(own) = draw {
            all.extend(joints(network).map(|index| joint(What::Law(kind, draw), own, index, network)));
        }
    }
    all.extend(joints(network).map(|index| joint(What::SeriesCompliance, InJoint::Beside, index, network)));
    for what in AT_INPUTS {
        for input in network.inputs.iter().filter(|input| input.kind == InputKind::Force) {
            all.push(Candidate { what, site: Site::Signal(input.name.clone()), replaces: Vec::new(), joint: None });
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

/// Dry friction of a body against ground. It takes the place of Coulomb friction that the model states; beside another law it would be that law with
/// other parameters.
fn friction(kind: &'static Kind, loaded: bool, body: usize, network: &Network) -> Option<Candidate> {
    let stated: Vec<&Element> =
        at(network, [Some(body), None]).map(|(_, element)| element).filter(|element| element.law.is_friction()).collect();
    let replaces = match stated.as_slice() {
        [] => Vec::new(),
        [one] if matches!(one.law, Law::Coulomb(_)) && one.law.kind() != kind.name => vec![one.name.clone()],
        _ => return None,
    };
    let joint = if loaded { Some(joints(network).find(|index| network.elements[*index].between.contains(&Some(body)))?) } else { None };
    Some(Candidate { what: What::Law(kind, Draw::Friction { loaded }), site: to_ground(network, body), replaces, joint })
}

/// What a body has beside friction. A second damper would only be the model's damper with another value; an asymmetric one takes its place.
fn at_body(kind: &'static Kind, damper: StatedDamper, body: usize, network: &Network) -> Option<Candidate> {
    let stated = at(network, [Some(body), None]).find(|(_, element)| matches!(element.law, Law::Damper(_)));
    let replaced = match damper {
        StatedDamper::Stays => None,
        StatedDamper::Refuses if stated.is_some() => return None,
        StatedDamper::Refuses => None,
        StatedDamper::IsReplaced => stated,
    };
    let replaces = replaced.iter().map(|(_, element)| element.name.clone()).collect();
    let what = What::Law(kind, Draw::Body(damper));
    Some(Candidate { what, site: to_ground(network, body), replaces, joint: replaced.map(|(index, _)| index) })
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

fn joint(what: What, own: InJoint, index: usize, network: &Network) -> Candidate {
    let element = &network.elements[index];
    let mut replaces = match own {
        InJoint::Beside => Vec::new(),
        InJoint::ForSpring | InJoint::ForSpringAndDampers => vec![element.name.clone()],
    };
    if own == InJoint::ForSpringAndDampers {
        replaces.extend(at(network, element.between).filter(|(_, e)| matches!(e.law, Law::Damper(_))).map(|(_, e)| e.name.clone()));
    }
    let site = Site::Between(element.between.map(|place| network.place_name(place).to_string()));
    Candidate { what, site, replaces, joint: Some(index) }
}
