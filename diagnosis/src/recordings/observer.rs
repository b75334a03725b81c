//! The observer in a model: a body that moves as the recording, and what joins it to the device. It is no part of the device.

use backdrive_plant::elements::{Kind, Law, kind_named};
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

/// A model whose observer accelerates the measured body as it does that of `reference`: as much firmer as the body is heavier. With an observer of one firmness a device
/// without inertia and without force would follow its recording.
pub(crate) fn rescaled(mut model: Model, reference: &Model) -> Model {
    let inertia = |model: &Model| {
        let spring = model.elements.iter().find(|e| e.name == name_of("spring"))?;
        Some(model.bodies.get(spring.between[0]?)?.inertia)
    };
    let Some(factor) = inertia(&model).zip(inertia(reference)).map(|(own, other)| own / other) else { return model };
    if factor == 1.0 || !factor.is_finite() {
        return model;
    }
    for kind in ["spring", "damper"] {
        let Some(at) = model.elements.iter().position(|e| e.name == name_of(kind)) else { return model };
        let gain = |model: &Model| {
            let element = model.elements.iter().find(|e| e.name == name_of(kind))?;
            element.law.values().first()?.first().copied()
        };
        let (Some(gain), Some(registered), Some(element)) = (gain(reference), kind_named(kind), model.elements.get_mut(at)) else {
            return model;
        };
        if let Some(law) = law_of(registered, factor * gain) {
            element.law = law;
        }
    }
    model
}

/// A spring or damper of this size.
pub(crate) fn law_of(kind: &Kind, size: f64) -> Option<Law> {
    let values: Vec<Vec<f64>> =
        kind.parameters.iter().enumerate().map(|(i, p)| vec![if i == 0 { size } else { p.default.unwrap_or(0.0) }]).collect();
    (kind.build)(&values).ok()
}
