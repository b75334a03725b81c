//! Which elements press the surfaces of dry friction together.

use crate::laws::Load;
use crate::network::{Element, Network, Place};

/// The elements whose forces add up to the load of friction between these places, each with its sign.
pub(super) fn loading(device: &Network, between: [Place; 2], load: Load) -> Vec<(usize, f64)> {
    match load {
        Load::None => Vec::new(),
        Load::Element(name) => device.element(name).map(|index| (index, 1.0)).into_iter().collect(),
        Load::Joint => of_joint(device, between),
    }
}

fn of_joint(device: &Network, between: [Place; 2]) -> Vec<(usize, f64)> {
    let joint = match between {
        [Some(body), None] => [Some(body), first_neighbour(device, body)],
        [None, Some(body)] => [first_neighbour(device, body), Some(body)],
        both => both,
    };
    // Dry friction has no force of its own path and counts as zero.
    let sign = |element: &Element| match element.between {
        ends if ends == joint => Some(1.0),
        [a, b] if [b, a] == joint => Some(-1.0),
        _ => None,
    };
    device.elements.iter().enumerate().filter_map(|(index, element)| Some((index, sign(element)?))).collect()
}

/// The first other body that a spring joins this one with; ground where there is none.
fn first_neighbour(device: &Network, body: usize) -> Place {
    let springs = device.elements.iter().filter(|element| element.law.to_force().stiffness() > 0.0);
    let neighbour = |element: &Element| match element.between {
        [Some(a), Some(b)] if a == body => Some(b),
        [Some(a), Some(b)] if b == body => Some(a),
        _ => None,
    };
    springs.filter_map(neighbour).next()
}
