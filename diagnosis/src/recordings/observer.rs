//! The observer in a model: a body that moves as the recording, and what joins it to the device. It is no part of the device.

use backdrive_plant::model::Model;

/// Name of the body that moves as the recording, and of its motion.
pub(crate) const OBSERVER: &str = "the recorded motion";

/// Name of the spring or damper of an observer.
pub(crate) fn name_of(kind: &str) -> String {
    format!("{OBSERVER}, {kind}")
}

/// Which body moves as the recording; `None` in a model without an observer.
pub(crate) fn observer_of(model: &Model) -> Option<usize> {
    model.bodies.iter().position(|b| b.name == OBSERVER)
}

/// The model without its observer.
pub(crate) fn without_observer(model: &Model) -> Model {
    let Some(body) = observer_of(model) else { return model.clone() };
    let mut own = model.clone();
    own.elements.retain(|e| !e.between.contains(&Some(body)));
    own.inputs.retain(|i| i.on != body);
    own.bodies.remove(body);
    // What a hypothesis added stands behind the observer.
    let moved = |at: usize| if at > body { at - 1 } else { at };
    own.elements.iter_mut().flat_map(|e| e.between.iter_mut().flatten()).for_each(|at| *at = moved(*at));
    own.inputs.iter_mut().for_each(|i| i.on = moved(i.on));
    own
}
