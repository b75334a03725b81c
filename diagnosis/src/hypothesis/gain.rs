//! An actuator or a sensor of another scale than 1.

use super::Physics;
use super::builder::{even, key};

pub(super) const PHYSICS: Physics = Physics {
    name: "gain",
    family: "scale",
    contains: &[],
    propose: |sites| {
        // A gain other than 1 is stated, so it is a number that may be off.
        let inputs = sites.model.inputs.iter().filter(|i| i.gain == 1.0).map(|i| ("inputs", &i.name));
        let outputs = sites.model.outputs.iter().filter(|o| o.gain == 1.0).map(|o| ("outputs", &o.name));
        inputs.chain(outputs).map(|(section, name)| key(sites, &PHYSICS, section, name, "-", even(0.1, 10.0, 1.0), &[1.1, 0.9])).collect()
    },
};
