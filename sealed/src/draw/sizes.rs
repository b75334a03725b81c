//! How large a drawn effect is: shares of what the device does under its working force.

use super::candidates::{Candidate, Kind};
use super::ranges::Probe;
use super::{DrawOptions, between, rounded};
use crate::effects::{Physics, Site};
use crate::laws::{
    AsymmetricCoulomb, AsymmetricDamper, Backlash, Bias, BristleField, Cogging, Coulomb, CubicSpring, Dahl, Damper, FrictionDeficit,
    HystereticSpring, Law, LoadFriction, Lugre, QuadraticDrag, RoundedGap, SpringSliders, Stribeck, WarmFriction,
};
use crate::network::{Network, Place};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::PI;

/// Share of the working force that dry friction takes. Below 3 % it is under what a hand tells apart in a force (some
/// 7 % of it, Jones 1989) and little for a stability margin; above 15 % no one would call the device backdrivable.
const FRICTION: [f64; 2] = [0.03, 0.15];

/// Share of the working force that viscous and back-EMF forces take at the working speed: as friction, and somewhat more,
/// since they vanish where the device is slow.
const DRAG: [f64; 2] = [0.05, 0.25];

/// Share of the working force in a motor's ripple: a few per cent is usual, ten per cent poor.
const RIPPLE: [f64; 2] = [0.03, 0.12];

/// The effect of a candidate with its numbers; `None` where the device does not move there under its working force.
pub(super) fn physics(c: &Candidate, network: &Network, probe: &Probe, options: &DrawOptions, random: &mut ChaCha8Rng) -> Option<Physics> {
    let physics = match &c.site {
        Site::Between(ends) => {
            let places = [network.place(&ends[0])?, network.place(&ends[1])?];
            match places {
                [Some(body), None] => at_body(c, body, network, probe, random)?,
                _ => at_joint(c, places, network, probe, options, random)?,
            }
        }
        Site::Signal(name) => at_input(c.kind, network.inputs[network.input(name)?].on, probe, options, random)?,
    };
    Some(physics)
}

fn positive(value: f64) -> Option<f64> {
    (value.is_finite() && value > 0.0).then_some(value)
}

fn share(of: [f64; 2], random: &mut ChaCha8Rng) -> f64 {
    between(of[0], of[1], random)
}

fn at_body(c: &Candidate, body: usize, network: &Network, probe: &Probe, random: &mut ChaCha8Rng) -> Option<Physics> {
    let places = [Some(body), None];
    let (travel, speed) = (positive(probe.travel(places))?, positive(probe.speed(places))?);
    let force = positive(probe.body_force(body, network))?;
    let friction = rounded(share(FRICTION, random) * force);
    let law = match c.kind {
        Kind::Coulomb => Law::Coulomb(Coulomb { force: friction }),
        Kind::AsymmetricCoulomb => {
            // One direction carries 1.3 to 2.5 times the other: less is hardly lopsided.
            let ratio = between(1.3, 2.5, random).sqrt();
            let (high, low) = (rounded(friction * ratio), rounded(friction / ratio));
            let [positive, negative] = if random.random_bool(0.5) { [high, low] } else { [low, high] };
            Law::AsymmetricCoulomb(AsymmetricCoulomb { positive, negative })
        }
        Kind::Stribeck => Law::Stribeck(Stribeck {
            coulomb: friction,
            // Static friction is seldom more than twice the kinetic one.
            at_rest: rounded(friction * between(1.3, 2.0, random)),
            // Falls within a part of the working speed: slower it would be lost in a reversal, faster it would be viscous.
            velocity: rounded(speed * between(0.03, 0.3, random)),
        }),
        Kind::FrictionDeficit => Law::FrictionDeficit(FrictionDeficit {
            coulomb: friction,
            // As for Stribeck, the other way.
            rest: rounded(friction / between(1.3, 2.0, random)),
            velocity: rounded(speed * between(0.03, 0.3, random)),
        }),
        Kind::Dahl => Law::Dahl(Dahl { stiffness: rounded(friction / presliding(travel, random)), coulomb: friction }),
        Kind::Lugre => {
            let stiffness = friction / presliding(travel, random);
            // The bristles' own vibration of the body is damped by 10 to 60 % of critical.
            let critical = 2.0 * (stiffness * network.bodies[body].inertia).sqrt();
            Law::Lugre(Lugre {
                stiffness: rounded(stiffness),
                damping: rounded(critical * between(0.1, 0.6, random)),
                coulomb: friction,
                at_rest: rounded(friction * between(1.2, 1.8, random)),
                velocity: rounded(speed * between(0.05, 0.3, random)),
            })
        }
        Kind::MaxwellSlip => sliders(friction, presliding(travel, random), random),
        Kind::BristleField => field(friction, friction / presliding(travel, random), speed, random),
        Kind::WarmFriction => {
            // The power of steady work warms the joint by 0.5 to 2 of the half-warming within 2 to 20 s: a session of a minute sees it change.
            let cooling_time = between(2.0, 20.0, random);
            let half_warming = between(10.0, 40.0, random);
            let power = friction * speed * 2.0 / PI;
            let heat_capacity = power * cooling_time / (half_warming * between(0.5, 2.0, random));
            Law::WarmFriction(WarmFriction {
                force: friction,
                half_warming: rounded(half_warming),
                heat_capacity: rounded(heat_capacity),
                cooling_time: rounded(cooling_time),
            })
        }
        Kind::LoadFriction => {
            let joint = c.joint?;
            // At the joint's working force the load's part is one to three times the part without load.
            let load = positive(probe.element_force(joint))?;
            let part = between(1.0, 3.0, random);
            Law::LoadFriction(LoadFriction {
                force: rounded(friction / (1.0 + part)),
                coefficient: rounded(friction * part / (1.0 + part) / load),
                joint: network.elements[joint].name.clone(),
            })
        }
        Kind::Damper => Law::Damper(Damper { damping: rounded(share(DRAG, random) * force / speed) }),
        // A weight or a spring under tension that nobody balanced.
        Kind::Bias => Law::Bias(Bias { force: if random.random_bool(0.5) { friction } else { -friction } }),
        Kind::AsymmetricDamper => {
            // Beside what the model states; one direction carries 1.5 to 3 times the other.
            let stated = match c.joint.map(|index| &network.elements[index].law) {
                Some(Law::Damper(damper)) => damper.damping,
                _ => 0.0,
            };
            let (more, ratio) = (share(DRAG, random) * force / speed, between(1.5, 3.0, random));
            let (high, low) = (rounded(stated + more), rounded((stated + more) / ratio));
            let [positive, negative] = if random.random_bool(0.5) { [high, low] } else { [low, high] };
            Law::AsymmetricDamper(AsymmetricDamper { positive, negative })
        }
        Kind::QuadraticDrag => Law::QuadraticDrag(QuadraticDrag { coefficient: rounded(share(DRAG, random) * force / (speed * speed)) }),
        Kind::Cogging => Law::Cogging(Cogging {
            amplitude: rounded(share(RIPPLE, random) * force),
            // Two to ten ripples on the travel: fewer are a spring, more a noise.
            period: rounded(2.0 * travel / between(2.0, 10.0, random)),
            phase: rounded(random.random_range(0.0..2.0 * PI)),
        }),
        Kind::Inertia => {
            // The device's mass is what the hand feels of it in free motion: a tenth more is felt.
            let all: f64 = network.bodies.iter().map(|body| body.inertia).sum();
            return Some(Physics::Inertia { inertia: rounded(positive(all)? * between(0.1, 0.4, random)) });
        }
        _ => return None,
    };
    Some(Physics::Law(law))
}

/// m, the way within which friction lets go: 1 to 15 % of the travel, which reversals show.
fn presliding(travel: f64, random: &mut ChaCha8Rng) -> f64 {
    travel * between(0.01, 0.15, random)
}

/// Three to five sliders that let go one after the other between 0.2 and 3 times `way` (m).
fn sliders(friction: f64, way: f64, random: &mut ChaCha8Rng) -> Law {
    let count = random.random_range(3..=5);
    let shares: Vec<f64> = (0..count).map(|_| random.random_range(0.5..=1.5)).collect();
    let sum: f64 = shares.iter().sum();
    let force: Vec<f64> = shares.iter().map(|share| rounded(friction * share / sum)).collect();
    let lets_go = |i: usize| way * 0.2 * 15.0_f64.powf(i as f64 / (count - 1) as f64);
    let stiffness = force.iter().enumerate().map(|(i, force)| rounded(force / lets_go(i))).collect();
    Law::MaxwellSlip(SpringSliders { stiffness, force })
}

fn field(friction: f64, stiffness: f64, speed: f64, random: &mut ChaCha8Rng) -> Law {
    Law::BristleField(BristleField {
        stiffness: rounded(stiffness),
        force: friction,
        // Logistic scales: the middle four fifths of the bristles span a factor of 4 to 20.
        stiffness_spread: rounded(random.random_range(0.3..0.7)),
        force_spread: rounded(random.random_range(0.3..0.7)),
        count: random.random_range(40..=80),
        // Half of the fields hold tighter at rest.
        static_ratio: if random.random_bool(0.5) { 1.0 } else { rounded(between(1.2, 1.8, random)) },
        velocity: rounded(speed * between(0.05, 0.3, random)),
    })
}

fn at_joint(
    c: &Candidate,
    places: [Place; 2],
    network: &Network,
    probe: &Probe,
    options: &DrawOptions,
    random: &mut ChaCha8Rng,
) -> Option<Physics> {
    let joint = c.joint?;
    let Law::Spring(spring) = &network.elements[joint].law else { return None };
    let nominal = positive(spring.stiffness)?;
    let (stretch, speed) = (positive(probe.travel(places))?, positive(probe.speed(places))?);
    let force = positive(probe.element_force(joint))?;
    // The stiffness that the model states has absorbed part of the effect: the joint's own is higher where a gap softens it, lower
    // where it stiffens.
    let absorbed = 0.01 * options.masked_percent * random.random_range(0.3..=1.0);
    let damping: f64 = network
        .elements
        .iter()
        .filter(|element| c.replaces.contains(&element.name))
        .map(|element| if let Law::Damper(damper) = &element.law { damper.damping } else { 0.0 })
        .sum();
    let law = match c.kind {
        Kind::CubicSpring => {
            let stiffness = nominal * (1.0 - absorbed);
            // At the working stretch the cubic part is 15 to 60 % of the linear one.
            Law::CubicSpring(CubicSpring {
                stiffness: rounded(stiffness),
                cubic: rounded(stiffness * between(0.15, 0.6, random) / (stretch * stretch)),
            })
        }
        Kind::HystereticSpring => {
            // A loop of 5 to 20 % of the working force on each side, reached within a third to a twentieth of the working stretch.
            let half = rounded(share([0.05, 0.2], random) * force);
            Law::HystereticSpring(HystereticSpring {
                stiffness_positive: rounded(nominal),
                stiffness_negative: rounded(nominal),
                offset_positive: half,
                offset_negative: -half,
                bandwidth: rounded(between(3.0, 20.0, random) / stretch),
            })
        }
        Kind::Backlash => Law::Backlash(Backlash {
            gap: rounded(2.0 * stretch * between(0.1, 0.6, random)),
            stiffness: rounded(nominal * (1.0 + absorbed)),
            damping: rounded(damping),
        }),
        Kind::RoundedGap => {
            // 10 to 60 % of the working stretch on each side, with edges rounded over 5 to 25 % of that.
            let half = stretch * between(0.1, 0.6, random);
            Law::RoundedGap(RoundedGap {
                gap: rounded(2.0 * half),
                rounding: rounded(half * between(0.05, 0.25, random)),
                stiffness: rounded(nominal * (1.0 + absorbed)),
                damping: rounded(damping),
            })
        }
        Kind::JointBristles => {
            // Rubbing flanks: 5 to 20 % of the working force, let go within 3 to 30 % of the working stretch.
            let friction = rounded(share([0.05, 0.2], random) * force);
            field(friction, friction / (stretch * between(0.03, 0.3, random)), speed, random)
        }
        Kind::SeriesCompliance => {
            // Two to eight times as stiff as the joint itself: 12 to 50 % more yielding; the part in between weighs 3 to 15 %
            // of the lighter neighbour.
            let neighbour = places.iter().flatten().map(|body| network.bodies[*body].inertia).filter(|inertia| *inertia > 0.0);
            let inertia = positive(neighbour.fold(f64::INFINITY, f64::min))? * between(0.03, 0.15, random);
            let stiffness = nominal * between(2.0, 8.0, random);
            let damping = 2.0 * between(0.01, 0.1, random) * (stiffness * inertia).sqrt();
            return Some(Physics::SeriesCompliance { stiffness: rounded(stiffness), damping: rounded(damping), inertia: rounded(inertia) });
        }
        _ => return None,
    };
    Some(Physics::Law(law))
}

fn at_input(kind: Kind, body: usize, probe: &Probe, options: &DrawOptions, random: &mut ChaCha8Rng) -> Option<Physics> {
    let places = [Some(body), None];
    Some(match kind {
        // A few periods: at the crossover of some 60 Hz, each ms turns the phase by 22 degrees.
        Kind::Delay => Physics::Delay { delay: rounded(options.period_s * between(1.0, 8.0, random)) },
        // An amplifier of 50 to 400 Hz turns it by 50 to 9 degrees.
        Kind::Bandwidth => Physics::Bandwidth { bandwidth: rounded(between(50.0, 400.0, random)) },
        Kind::BackEmf => {
            Physics::BackEmf { back_emf: rounded(share(DRAG, random) * options.working_force_n / positive(probe.speed(places))?) }
        }
        // Half to nine tenths of the working force still pass.
        Kind::Saturation => Physics::Saturation { saturation: rounded(options.working_force_n * between(0.5, 0.9, random)) },
        _ => return None,
    })
}
