//! Nominal parameters that hide the hidden effects.

use super::sizing::rounded;
use crate::effects::{Effect, Physics, Site};
use crate::laws::Law;
use crate::network::{InputKind, Network};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// The parameters of the nominal model that are wrong, by path.
type Numbers = BTreeMap<String, f64>;

/// The true value over the nominal one of every number that is wrong, by path.
///
/// A fit without the effect would have moved the parameters near it: damping up for what takes energy, stiffness down for what yields, inertia up for
/// inertia, damping down for lag, which feeds motion. So the true number lies on the other side of the nominal one, by 30 to 100 % of `percent`.
/// Where nothing is hidden, half of all parameters are off, either way.
pub(super) fn numbers(network: &Network, effects: &[Effect], percent: f64, random: &mut ChaCha8Rng) -> Numbers {
    let mut numbers = Numbers::new();
    if percent == 0.0 {
        return numbers;
    }
    if effects.is_empty() {
        for path in network.number_paths() {
            if random.random_bool(0.5) {
                numbers.insert(path, rounded(1.0 + 0.01 * percent * random.random_range(-1.0..=1.0)));
            }
        }
        return numbers;
    }
    let replaced: Vec<&String> = effects.iter().flat_map(|effect| &effect.replaces).collect();
    let stated = network.number_paths();
    for effect in effects {
        for (path, sign) in absorbing(network, effect) {
            let of = path.strip_prefix("elements.").and_then(|rest| rest.rsplit_once('.')).map(|(name, _)| name);
            // A number that two effects pull at stays where the first one put it.
            if stated.contains(&path) && !replaced.iter().any(|name| Some(name.as_str()) == of) && !numbers.contains_key(&path) {
                numbers.insert(path, rounded(1.0 + sign * 0.01 * percent * random.random_range(0.3..=1.0)));
            }
        }
    }
    numbers
}

/// Paths of the parameters that absorb part of an effect, and where the true value lies: above (1) or below (-1) the nominal one.
fn absorbing(network: &Network, effect: &Effect) -> Vec<(String, f64)> {
    let bodies = touched(network, effect);
    let springs = |sign: f64| {
        elements(network, &bodies, |law| matches!(law, Law::Spring(_)), true).map(move |name| (format!("elements.{name}.stiffness"), sign))
    };
    let dampers = |sign: f64| {
        elements(network, &bodies, |law| matches!(law, Law::Damper(_)), false).map(move |name| (format!("elements.{name}.damping"), sign))
    };
    match &effect.physics {
        Physics::Inertia { .. } => bodies.iter().map(|body| (format!("bodies.{}", network.bodies[*body].name), -1.0)).collect(),
        Physics::SeriesCompliance { .. } => springs(1.0).collect(),
        Physics::Delay { .. } | Physics::Bandwidth { .. } => dampers(1.0).collect(),
        Physics::BackEmf { .. } => dampers(-1.0).collect(),
        // In a joint, bristles that hold are a spring too.
        Physics::Law(law) if law.takes_energy() => dampers(-1.0).chain(springs(-1.0)).collect(),
        Physics::Law(_) | Physics::Saturation { .. } => Vec::new(),
    }
}

/// The bodies that an effect touches.
fn touched(network: &Network, effect: &Effect) -> Vec<usize> {
    match &effect.site {
        Site::Between(ends) => ends.iter().filter_map(|name| network.body(name)).collect(),
        Site::Signal(name) => {
            network.inputs.iter().filter(|input| input.kind == InputKind::Force && input.name == *name).map(|input| input.on).collect()
        }
    }
}

/// Names of elements of the device that touch one of the bodies, or join just these.
fn elements<'a>(network: &'a Network, bodies: &'a [usize], which: fn(&Law) -> bool, joins: bool) -> impl Iterator<Item = &'a str> {
    let near = move |body: &usize| bodies.contains(body);
    network
        .elements
        .iter()
        .filter(move |element| {
            let mut ends = element.between.iter().flatten();
            let is_near = if joins { element.between.iter().all(Option::is_some) && ends.all(near) } else { ends.any(near) };
            !element.of_grip && which(&element.law) && is_near
        })
        .map(|element| element.name.as_str())
}
