//! Where an unknown force or signal error may act.

use crate::hypothesis::is_seen;
use crate::recordings::observer::observer_of;
use backdrive_plant::model::{InputKind, Model};

/// Where the unknown acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Channel {
    /// A force between two places, positive as an element's: it pushes the first end backwards.
    Force([Option<usize>; 2]),
    /// An error of a motion input, in its unit.
    Motion(usize),
    /// An error of an output, in its unit.
    Sensor(usize),
}

/// Every place whose force shows in an output: bodies against ground, joints, motion inputs, outputs.
pub(super) fn channels(model: &Model) -> Vec<Channel> {
    let observer = observer_of(model);
    let is_of_device = |ends: &[Option<usize>; 2]| observer.is_none() || !ends.contains(&observer);
    let mut ends: Vec<[Option<usize>; 2]> = (0..model.bodies.len()).map(|b| [Some(b), None]).collect();
    for element in &model.elements {
        let [a, b] = element.between;
        let known = ends.iter().any(|e| *e == [a, b] || *e == [b, a]);
        if !known {
            ends.push([a, b]);
        }
    }
    let forces = ends.into_iter().filter(is_of_device).filter(|e| is_seen(model, *e)).map(Channel::Force);
    let moved = model.inputs.iter().enumerate().filter(|(_, i)| i.kind == InputKind::Motion && is_of_device(&[Some(i.on), None]));
    let motions = moved.filter(|(_, i)| is_seen(model, [Some(i.on), None]) || joins_free(model, i.on)).map(|(i, _)| Channel::Motion(i));
    forces.chain(motions).chain((0..model.outputs.len()).map(Channel::Sensor)).collect()
}

fn joins_free(model: &Model, body: usize) -> bool {
    model.elements.iter().any(|e| e.between.contains(&Some(body)) && is_seen(model, e.between))
}
