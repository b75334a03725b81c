//! Model files written: a whole [`Model`] as TOML, or edits to a file that keep its comments and order.

mod patch;
mod text;

pub use patch::{Edit, ElementSpec, PatchError, Value, patch, round_significant};
pub use text::{key, number, string};

use crate::model::{Fragment, Hold, InputKind, Model, Motion, OutputKind, Place};
use crate::robot::{Arm, Point};
use crate::servo::FACTS;
use std::fmt::Write;
use text::{list, parameter_text, strings};

impl Model {
    /// The model as TOML that reads back as an equal model.
    pub fn to_toml(&self) -> String {
        write_model(self, false)
    }

    /// Name of a place: `ground`, or that of the body.
    pub fn place_name(&self, place: Place) -> &str {
        place.and_then(|index| self.bodies.get(index)).map_or("ground", |body| body.name.as_str())
    }
}

impl Fragment {
    /// The fragment as TOML that reads back as an equal fragment.
    pub fn to_toml(&self) -> String {
        write_model(&self.network, true)
    }
}

fn write_model(model: &Model, is_fragment: bool) -> String {
    let mut out = String::new();
    let mut line = |text: String| {
        out.push_str(&text);
        out.push('\n');
    };
    line(format!("name = {}", string(&model.name)));
    if is_fragment {
        line("kind = \"fragment\"".to_string());
    }
    for (name, text) in [("title", &model.title), ("source", &model.source)] {
        if !text.is_empty() {
            line(format!("{name} = {}", string(text)));
        }
    }
    let motion = match model.motion {
        Motion::Translation => "translation",
        Motion::Rotation => "rotation",
    };
    line(format!("motion = {}", string(motion)));
    if let Some(arm) = &model.arm {
        line(format!("\n[robot]\n{}", robot_keys(arm)));
        for point in &arm.points {
            line(format!("\n[point.{}]\n{}", key(model.place_name(Some(point.body))), point_keys(arm, point)));
        }
    }
    line("\n[bodies]".to_string());
    let points = |index: &usize| model.is_point(*index);
    for (_, body) in model.bodies.iter().enumerate().skip(usize::from(is_fragment)).filter(|(index, _)| !points(index)) {
        line(format!("{} = {}", key(&body.name), number(body.inertia)));
    }
    for element in &model.elements {
        line("\n[[elements]]".to_string());
        line(element_keys(
            &element.name,
            element.law.kind().name,
            &strings(element.between.iter().map(|p| model.place_name(*p))),
            &element.law,
        ));
    }
    for input in &model.inputs {
        line("\n[[inputs]]".to_string());
        line(input_keys(model, input));
    }
    for output in &model.outputs {
        line("\n[[outputs]]".to_string());
        line(output_keys(model, output));
    }
    for axis in &model.axes {
        line("\n[[axes]]".to_string());
        line(axis_keys(model, axis));
    }
    for servo in &model.servos {
        line(format!("\n[servo.{}]", key(&servo.joint)));
        // What does nothing is left out.
        for facts in FACTS.iter().filter(|facts| servo.numbers[facts.number] != facts.nothing) {
            line(format!("{} = {}", facts.key, number(servo.numbers[facts.number])));
        }
    }
    out
}

/// The robot with the content of its file; joint friction, springs and motors are among the elements and inputs already.
fn robot_keys(arm: &Arm) -> String {
    let pose = arm.tree.coordinates().iter().zip(&arm.pose).map(|(c, value)| format!("{} = {}", key(&c.name), number(*value)));
    let mut keys = vec![
        format!("xml = {}", string(&arm.xml)),
        format!("gravity = {}", list(arm.robot.gravity.as_slice())),
        format!("pose = {{ {} }}", pose.collect::<Vec<_>>().join(", ")),
        "passive = false".to_string(),
    ];
    if arm.gravity_compensated {
        keys.push("gravity_compensated = true".to_string());
    }
    keys.join("\n")
}

fn point_keys(arm: &Arm, point: &Point) -> String {
    let link = arm.robot.links.get(point.link).map_or("", |link| link.name.as_str());
    format!("link = {}\nat = {}\naxis = {}", string(link), list(point.at.as_slice()), list(point.axis.as_slice()))
}

fn element_keys(name: &str, kind: &str, between: &str, law: &crate::elements::Law) -> String {
    let mut text = format!("name = {}\nkind = {}\nbetween = {between}", string(name), string(kind));
    for (parameter, value) in law.kind().parameters.iter().zip(law.values()) {
        if let Some(shown) = parameter_text(parameter, &value) {
            // Writing to a String cannot fail.
            let _ = write!(text, "\n{} = {shown}", parameter.key);
        }
    }
    text
}

fn input_keys(model: &Model, input: &crate::model::Input) -> String {
    let kind = match input.kind {
        InputKind::Force => "force",
        InputKind::Motion => "motion",
    };
    let hold = match input.hold {
        Hold::Zero => "zero",
        Hold::Linear => "linear",
        Hold::Cubic => "cubic",
    };
    let mut keys = vec![
        format!("name = {}", string(&input.name)),
        format!("kind = {}", string(kind)),
        format!("on = {}", string(model.place_name(Some(input.on)))),
        format!("hold = {}", string(hold)),
    ];
    let numbers = [
        ("gain", input.gain, 1.0),
        ("saturation", input.saturation, f64::INFINITY),
        ("delay", input.delay, 0.0),
        ("bandwidth", input.bandwidth, f64::INFINITY),
        ("back_emf", input.back_emf, 0.0),
        ("offset", input.offset, 0.0),
    ];
    push_unless_default(&mut keys, &numbers);
    keys.join("\n")
}

fn output_keys(model: &Model, output: &crate::model::Output) -> String {
    let (kind, of) = match &output.kind {
        OutputKind::Position(body) => ("position", Ok(*body)),
        OutputKind::Velocity(body) => ("velocity", Ok(*body)),
        OutputKind::Acceleration(body) => ("acceleration", Ok(*body)),
        OutputKind::Reaction(body) => ("reaction", Ok(*body)),
        OutputKind::Force(elements) => ("force", Err(elements)),
    };
    let mut keys = vec![format!("name = {}", string(&output.name)), format!("kind = {}", string(kind))];
    keys.push(match of {
        Ok(body) => format!("of = {}", string(model.place_name(Some(body)))),
        Err(elements) => {
            let names = elements.iter().filter_map(|e| model.elements.get(*e)).map(|e| e.name.as_str());
            match elements.as_slice() {
                [_] => format!("element = {}", names.map(string).collect::<String>()),
                _ => format!("element = {}", strings(names)),
            }
        }
    });
    let numbers = [
        ("gain", output.gain, 1.0),
        ("delay", output.delay, 0.0),
        ("offset", output.offset, 0.0),
        ("resolution", output.resolution, 0.0),
        ("noise", output.noise, 0.0),
    ];
    push_unless_default(&mut keys, &numbers);
    keys.join("\n")
}

fn axis_keys(model: &Model, axis: &crate::model::Axis) -> String {
    let input = model.inputs.get(axis.feedback).map_or("", |i| i.name.as_str());
    let output = model.outputs.get(axis.measured).map_or("", |o| o.name.as_str());
    let mut keys = vec![format!("name = {}", string(&axis.name)), format!("user = {}", string(model.place_name(Some(axis.user))))];
    if axis.holds_user {
        keys.push("holds_user = true".to_string());
    }
    if !axis.touches.is_empty() {
        let names = axis.touches.iter().filter_map(|e| model.elements.get(*e)).map(|e| e.name.as_str());
        keys.push(format!("touches = {}", strings(names)));
    }
    keys.push(format!("feedback = {}", string(input)));
    keys.push(format!("measured = {}", string(output)));
    push_unless_default(&mut keys, &[("scale", axis.scale, 1.0)]);
    if let Some(travel) = &axis.travel {
        keys.push(format!("travel = {}", list(travel)));
    }
    for (name, value) in [("force", axis.force), ("force_rate", axis.force_rate), ("speed", axis.speed)] {
        if let Some(value) = value {
            keys.push(format!("{name} = {}", number(value)));
        }
    }
    keys.join("\n")
}

fn push_unless_default(keys: &mut Vec<String>, numbers: &[(&str, f64, f64)]) {
    for (name, value, default) in numbers {
        if value != default {
            keys.push(format!("{name} = {}", number(*value)));
        }
    }
}
