//! The master plant as a node: the hand pulls at it, the reflected force drives its motor, its position is measured.

use crate::core::{Core, Events, Port, Tick};
use crate::freshness::{Authority, Freshness};
use crate::mechanism::Mechanism;
use backdrive_msgs::{MAX_AXES, Sample, flag};

/// Inputs `intent`, `force`; outputs `measured` (position; effort = the force applied from this step to the
/// next), `user` (position, velocity and force of the user's hand on the handle: known in simulation only).
///
/// At step k the plant is first carried from k-1 to k under the force of step k-1, held, and the hand's
/// motion from intent k-1 to intent k; then it is measured. So `measured` is a recording as the model file
/// means it: the effort of sample k holds until sample k+1.
pub struct Master {
    device: Box<dyn Mechanism>,
    authority: Authority,
    force: Freshness,
    intent: Freshness,
    last_force: [f64; MAX_AXES],
    /// The newest force is of a slave that no command reaches any more, or of a link that is silent: the sender has waited already.
    outdated: bool,
    /// Steps without a force, at most, since it began to decay.
    gap_steps: u64,
    applied: [f64; MAX_AXES],
    hand: [f64; MAX_AXES],
    started: bool,
    was_decaying: bool,
    was_finite: bool,
}

impl Master {
    /// A master that removes the force `stale_after_s` after its last sample.
    pub fn new(device: Box<dyn Mechanism>, stale_after_s: f64, period_s: f64) -> Master {
        Master {
            device,
            authority: Authority::new(stale_after_s, period_s),
            force: Freshness::default(),
            intent: Freshness::default(),
            last_force: [0.0; MAX_AXES],
            outdated: false,
            gap_steps: 0,
            applied: [0.0; MAX_AXES],
            hand: [0.0; MAX_AXES],
            started: false,
            was_decaying: false,
            was_finite: true,
        }
    }

    fn next_force(&mut self, axis: usize, wanted: f64, period_s: f64) -> (f64, bool) {
        let limits = self.device.axis(axis);
        let most = limits.force.unwrap_or(f64::INFINITY);
        let change = limits.force_rate.unwrap_or(f64::INFINITY) * period_s;
        let before = self.applied[axis];
        let force = wanted.clamp(-most, most).clamp(before - change, before + change);
        (force, force != wanted)
    }
}

impl Core for Master {
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let axes = self.device.axes();
        if let Some(intent) = self.intent.new_sample(&inputs[0], |s| s.position[0]) {
            for axis in 0..axes {
                // Where the intent has no value, the hand stays.
                if intent.position[axis].is_finite() {
                    self.hand[axis] = intent.position[axis];
                }
            }
        }
        if self.started {
            self.device.step(&self.applied[..axes], &self.hand[..axes]);
        } else {
            self.device.start(&self.applied[..axes], &self.hand[..axes]);
            self.started = true;
        }

        if let Some(force) = self.force.new_sample(&inputs[1], |s| s.effort[0]) {
            self.outdated = force.flags & flag::STALE != 0;
            for axis in 0..axes {
                // What is not measured on a further axis is not commanded there.
                self.last_force[axis] = if force.effort[axis].is_finite() { force.effort[axis] } else { 0.0 };
            }
        }
        // A sender that bridged a gap in vain has no force to send, and marks this.
        if inputs[1].sample.as_ref().is_some_and(|s| s.flags & flag::STALE != 0 && !s.effort[0].is_finite()) {
            self.outdated = true;
        }
        let share = self.authority.share(match (self.force.begun(), self.outdated) {
            (false, _) => 0,
            (true, false) => self.force.stale_steps,
            (true, true) => u64::MAX,
        });
        let decaying = self.authority.is_decaying();
        if decaying && !self.was_decaying {
            let kind = if self.outdated { "force_outdated" } else { "force_stale" };
            events.push(kind, self.force.stale_steps as f64, 1);
            self.gap_steps = 0;
        } else if !decaying && self.was_decaying {
            events.push("force_back", self.gap_steps as f64, 0);
        }
        self.gap_steps = self.gap_steps.max(self.force.stale_steps);
        self.was_decaying = decaying;

        let mut flags = if decaying { flag::STALE } else { 0 };
        for axis in 0..axes {
            let (force, limited) = self.next_force(axis, share * self.last_force[axis], tick.period_s);
            self.applied[axis] = force;
            if limited {
                flags |= flag::LIMITED;
            }
        }
        let finite = self.device.is_finite();
        if !finite && self.was_finite {
            events.push("state_not_finite", tick.time_s, 2);
        }
        self.was_finite = finite;

        let (measured, user) = outputs.split_at_mut(1);
        for axis in 0..axes {
            measured[0].position[axis] = self.device.measured(axis);
            measured[0].effort[axis] = self.applied[axis];
            user[0].position[axis] = self.device.user_position(axis);
            user[0].velocity[axis] = self.device.user_velocity(axis);
            user[0].effort[axis] = self.device.port_force(axis);
        }
        measured[0].flags = flags;
    }
}
