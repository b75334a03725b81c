//! A stage with its ports.

use crate::book::{Wanted, gains_are_valid};
use crate::input::Input;
use crate::transport::{Publisher, TransportError};
use backdrive_control::core::{Core, Port};
use backdrive_msgs::topic::Topic;
use backdrive_msgs::{Gains, Sample};

pub(super) struct Output {
    pub(super) publisher: Box<dyn Publisher>,
    pub(super) topic: Topic,
    pub(super) axes: usize,
    pub(super) sequence: u64,
}

pub(super) struct Stage {
    pub(super) inputs: Vec<Input>,
    pub(super) satisfied: Vec<bool>,
    pub(super) ports: Vec<Port>,
    pub(super) outputs: Vec<Output>,
    pub(super) samples: Vec<Sample>,
    pub(super) core: Box<dyn Core>,
    pub(super) wanted: Wanted,
    pub(super) step: u64,
    /// When the step at hand could begin, ns.
    pub(super) waiting_since: i64,
}

impl Stage {
    /// Takes in what has arrived, and tells whether the step at hand can be done with it.
    pub(super) fn poll(&mut self) -> Result<bool, TransportError> {
        let mut ready = true;
        for (input, satisfied) in self.inputs.iter_mut().zip(&mut self.satisfied) {
            *satisfied = input.poll(self.step)?;
            input.set_awaited(!*satisfied);
            ready &= *satisfied || !input.is_worth_waiting_for();
        }
        Ok(ready)
    }
}

pub(super) fn lost(stages: &[Stage]) -> u64 {
    stages.iter().flat_map(|s| &s.inputs).map(|i| i.lost).sum()
}

pub(super) fn want(stages: &mut [Stage], gains: Gains) {
    if gains_are_valid(&gains) {
        stages.iter_mut().for_each(|s| s.wanted.push(gains));
    }
}
