//! An actuator that follows its command with a first-order lag.

use crate::hypothesis::builder::{Freedom, key};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::InputKind;

pub(super) const PHYSICS: Physics = Physics {
    name: "bandwidth",
    family: Family::Lag,
    words: "a limited bandwidth",
    size: "bandwidth",
    against: Against::SignalRate,
    state: State::WithItsVariable,
    mark: Mark::Lag,
    facts: Facts {
        twin: Some("a delay at the only input and at the only output shift the same signal: a second sensor separates them"),
        ..Facts::NONE
    },
    propose: |sites| {
        let inputs = sites.model.inputs.iter().filter(|i| i.kind == InputKind::Force && i.bandwidth == f64::INFINITY);
        let rate = 1.0 / sites.scales.period;
        let room = Freedom { range: (1.0 / sites.scales.duration, 20.0 * rate), neutral: Some(f64::INFINITY), log: true };
        inputs.map(|i| key(sites, &PHYSICS, "inputs", &i.name, "Hz", room, &[0.1 * rate, 0.02 * rate, 0.5 * rate, 0.004 * rate])).collect()
    },
};
