//! Positions that no spring holds, which are compared by their displacement over a lag.

use super::record::Record;
use crate::physics::physics_named;
use backdrive_plant::model::{Element, InputKind, Model, OutputKind};

/// A lag for positions that nothing holds back: without a spring to ground, a small wrong force moves them without bounds.
pub(super) fn lag_of(model: &Model, fit: &[Record], output: usize) -> usize {
    let OutputKind::Position(body) = model.outputs[output].kind else { return 0 };
    if is_held(model, body) {
        return 0;
    }
    let shortest = fit.iter().map(|r| r.len).min().unwrap_or(0);
    (shortest / 150).max(20)
}

/// Whether springs, or what acts like one, tie a body to ground or to a body whose motion is prescribed.
fn is_held(model: &Model, body: usize) -> bool {
    let fixed = |place: Option<usize>| place.is_none_or(|b| model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == b));
    let holds = |element: &&Element| physics_named(element.law.kind().name).is_some_and(|p| p.facts.holds);
    let mut reached = vec![false; model.bodies.len()];
    let mut waiting = vec![body];
    while let Some(at) = waiting.pop() {
        if fixed(Some(at)) {
            return true;
        }
        if std::mem::replace(&mut reached[at], true) {
            continue;
        }
        for element in model.elements.iter().filter(holds) {
            let other = match element.between {
                [Some(a), b] if a == at => b,
                [a, Some(b)] if b == at => a,
                _ => continue,
            };
            match other {
                Some(b) => waiting.push(b),
                None => return true,
            }
        }
    }
    false
}
