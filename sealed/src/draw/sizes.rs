//! The parameters of a drawn effect.

use super::candidates::{Candidate, What};
use super::options::DrawOptions;
use super::ranges::Probe;
use super::sizing::{DRAG, FRICTION, between, rounded, share};
use crate::effects::{Physics, Site};
use crate::laws::Law;
use crate::laws::draw::{AtBody, AtJoint, Here, Loading};
use crate::network::{Element, Network, Place};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The effect of a candidate with its parameters; `None` where the device does not move there under its working force.
pub(super) fn physics(c: &Candidate, network: &Network, probe: &Probe, options: &DrawOptions, random: &mut ChaCha8Rng) -> Option<Physics> {
    match &c.site {
        Site::Between(ends) => {
            let places = [network.place(&ends[0])?, network.place(&ends[1])?];
            let here = match places {
                [Some(body), None] => Here::Body(at_body(c, body, network, probe, random)?),
                [None, _] | [Some(_), Some(_)] => Here::Joint(at_joint(c, places, network, probe, options, random)?),
            };
            match (c.what, &here) {
                (What::Law(kind, _), here) => (kind.draw)(here, random).map(Physics::Law),
                (What::Inertia, Here::Body(_)) => inertia(network, random),
                (What::SeriesCompliance, Here::Joint(joint)) => series_compliance(joint, places, network, random),
                (What::Inertia, Here::Joint(_)) | (What::SeriesCompliance, Here::Body(_)) => None,
                (What::Delay | What::Bandwidth | What::BackEmf | What::Saturation, _) => None,
            }
        }
        Site::Signal(name) => at_input(c.what, network.inputs[network.input(name)?].on, probe, options, random),
    }
}

fn positive(value: f64) -> Option<f64> {
    (value.is_finite() && value > 0.0).then_some(value)
}

/// What a body does, and the friction that it gets if it gets one.
fn at_body(c: &Candidate, body: usize, network: &Network, probe: &Probe, random: &mut ChaCha8Rng) -> Option<AtBody> {
    let places = [Some(body), None];
    let (travel, speed) = (positive(probe.travel(places))?, positive(probe.speed(places))?);
    let force = positive(probe.body_force(body, network))?;
    let joint = c.joint.map(|index| &network.elements[index]);
    Some(AtBody {
        travel,
        speed,
        force,
        friction: rounded(share(FRICTION, random) * force),
        inertia: network.bodies[body].inertia,
        stated_damping: joint.map_or(0.0, stated_damping),
        joint: c.joint.map(|index| Loading { name: network.elements[index].name.clone(), force: positive(probe.element_force(index)) }),
    })
}

/// N s/m, the damping that the model states in an element; 0 of a law that has no such number.
fn stated_damping(element: &Element) -> f64 {
    element.law.clone().number_mut("damping").map_or(0.0, |damping| *damping)
}

/// What a joint does.
fn at_joint(
    c: &Candidate,
    places: [Place; 2],
    network: &Network,
    probe: &Probe,
    options: &DrawOptions,
    random: &mut ChaCha8Rng,
) -> Option<AtJoint> {
    let joint = c.joint?;
    let Law::Spring(spring) = &network.elements[joint].law else { return None };
    let stiffness = positive(spring.stiffness)?;
    let (stretch, speed) = (positive(probe.travel(places))?, positive(probe.speed(places))?);
    let force = positive(probe.element_force(joint))?;
    let absorbed = 0.01 * options.masked_percent * random.random_range(0.3..=1.0);
    let damping: f64 = network.elements.iter().filter(|element| c.replaces.contains(&element.name)).map(stated_damping).sum();
    Some(AtJoint { stiffness, damping, stretch, speed, force, absorbed })
}

/// The device's mass is what the hand feels of it in free motion: a tenth more is felt.
fn inertia(network: &Network, random: &mut ChaCha8Rng) -> Option<Physics> {
    let all: f64 = network.bodies.iter().map(|body| body.inertia).sum();
    Some(Physics::Inertia { inertia: rounded(positive(all)? * between(0.1, 0.4, random)) })
}

/// Two to eight times as stiff as the joint itself: 12 to 50 % more yielding; the part in between weighs 3 to 15 % of the lighter neighbour.
fn series_compliance(joint: &AtJoint, places: [Place; 2], network: &Network, random: &mut ChaCha8Rng) -> Option<Physics> {
    let neighbour = places.iter().flatten().map(|body| network.bodies[*body].inertia).filter(|inertia| *inertia > 0.0);
    let inertia = positive(neighbour.fold(f64::INFINITY, f64::min))? * between(0.03, 0.15, random);
    let stiffness = joint.stiffness * between(2.0, 8.0, random);
    let damping = 2.0 * between(0.01, 0.1, random) * (stiffness * inertia).sqrt();
    Some(Physics::SeriesCompliance { stiffness: rounded(stiffness), damping: rounded(damping), inertia: rounded(inertia) })
}

fn at_input(what: What, body: usize, probe: &Probe, options: &DrawOptions, random: &mut ChaCha8Rng) -> Option<Physics> {
    let places = [Some(body), None];
    Some(match what {
        // A few periods: at the crossover of some 60 Hz, each ms turns the phase by 22 degrees.
        What::Delay => Physics::Delay { delay: rounded(options.period_s * between(1.0, 8.0, random)) },
        // An amplifier of 50 to 400 Hz turns it by 50 to 9 degrees.
        What::Bandwidth => Physics::Bandwidth { bandwidth: rounded(between(50.0, 400.0, random)) },
        What::BackEmf => {
            Physics::BackEmf { back_emf: rounded(share(DRAG, random) * options.working_force_n / positive(probe.speed(places))?) }
        }
        // Half to nine tenths of the working force still pass.
        What::Saturation => Physics::Saturation { saturation: rounded(options.working_force_n * between(0.5, 0.9, random)) },
        What::Law(..) | What::Inertia | What::SeriesCompliance => return None,
    })
}
