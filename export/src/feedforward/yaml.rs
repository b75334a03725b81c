//! Terms as numbers, in YAML.

use super::terms::{Joint, Term};
use backdrive_plant::model::Model;

/// A text in double quotes: what JSON writes is YAML.
fn text(value: &str) -> String {
    serde_json::Value::from(value).to_string()
}

/// The name of a term, its equation and its parameters.
fn parts(term: &Term) -> (&'static str, &'static str, Vec<(&'static str, f64)>) {
    match *term {
        Term::Coulomb { positive, negative } => {
            ("coulomb", "(positive if dq > 0 else negative) * s", vec![("positive", positive), ("negative", negative)])
        }
        Term::Stribeck { coulomb, rest, velocity } => (
            "stribeck",
            "(coulomb + (rest - coulomb) * exp(-(dq / velocity)^2)) * s",
            vec![("coulomb", coulomb), ("rest", rest), ("velocity", velocity)],
        ),
        Term::Load { driving, driven } => {
            ("load", "(driving if load * dq > 0 else driven) * |load| * s", vec![("driving", driving), ("driven", driven)])
        }
        Term::Viscous { positive, negative } => {
            ("viscous", "(positive if dq > 0 else negative) * dq", vec![("positive", positive), ("negative", negative)])
        }
        Term::Drag { coefficient } => ("drag", "coefficient * dq * |dq|", vec![("coefficient", coefficient)]),
        Term::Spring { stiffness, rest, cubic } => {
            ("spring", "stiffness * (q - rest) + cubic * q^3", vec![("stiffness", stiffness), ("rest", rest), ("cubic", cubic)])
        }
        Term::Cogging { amplitude, period, phase } => (
            "cogging",
            "amplitude * sin(2 * pi * q / period + phase)",
            vec![("amplitude", amplitude), ("period", period), ("phase", phase)],
        ),
        Term::Constant { force } => ("constant", "force", vec![("force", force)]),
    }
}

pub(super) fn yaml(model: &Model, joints: &[Joint]) -> String {
    let mut out = String::from(
        "# Feed-forward of friction and the like. The effort that a motor adds along +q is the sum of a joint's terms.\n\
         # q: position, dq: velocity, s = tanh(dq / width), load: force of what the joint drives, positive where it resists motion along +q.\n",
    );
    out += &format!("model: {}\n", text(&model.name));
    if !model.source.is_empty() {
        out += &format!("source: {}\n", text(&model.source));
    }
    out += "joints:\n";
    for joint in joints {
        out += &format!(
            "  {}:\n    effort_unit: {}\n    position_unit: {}\n    width: {:?}\n    terms:\n",
            text(&joint.name),
            text(joint.unit),
            text(joint.position_unit),
            joint.width
        );
        for (element, kind, term) in &joint.terms {
            let (name, equation, numbers) = parts(term);
            out += &format!(
                "      - term: {name}\n        element: {}\n        kind: {kind}\n        equation: {}\n",
                text(element),
                text(equation)
            );
            numbers.iter().for_each(|(key, value)| out += &format!("        {key}: {value:?}\n"));
        }
    }
    out
}
