//! A delay of an actuator or a sensor.
//!
//! Where a motion drives the model, its recording may be late relative to the others, or the force may be a command that acts later. The motion then has a
//! negative delay. The delay of the only output beside a motion is the motion's own: both shift one signal against the other.

use crate::hypothesis::ForceSpan;
use crate::hypothesis::builder::{even, key, only_input_and_output};
use crate::hypothesis::{Against, Facts, Family, Mark, Physics, State};
use backdrive_plant::model::InputKind;

pub(super) const PHYSICS: Physics = Physics {
    name: "delay",
    family: Family::Lag,
    words: "a delay",
    size: "delay",
    against: Against::SignalRate,
    state: State::WithItsVariable,
    mark: Mark::Delay,
    facts: Facts {
        proportional: true,
        // A motor answers its command within some milliseconds, a bus or a camera within a fifth of a second. Below 0 only beside a prescribed motion.
        plausible: &[("delay", -3e-3, 0.2)],
        twin: Some("a delay at the only input and at the only output shift the same signal: a second sensor separates them"),
        // To first order.
        spans: |_, seen| vec![ForceSpan::proportional(vec![seen.period])],
        ..Facts::NONE
    },
    propose: |sites| {
        let moved = |kind: InputKind| kind == InputKind::Motion;
        let inputs = sites.model.inputs.iter().filter(|i| i.delay == 0.0).map(|i| ("inputs", &i.name, moved(i.kind)));
        let outputs = sites.model.outputs.iter().filter(|o| o.delay == 0.0).map(|o| ("outputs", &o.name, false));
        let (period, duration) = (sites.scales.period, sites.scales.duration);
        let most = (200.0 * period).min(0.1 * duration);
        let later = [1.0, 5.0, 0.4, 20.0].map(|samples| samples * period);
        let both = [1.0, -1.0, 5.0, -5.0, 0.4, -0.4, 20.0, -20.0].map(|samples| samples * period);
        let single = match (sites.model.inputs.as_slice(), sites.model.outputs.as_slice()) {
            ([input], [_]) => moved(input.kind) || only_input_and_output(sites.model),
            _ => false,
        };
        let one = |(section, name, either): (&str, &String, bool)| {
            let (least, starts) = if either { (-most, both.as_slice()) } else { (0.0, later.as_slice()) };
            let new = key(sites, &PHYSICS, section, name, "s", even(least, most, 0.0), starts).in_samples();
            if single { new.class("delay@input or output".to_string()) } else { new }
        };
        inputs.chain(outputs).map(one).collect()
    },
};
