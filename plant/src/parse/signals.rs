//! Inputs, outputs and axes of a model file.

use crate::elements::Range;
use crate::model::{Axis, Hold, Input, InputKind, Model, Output, OutputKind};
use crate::tomlfile::{self, FileError, Table};

const TIME: &str = "t";

/// Takes the name of an input or output: unique among both, because a recording has one column for each.
fn signal_name(table: &mut Table, model: &Model) -> Result<String, FileError> {
    let name = table.need_string("name")?;
    table.label(&name);
    if name == TIME {
        return Err(table.error_at("name", "\"t\" is the time of a recording; choose another name"));
    }
    if model.inputs.iter().any(|i| i.name == name) {
        return Err(table.error_at("name", "an input has this name already"));
    }
    if model.outputs.iter().any(|o| o.name == name) {
        return Err(table.error_at("name", "an output has this name already"));
    }
    Ok(name)
}

fn body(table: &mut Table, key: &str, model: &Model) -> Result<usize, FileError> {
    let name = table.need_string(key)?;
    match model.bodies.iter().position(|b| b.name == name) {
        Some(index) => Ok(index),
        None if name == "ground" => Err(table.error_at(key, "ground does not move; name a body")),
        None => Err(table.error_at(key, tomlfile::unknown("body", &name, model.bodies.iter().map(|b| b.name.as_str())))),
    }
}

/// A force acts when it is commanded or later. The recording of a motion may also come late, or the force recorded beside it be a command that
/// acts later: then the motion was ahead of its samples, and its delay is negative.
pub(super) fn delay_range(kind: InputKind) -> Range {
    match kind {
        InputKind::Force => Range::NonNegative,
        InputKind::Motion => Range::Any,
    }
}

pub(super) fn read_input(table: &mut Table, model: &Model) -> Result<Input, FileError> {
    let name = signal_name(table, model)?;
    let kind = table.need_one_of("kind", &[("force", InputKind::Force), ("motion", InputKind::Motion)])?;
    let on = body(table, "on", model)?;
    let default_hold = match kind {
        InputKind::Force => Hold::Zero,
        InputKind::Motion => Hold::Cubic,
    };
    let holds = [("zero", Hold::Zero), ("linear", Hold::Linear), ("cubic", Hold::Cubic)];
    let input = Input {
        name,
        kind,
        on,
        hold: table.one_of("hold", &holds)?.unwrap_or(default_hold),
        gain: table.number_or("gain", Range::Any, 1.0)?,
        saturation: table.number("saturation", Range::Positive)?.unwrap_or(f64::INFINITY),
        delay: table.number_or("delay", delay_range(kind), 0.0)?,
        bandwidth: table.number("bandwidth", Range::Positive)?.unwrap_or(f64::INFINITY),
        back_emf: table.number_or("back_emf", Range::Any, 0.0)?,
        offset: table.number_or("offset", Range::Any, 0.0)?,
    };
    if model.is_point(on) {
        refuse_at_a_point(table, &input)?;
    }
    if kind == InputKind::Force && input.offset != 0.0 {
        let message = "states the zero of a recorded motion; a constant force is an element of kind \"bias\"";
        return Err(table.error_at("offset", message));
    }
    if kind == InputKind::Motion {
        if input.back_emf != 0.0 {
            return Err(table.error_at("back_emf", "is a force lost; a motion input has none"));
        }
        if let Some(other) = model.inputs.iter().find(|i| i.kind == InputKind::Motion && i.on == on) {
            return Err(table.error_at("on", format!("input \"{}\" prescribes this body already", other.name)));
        }
    }
    Ok(input)
}

/// A point of a robot can be pushed, not moved: it goes where the joints let it go.
fn refuse_at_a_point(table: &Table, input: &Input) -> Result<(), FileError> {
    if input.kind == InputKind::Motion {
        let message = "is a point of the robot, whose position follows from the joints: prescribe a joint, or a separate body that a \
                spring attaches to the point";
        return Err(table.error_at("on", message));
    }
    if input.back_emf != 0.0 {
        return Err(table.error_at("back_emf", "acts on the speed of a motor; a point of the robot has no motor, its joints have"));
    }
    Ok(())
}

#[derive(Clone, Copy)]
enum Kind {
    Position,
    Velocity,
    Acceleration,
    Force,
    Reaction,
}

pub(super) fn read_output(table: &mut Table, model: &Model) -> Result<Output, FileError> {
    let name = signal_name(table, model)?;
    let kinds = [
        ("position", Kind::Position),
        ("velocity", Kind::Velocity),
        ("acceleration", Kind::Acceleration),
        ("force", Kind::Force),
        ("reaction", Kind::Reaction),
    ];
    let kind = match table.need_one_of("kind", &kinds)? {
        Kind::Position => OutputKind::Position(body(table, "of", model)?),
        Kind::Velocity => OutputKind::Velocity(body(table, "of", model)?),
        Kind::Acceleration => OutputKind::Acceleration(body(table, "of", model)?),
        Kind::Force => OutputKind::Force(elements(table, "element", model)?.ok_or_else(|| table.missing("element"))?),
        Kind::Reaction => {
            let of = body(table, "of", model)?;
            if !model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == of) {
                let message = "no motion input prescribes this body, so nothing exerts a reaction on it";
                return Err(table.error_at("of", message));
            }
            OutputKind::Reaction(of)
        }
    };
    Ok(Output {
        name,
        kind,
        gain: table.number_or("gain", Range::Any, 1.0)?,
        delay: table.number_or("delay", Range::NonNegative, 0.0)?,
        offset: table.number_or("offset", Range::Any, 0.0)?,
        resolution: table.number_or("resolution", Range::NonNegative, 0.0)?,
        noise: table.number_or("noise", Range::NonNegative, 0.0)?,
    })
}

fn elements(table: &mut Table, key: &str, model: &Model) -> Result<Option<Vec<usize>>, FileError> {
    let Some(names) = table.string_or_strings(key)? else { return Ok(None) };
    if names.is_empty() {
        return Err(table.error_at(key, "names no element"));
    }
    let mut found = Vec::with_capacity(names.len());
    for name in &names {
        match model.elements.iter().position(|e| e.name == *name) {
            Some(index) if found.contains(&index) => return Err(table.error_at(key, format!("names \"{name}\" twice"))),
            Some(index) => found.push(index),
            None => {
                let all = model.elements.iter().map(|e| e.name.as_str());
                return Err(table.error_at(key, tomlfile::unknown("element", name, all)));
            }
        }
    }
    Ok(Some(found))
}

pub(super) fn read_axis(table: &mut Table, model: &Model) -> Result<Axis, FileError> {
    let name = table.need_string("name")?;
    table.label(&name);
    if model.axes.iter().any(|a| a.name == name) {
        return Err(table.error_at("name", "another axis has this name"));
    }
    let user = body(table, "user", model)?;
    let feedback = table.need_string("feedback")?;
    let feedback =
        model.inputs.iter().position(|i| i.name == feedback).ok_or_else(|| {
            table.error_at("feedback", tomlfile::unknown("input", &feedback, model.inputs.iter().map(|i| i.name.as_str())))
        })?;
    let measured = table.need_string("measured")?;
    let measured =
        model.outputs.iter().position(|o| o.name == measured).ok_or_else(|| {
            table.error_at("measured", tomlfile::unknown("output", &measured, model.outputs.iter().map(|o| o.name.as_str())))
        })?;
    if !matches!(model.outputs[measured].kind, OutputKind::Position(_)) {
        return Err(table.error_at("measured", format!("output \"{}\" is not a position", model.outputs[measured].name)));
    }
    let scale = table.number_or("scale", Range::Any, 1.0)?;
    if scale == 0.0 {
        return Err(table.error_at("scale", "must not be 0"));
    }
    let travel = match table.numbers("travel", Range::Any)?.as_deref() {
        None => None,
        Some(&[low, high]) if low < high => Some([low, high]),
        Some(_) => return Err(table.error_at("travel", "expected two numbers, the lower limit first")),
    };
    Ok(Axis {
        name,
        user,
        holds_user: table.boolean("holds_user")?.unwrap_or(false),
        touches: elements(table, "touches", model)?.unwrap_or_default(),
        feedback,
        measured,
        scale,
        travel,
        force: table.number("force", Range::Positive)?,
        force_rate: table.number("force_rate", Range::Positive)?,
        speed: table.number("speed", Range::Positive)?,
    })
}
