//! The motor of a slave that is driven by a force: its limits, and what it does when no force comes.

use crate::core::{Events, Port};
use crate::freshness::{Authority, Freshness};
use backdrive_msgs::{MAX_AXES, flag};
use backdrive_plant::model::Axis;

/// Force on each axis, N or N m, within the limits of force and rate of the model; it decays when none comes.
#[derive(Debug, Clone)]
pub struct Motor {
    authority: Authority,
    force: Freshness,
    asked: [f64; MAX_AXES],
    /// The newest force is of a controller that no command reaches any more.
    outdated: bool,
    applied: [f64; MAX_AXES],
    gap_steps: u64,
    was_decaying: bool,
}

impl Motor {
    /// One that begins to remove the force `stale_after_s` after its last sample.
    pub fn new(stale_after_s: f64, period_s: f64) -> Motor {
        Motor {
            authority: Authority::new(stale_after_s, period_s),
            force: Freshness::default(),
            asked: [0.0; MAX_AXES],
            outdated: false,
            applied: [0.0; MAX_AXES],
            gap_steps: 0,
            was_decaying: false,
        }
    }

    /// Force of the step before, until [`Motor::step`] is called.
    pub fn applied(&self) -> &[f64; MAX_AXES] {
        &self.applied
    }

    /// Hears a port and sets the force; gives the bits of [`flag`].
    pub fn step<'a>(&mut self, port: &Port, period_s: f64, events: &mut Events, axis_of: impl Fn(usize) -> &'a Axis, axes: usize) -> u32 {
        if let Some(force) = self.force.new_sample(port, |s| s.effort[0]) {
            self.outdated = force.flags & flag::STALE != 0;
            for axis in 0..axes {
                // What is not measured on a further axis is not commanded there.
                self.asked[axis] = if force.effort[axis].is_finite() { force.effort[axis] } else { 0.0 };
            }
        }
        let share = self.authority.share(if self.force.begun() { self.force.stale_steps } else { 0 });
        let decaying = self.authority.is_decaying();
        if decaying && !self.was_decaying {
            events.push("drive_stale", self.force.stale_steps as f64, 1);
            self.gap_steps = 0;
        } else if !decaying && self.was_decaying {
            events.push("drive_back", self.gap_steps as f64, 0);
        }
        self.gap_steps = self.gap_steps.max(self.force.stale_steps);
        self.was_decaying = decaying;
        let mut flags = if decaying || self.outdated { flag::STALE } else { 0 };
        for axis in 0..axes {
            let limits = axis_of(axis);
            let most = limits.force.unwrap_or(f64::INFINITY);
            let change = limits.force_rate.unwrap_or(f64::INFINITY) * period_s;
            let (wanted, before) = (share * self.asked[axis], self.applied[axis]);
            self.applied[axis] = wanted.clamp(-most, most).clamp(before - change, before + change);
            if self.applied[axis] != wanted {
                flags |= flag::LIMITED;
            }
        }
        flags
    }
}
