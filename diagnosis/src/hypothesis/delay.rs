//! A delay of an actuator or a sensor.

use super::Physics;
use super::builder::{even, key, only_input_and_output};

pub(super) const PHYSICS: Physics = Physics {
    name: "delay",
    family: "lag",
    contains: &[],
    propose: |sites| {
        let inputs = sites.model.inputs.iter().filter(|i| i.delay == 0.0).map(|i| ("inputs", &i.name));
        let outputs = sites.model.outputs.iter().filter(|o| o.delay == 0.0).map(|o| ("outputs", &o.name));
        let (period, duration) = (sites.scales.period, sites.scales.duration);
        let most = (200.0 * period).min(0.1 * duration);
        let starts = [1.0, 5.0, 0.4, 20.0].map(|samples| samples * period);
        let one = |(section, name): (&str, &String)| {
            let new = key(sites, &PHYSICS, section, name, "s", even(0.0, most, 0.0), &starts);
            if only_input_and_output(sites.model) { new.class("delay@input or output".to_string()) } else { new }
        };
        inputs.chain(outputs).map(one).collect()
    },
};
