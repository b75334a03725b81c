//! An actuator or a sensor of another scale than 1.

use crate::hypothesis::builder::{even, key};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};

pub(super) const PHYSICS: Physics = Physics {
    name: "gain",
    family: Family::Scale,
    words: "a wrong gain",
    size: "gain",
    against: Against::Signal,
    state: State::WithItsVariable,
    mark: Mark::Other,
    // An amplifier or a gauge that is off by more is another one, or its unit is.
    facts: Facts { plausible: &[("gain", 0.25, 4.0)], ..Facts::NONE },
    propose: |sites| {
        // A gain other than 1 is stated, so it is a parameter that may be off.
        let inputs = sites.model.inputs.iter().filter(|i| i.gain == 1.0).map(|i| ("inputs", &i.name));
        let outputs = sites.model.outputs.iter().filter(|o| o.gain == 1.0).map(|o| ("outputs", &o.name));
        inputs.chain(outputs).map(|(section, name)| key(sites, &PHYSICS, section, name, "-", even(0.1, 10.0, 1.0), &[1.1, 0.9])).collect()
    },
};
