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
    /// Index of its node among those of the runner.
    pub(super) member: usize,
    /// Whether it is the first of its node: its steps are the node's.
    pub(super) is_first: bool,
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
    /// Takes in what has arrived, and returns whether the present step can be done with it.
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

pub(super) fn lost(stages: &[Stage], member: usize) -> u64 {
    stages.iter().filter(|s| s.member == member).flat_map(|s| &s.inputs).map(|i| i.lost).sum()
}

pub(super) fn refused(stages: &[Stage], member: usize) -> u64 {
    stages.iter().filter(|s| s.member == member).flat_map(|s| &s.inputs).map(Input::refused).sum()
}

pub(super) fn want(stages: &mut [Stage], member: usize, gains: Gains) {
    if gains_are_valid(&gains) {
        stages.iter_mut().filter(|s| s.member == member).for_each(|s| s.wanted.push(gains));
    }
}
