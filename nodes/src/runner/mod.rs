//! Drives the stages of one node, or of several that share a process, over a transport in either clock.
//!
//! One rule for both: at step k a stage waits until all its inputs for k are there. In real time it waits at most until one period has passed since
//! it could have begun; then it steps with what it has. In real time it does not begin step k before `t0 + k * period`. A stage that is late (the
//! machine was busy) does its late steps one after the other, each with its own inputs, so a hold-up of the whole machine costs no sample. Only
//! beyond [`Options::horizon_s`] does it go on at the step now due, and reports this.

mod control;
mod error;
mod lockstep;
mod member;
mod realtime;
mod stage;
mod state;
mod step;
mod teller;
mod together;

pub use control::{Control, Options, Told};
pub use error::RunError;
pub use state::Runner;

use crate::clock::{Start, now_ns};
use crate::protocol::NodeStatus;
use crate::stage::Clock;
use stage::{lost, refused};
use std::sync::Arc;

impl Runner {
    /// Runs until all steps are done or `control` stops it; reports events and progress on the way, and returns the figures of the whole run, one set
    /// for each node.
    ///
    /// # Errors
    /// In lockstep a missing input or a lost sample; in either clock a transport that fails for good.
    pub fn run(&mut self, start: Start, control: &Arc<Control>, tell: &mut dyn FnMut(Told)) -> Result<Vec<NodeStatus>, RunError> {
        self.reported_at = now_ns();
        match self.timing.clock {
            Clock::Lockstep => self.run_lockstep(control, tell)?,
            Clock::Realtime => self.run_realtime(start, control, tell)?,
        }
        Ok(self
            .members
            .iter()
            .enumerate()
            .map(|(i, m)| m.report((lost(&self.stages, i), refused(&self.stages, i)), &m.loop_time))
            .collect())
    }
}
