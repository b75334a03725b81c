//! A coupling as a node: a stage at the master, a stage at the slave, and two connections between them that are the link.

use super::velocity::Velocity;
use super::{Conditions, Far, Law, Near, Own, Packet};
use crate::core::{Core, Events, Port, Tick};
use crate::freshness::{Freshness, bridged_steps};
use crate::scaling::{GainPlan, Ramp};
use backdrive_msgs::{Gains, MAX_AXES, Sample, flag};

/// A force scale below this gives no force, and none of the hand is sent: dividing by it would give no information.
const LEAST_LAMBDA: f64 = 1e-9;

/// The end of the link at one side.
struct Link {
    fresh: Freshness,
    hold_steps: u64,
    /// What was heard last comes of a side that hears nothing itself.
    outdated: bool,
}

impl Link {
    fn new(stale_after_s: f64, period_s: f64) -> Link {
        Link { fresh: Freshness::default(), hold_steps: bridged_steps(stale_after_s, period_s), outdated: false }
    }

    /// The new packets of all axes, if any have come.
    fn hear(&mut self, port: &Port) -> Option<Sample> {
        let sample = *self.fresh.new_sample(port, |s| s.position[0])?;
        self.outdated = sample.flags & flag::STALE != 0;
        Some(sample)
    }

    /// Whether packets came and have stopped coming.
    fn is_stale(&self) -> bool {
        self.fresh.begun() && self.fresh.stale_steps > self.hold_steps
    }
}

fn heard(sample: Option<&Sample>, axis: usize) -> Option<Packet> {
    let sample = sample?;
    let packet = Packet { position: sample.position[axis], velocity: sample.velocity[axis], effort: sample.effort[axis] };
    (packet.position.is_finite() && packet.velocity.is_finite() && packet.effort.is_finite()).then_some(packet)
}

fn say(sample: &mut Sample, axis: usize, packet: Packet) {
    (sample.position[axis], sample.velocity[axis], sample.effort[axis]) = (packet.position, packet.velocity, packet.effort);
}

/// What is measured, or 0.
fn known(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

/// Inputs: `motion` (position of the master), `from_far` (the link), `hand` (effort: the force of the hand on the master, for laws that need it).
/// Outputs: `force` (effort F_f = lambda times the law's), `to_far` (the link).
///
/// When packets stop coming the force is not measured and the master removes its force, as with [`crate::scaling::Backward`].
pub struct NearNode {
    plan: GainPlan,
    changes_done: usize,
    mu: Ramp,
    lambda: Ramp,
    period_s: f64,
    axes: Vec<(Box<dyn Near>, Velocity)>,
    motion: Freshness,
    hand: Freshness,
    link: Link,
}

impl NearNode {
    /// The side at the master for this number of axes. Velocities are computed from positions behind a low-pass of the corner `velocity_hz`.
    pub fn new(axes: usize, law: &Law, plan: GainPlan, conditions: &Conditions, velocity_hz: f64, stale_after_s: f64) -> NearNode {
        let period_s = conditions.period_s;
        let axis = |_| (law.near(conditions), Velocity::new(velocity_hz, period_s));
        NearNode {
            changes_done: 0,
            mu: Ramp::new(plan.mu),
            lambda: Ramp::new(plan.lambda),
            plan,
            period_s,
            axes: (0..axes.min(MAX_AXES)).map(axis).collect(),
            motion: Freshness::default(),
            hand: Freshness::default(),
            link: Link::new(stale_after_s, period_s),
        }
    }
}

impl Core for NearNode {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        if let Some(change) = self.plan.due(&mut self.changes_done, tick) {
            self.mu.aim(change.mu, self.plan.ramp_s, self.period_s);
            self.lambda.aim(change.lambda, self.plan.ramp_s, self.period_s);
        }
        let (mu, lambda) = (self.mu.step(), self.lambda.step());
        let ([motion, from_far, rest @ ..], [force, to_far, ..]) = (inputs, outputs) else { return };
        let packets = self.link.hear(from_far);
        let hand = rest.first().and_then(|port| self.hand.new_sample(port, |s| s.effort[0]).copied());
        // Without a measurement there is nothing to send: the far side then holds, and the master removes its force.
        let Some(motion) = self.motion.new_sample(motion, |s| s.position[0]).copied() else { return };
        let silent = self.link.is_stale();
        // The link was bridged here already: the master need not bridge it once more.
        if self.link.outdated || silent {
            force.flags |= flag::STALE;
        }
        for (axis, (law, velocity)) in self.axes.iter_mut().enumerate().take(motion.len()) {
            if !motion.position[axis].is_finite() {
                continue;
            }
            let position = mu * motion.position[axis];
            let (moved, velocity) = velocity.step(position, self.period_s);
            let pushed = hand.map_or(0.0, |h| known(h.effort[axis]));
            let pushed = if lambda > LEAST_LAMBDA { pushed / lambda } else { 0.0 };
            let own = Own { position, velocity, moved, force: pushed, power_scale: mu * lambda };
            let (played, packet) = law.step(&own, heard(packets.as_ref(), axis).as_ref(), self.period_s);
            if !silent {
                force.effort[axis] = lambda * played;
            }
            say(to_far, axis, packet);
        }
    }

    fn set_gains(&mut self, gains: &Gains) {
        self.mu.aim(gains.mu, gains.ramp_s, self.period_s);
        self.lambda.aim(gains.lambda, gains.ramp_s, self.period_s);
    }

    fn gains(&self) -> Option<(f64, f64)> {
        Some((self.mu.now, self.lambda.now))
    }
}

/// Inputs `contact` (position, velocity and effort of the slave, one step late), `from_near` (the link); outputs `command` (position),
/// `to_near` (the link).
///
/// Before the first packet the slave is commanded to stay where it is. When packets or contact samples stop coming, the law stands still, the slave
/// holds, and the packets carry the flag STALE.
pub struct FarNode {
    period_s: f64,
    axes: Vec<(Box<dyn Far>, f64)>,
    contact: Freshness,
    slave: Option<Sample>,
    /// Where it was when it was first heard of.
    rest: Option<Sample>,
    link: Link,
    said: Sample,
}

impl FarNode {
    /// The side at the slave for this number of axes.
    pub fn new(axes: usize, law: &Law, conditions: &Conditions, stale_after_s: f64) -> FarNode {
        FarNode {
            period_s: conditions.period_s,
            axes: (0..axes.min(MAX_AXES)).map(|_| (law.far(conditions), f64::NAN)).collect(),
            contact: Freshness::default(),
            slave: None,
            rest: None,
            link: Link::new(stale_after_s, conditions.period_s),
            said: Sample::new(axes),
        }
    }
}

impl Core for FarNode {
    fn step(&mut self, _tick: &Tick, inputs: &[Port], outputs: &mut [Sample], _events: &mut Events) {
        let ([contact, from_near, ..], [command, to_near, ..]) = (inputs, outputs) else { return };
        let packets = self.link.hear(from_near);
        if let Some(slave) = self.contact.new_sample(contact, |s| s.position[0]) {
            self.slave = Some(*slave);
        }
        // Where the slave is must be known before it is moved.
        let Some(slave) = self.slave else { return };
        if !self.link.fresh.begun() {
            let rest = self.rest.get_or_insert(slave);
            for axis in 0..slave.len() {
                command.position[axis] = known(rest.position[axis]);
            }
            return;
        }
        // A slave that is silent feels nothing any more: its last contact force must not be reflected for ever.
        if self.link.is_stale() || self.contact.stale_steps > self.link.hold_steps {
            to_near.flags |= flag::STALE;
            (to_near.position, to_near.velocity, to_near.effort) = (self.said.position, self.said.velocity, self.said.effort);
            return;
        }
        for (axis, (law, before)) in self.axes.iter_mut().enumerate().take(slave.len()) {
            let position = known(slave.position[axis]);
            let moved = if before.is_finite() { position - *before } else { 0.0 };
            *before = position;
            let velocity = known(slave.velocity[axis]);
            let own = Own { position, velocity, moved, force: known(slave.effort[axis]), power_scale: 1.0 };
            let (wanted, packet) = law.step(&own, heard(packets.as_ref(), axis).as_ref(), self.period_s);
            command.position[axis] = wanted;
            say(to_near, axis, packet);
        }
        if slave.flags & flag::STALE != 0 {
            to_near.flags |= flag::STALE;
        }
        self.said = *to_near;
    }
}
