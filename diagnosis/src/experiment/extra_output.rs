//! An output that a device does not have, in a model that was made from its nominal one.

use backdrive_plant::model::{Model, Output, OutputKind};

/// An output of a kind in terms of the nominal model, in a model that was made from it. `None` where what it reads is gone.
pub(super) fn output(nominal: &Model, model: &Model, kind: &OutputKind) -> Option<Output> {
    let body = |b: usize| model.bodies.iter().position(|other| nominal.bodies.get(b).is_some_and(|n| n.name == other.name));
    let element = |e: &usize| model.elements.iter().position(|other| nominal.elements.get(*e).is_some_and(|n| n.name == other.name));
    let kind = match kind {
        OutputKind::Position(b) => OutputKind::Position(body(*b)?),
        OutputKind::Velocity(b) => OutputKind::Velocity(body(*b)?),
        OutputKind::Acceleration(b) => OutputKind::Acceleration(body(*b)?),
        OutputKind::Reaction(b) => OutputKind::Reaction(body(*b)?),
        OutputKind::Force(list) => OutputKind::Force(list.iter().map(element).collect::<Option<_>>()?),
    };
    Some(Output { name: String::new(), kind, gain: 1.0, delay: 0.0, offset: 0.0, resolution: 0.0, noise: 0.0 })
}
