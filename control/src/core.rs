//! What every core is: a function of (time, inputs, its state).

use crate::live_margin::MarginEstimate;
use backdrive_msgs::{Gains, MAX_AXES, Sample};

/// The step that is being done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Number of the step, from 0.
    pub step: u64,
    /// Time since the start of the graph, s: `step * period_s`.
    pub time_s: f64,
    /// 1 / rate, s.
    pub period_s: f64,
}

/// What an input port holds at a step.
#[derive(Debug, Clone, Copy)]
pub struct Port {
    /// The newest sample that the port's delay lets through; `None` before the first.
    pub sample: Option<Sample>,
    /// Steps since the sample that should be here: 0 when it is, and counting up from the start of
    /// the graph while there is none.
    pub age_steps: u64,
}

impl Port {
    /// A port on which nothing has arrived yet.
    pub const EMPTY: Port = Port { sample: None, age_steps: 0 };
}

/// Collects what happened in a step. It never allocates; what does not fit is counted.
#[derive(Debug)]
pub struct Events {
    list: [(&'static str, f64, u32); 8],
    len: usize,
    /// Events that did not fit.
    pub dropped: u64,
}

impl Default for Events {
    fn default() -> Events {
        Events { list: [("", 0.0, 0); 8], len: 0, dropped: 0 }
    }
}

impl Events {
    /// Notes an event: its machine-readable name, a number that belongs to it (or
    /// [`backdrive_msgs::NOT_MEASURED`]), and its severity, 0 info, 1 warning, 2 error.
    pub fn push(&mut self, kind: &'static str, value: f64, severity: u32) {
        match self.list.get_mut(self.len) {
            Some(slot) => {
                *slot = (kind, value, severity);
                self.len += 1;
            }
            None => self.dropped += 1,
        }
    }

    /// Takes all of them out.
    #[inline]
    pub fn drain(&mut self) -> impl Iterator<Item = (&'static str, f64, u32)> + '_ {
        let len = std::mem::take(&mut self.len);
        self.list[..len].iter().copied()
    }
}

/// A core: stepped once per tick, in order of step.
pub trait Core: Send {
    /// Does one step. `inputs` and `outputs` are in the order in which the node kind lists its ports. Each output arrives as [`Sample::new`] of its
    /// axes and is sent as `step` leaves it (the runner fills step, sequence, stamp and source).
    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events);

    /// Called once in the node's own process before the first step, where all else is ready: a device is opened and checked here. Gives notes for a
    /// person.
    ///
    /// # Errors
    /// One sentence, where the run cannot begin.
    fn begin(&mut self) -> Result<Vec<String>, String> {
        Ok(Vec::new())
    }

    /// The values of a list of named numbers of its node, such as the rate of a device's bus; asked about ten times a second. `list` counts the
    /// node's lists from 0.
    fn report(&self, _list: usize) -> Option<[f64; MAX_AXES]> {
        None
    }

    /// New gains are wanted from now on. Most cores have none.
    fn set_gains(&mut self, _gains: &Gains) {}

    /// Whether the core is to take part in the loop from now on, faded over `ramp_s` seconds. Only a canceller can be left out of a loop that runs.
    fn set_active(&mut self, _active: bool, _ramp_s: f64) {}

    /// The gains now in force, if the core has any: (mu, lambda).
    fn gains(&self) -> Option<(f64, f64)> {
        None
    }

    /// The loop's stability margin, if the core can estimate it.
    fn margin(&self) -> Option<MarginEstimate> {
        None
    }
}
