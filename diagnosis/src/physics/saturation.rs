//! The largest force that an actuator gives.

use crate::hypothesis::builder::{even, key};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::InputKind;

pub(super) const PHYSICS: Physics = Physics {
    name: "saturation",
    family: Family::Limit,
    words: "saturation",
    size: "saturation",
    against: Against::Signal,
    state: State::Large,
    mark: Mark::Limit,
    facts: Facts::NONE,
    propose: |sites| {
        let inputs = sites.model.inputs.iter().enumerate();
        let limitless = inputs.filter(|(_, i)| i.kind == InputKind::Force && i.saturation == f64::INFINITY);
        let one = |(index, input): (usize, &backdrive_plant::model::Input)| {
            let peak = sites.scales.input(index).peak;
            // What it takes off depends on how often the signal is that large: a start has to be near.
            let starts = [0.9, 0.75, 0.5, 0.3, 0.62, 0.4, 0.23].map(|share| share * peak);
            (peak > 0.0).then(|| key(sites, &PHYSICS, "inputs", &input.name, "N", even(0.01 * peak, peak, peak), &starts))
        };
        limitless.filter_map(one).collect()
    },
};
