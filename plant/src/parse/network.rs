//! A network: bodies, elements, inputs and outputs.

use super::signals;
use crate::elements::{KINDS, Kind, Law, Range, Role};
use crate::model::{Body, Element, Fragment, InputKind, Model, Motion, Place};
use crate::tomlfile::{self, FileError, Table};
use std::path::Path;

/// Name of the place in a fragment that stands for the body it is attached to.
pub const PORT: &str = "port";
/// Name of the body in a fragment whose motion is the operator's intent.
pub const HAND: &str = "hand";
const GROUND: &str = "ground";

/// Reads the head of a file: a model without a network, the motion that it names, and whether it is a fragment.
pub(super) fn read_head(top: &mut Table) -> Result<(Model, Option<Motion>, bool), FileError> {
    let stem = Path::new(top.file_name()).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let model = Model {
        name: top.string("name")?.unwrap_or(stem),
        title: top.string("title")?.unwrap_or_default(),
        source: top.string("source")?.unwrap_or_default(),
        ..Model::default()
    };
    let motion = top.one_of("motion", &[("translation", Motion::Translation), ("rotation", Motion::Rotation)])?;
    Ok((model, motion, top.one_of("kind", &[("device", false), ("fragment", true)])?.unwrap_or(false)))
}

/// Reads a fragment's file behind its head.
pub(super) fn read_fragment_file(
    mut top: Table,
    mut model: Model,
    motion: Option<Motion>,
    folder: Option<&Path>,
) -> Result<Fragment, FileError> {
    model.motion = motion.unwrap_or_default();
    let fragment = read_into_fragment(&mut top, model, folder)?;
    top.finish()?;
    Ok(fragment)
}

/// Reads a file that has to be a fragment; of a device nothing more is looked at than that it is one.
pub(super) fn only_fragment(mut top: Table, folder: Option<&Path>) -> Result<Fragment, FileError> {
    let (model, motion, is_fragment) = read_head(&mut top)?;
    if !is_fragment {
        let message = "is the model of a device, expected a fragment (a grip or an environment): its file has kind = \"fragment\"";
        return Err(FileError::whole(top.file_name(), message));
    }
    read_fragment_file(top, model, motion, folder)
}

/// Reads a fragment's network from a table that holds nothing else of it.
pub(super) fn read_fragment(table: &mut Table, folder: Option<&Path>) -> Result<Fragment, FileError> {
    read_into_fragment(table, Model::default(), folder)
}

/// Reads a fragment's network into a model that has no bodies yet.
fn read_into_fragment(table: &mut Table, mut model: Model, folder: Option<&Path>) -> Result<Fragment, FileError> {
    let bodies = read_bodies(table, true, &mut model)?;
    let hand = read_what_acts(table, bodies.as_ref(), true, &mut model, folder)?;
    Ok(Fragment { network: model, hand })
}

/// Reads bodies; their table is handed back for errors that come up later.
pub(super) fn read_bodies(top: &mut Table, is_fragment: bool, model: &mut Model) -> Result<Option<Table>, FileError> {
    if is_fragment {
        model.bodies.push(Body { name: PORT.to_string(), inertia: 0.0 });
    }
    let Some(mut table) = top.table("bodies")? else { return Ok(None) };
    read_names(&mut table, is_fragment, model)?;
    Ok(Some(table))
}

/// Reads elements, inputs and outputs; of a fragment also which body is its hand.
pub(super) fn read_what_acts(
    top: &mut Table,
    bodies: Option<&Table>,
    is_fragment: bool,
    model: &mut Model,
    folder: Option<&Path>,
) -> Result<Option<usize>, FileError> {
    let elements = top.tables("elements")?;
    for (index, mut table) in elements.into_iter().enumerate() {
        let element = read_element(&mut table, index, is_fragment, model, folder)?;
        table.finish()?;
        model.elements.push(element);
    }
    for mut table in top.tables("inputs")? {
        let input = signals::read_input(&mut table, model)?;
        table.finish()?;
        model.inputs.push(input);
    }
    for mut table in top.tables("outputs")? {
        let output = signals::read_output(&mut table, model)?;
        table.finish()?;
        model.outputs.push(output);
    }
    let hand = if is_fragment { model.bodies.iter().position(|b| b.name == HAND) } else { None };
    refuse_free_bodies_without_inertia(model, is_fragment, hand, bodies, top)?;
    Ok(hand)
}

fn read_names(table: &mut Table, is_fragment: bool, model: &mut Model) -> Result<(), FileError> {
    for name in table.keys() {
        if name == GROUND {
            return Err(table.error_at(&name, "ground always exists and has no inertia; omit it"));
        }
        if is_fragment && name == PORT {
            return Err(table.error_at(&name, "represents the body of the device to which the fragment is attached; omit it"));
        }
        let inertia = table.need_number(&name, Range::NonNegative)?;
        // A joint of a robot is there already: this is its armature.
        match model.bodies.iter().position(|body| body.name == name) {
            Some(point) if model.is_point(point) => {
                return Err(table.error_at(&name, "is a point of the robot, which has the inertia of its link; omit it"));
            }
            Some(joint) => model.bodies[joint].inertia = inertia,
            None => model.bodies.push(Body { name, inertia }),
        }
    }
    Ok(())
}

fn refuse_free_bodies_without_inertia(
    model: &Model,
    is_fragment: bool,
    hand: Option<usize>,
    bodies: Option<&Table>,
    top: &Table,
) -> Result<(), FileError> {
    for (index, body) in model.bodies.iter().enumerate() {
        let has_links = model.arm.as_ref().is_some_and(|arm| arm.moves(index));
        let stands_for_another = is_fragment && index == 0 || hand == Some(index) || has_links;
        let moved = model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == index);
        let inerter = model
            .elements
            .iter()
            .any(|e| matches!(e.law.role(), Role::Linear(linear) if linear.inertance > 0.0) && e.between.contains(&Some(index)));
        if body.inertia == 0.0 && !stands_for_another && !moved && !inerter {
            let message = "a free body without inertia; give it some, or an inerter, or prescribe it with a motion input";
            return Err(bodies.map_or_else(|| top.error(message), |t| t.error_at(&body.name, message)));
        }
    }
    Ok(())
}

/// Index of a named body; ground is `None`. In a fragment the hand comes to be by being named.
fn place(table: &Table, key: &str, name: &str, is_fragment: bool, model: &mut Model) -> Result<Place, FileError> {
    if name == GROUND {
        return Ok(None);
    }
    if let Some(index) = model.bodies.iter().position(|b| b.name == name) {
        return Ok(Some(index));
    }
    if is_fragment && name == HAND {
        model.bodies.push(Body { name: HAND.to_string(), inertia: 0.0 });
        return Ok(Some(model.bodies.len() - 1));
    }
    if name == PORT {
        return Err(table.error_at(key, "only a fragment has a port: its file has kind = \"fragment\""));
    }
    let bodies = model.bodies.iter().map(|b| b.name.as_str()).chain(std::iter::once(GROUND));
    Err(table.error_at(key, tomlfile::unknown("body", name, bodies)))
}

fn read_element(
    table: &mut Table,
    index: usize,
    is_fragment: bool,
    model: &mut Model,
    folder: Option<&Path>,
) -> Result<Element, FileError> {
    let name = match table.contains("name") {
        true => table.need_string("name")?,
        false => format!("element{index}"),
    };
    table.label(&name);
    if model.elements.iter().any(|e| e.name == name) {
        return Err(table.error_at("name", "another element has this name"));
    }
    let word = table.string("kind")?.ok_or_else(|| table.missing("kind"))?;
    let kind = KINDS.iter().find(|k| k.name == word).copied();
    let kind = kind.ok_or_else(|| table.error_at("kind", tomlfile::unknown("element kind", &word, KINDS.iter().map(|k| k.name))))?;
    let names = table.strings("between")?.ok_or_else(|| table.missing("between"))?;
    let [first, second] = names.as_slice() else {
        return Err(table.error_at("between", format!("expected two bodies, found {}", names.len())));
    };
    if first == second {
        return Err(table.error_at("between", format!("both ends are \"{first}\"")));
    }
    let between = [place(table, "between", first, is_fragment, model)?, place(table, "between", second, is_fragment, model)?];
    let law = read_law(table, kind, folder)?;
    Ok(Element { name, between, law })
}

fn read_law(table: &mut Table, kind: &Kind, folder: Option<&Path>) -> Result<Law, FileError> {
    let mut values = Vec::with_capacity(kind.parameters.len());
    for p in kind.parameters {
        let found = match (p.list, table.is_string(p.key)) {
            (true, true) => Some(read_list_file(table, p.key, p.range, folder)?),
            (true, false) => table.numbers(p.key, p.range)?,
            (false, _) => table.number(p.key, p.range)?.map(|value| vec![value]),
        };
        let value = match (found, p.default_values()) {
            (Some(value), _) => value,
            (None, Some(default)) => default,
            (None, None) => {
                let mut error = table.missing(p.key);
                // A misspelt key needs no explanation, a forgotten one does.
                if error.message.starts_with("missing") {
                    error.message = format!("{} of kind \"{}\": {}, {}", error.message, kind.name, p.doc, p.unit);
                }
                return Err(error);
            }
        };
        values.push(value);
    }
    (kind.build)(&values).map_err(|message| table.error(message))
}

/// A list parameter may name a CSV file beside the model; its values are read row by row.
fn read_list_file(table: &mut Table, key: &str, range: Range, folder: Option<&Path>) -> Result<Vec<f64>, FileError> {
    let name = table.need_string(key)?;
    let Some(folder) = folder else {
        return Err(table.error_at(key, format!("names the file \"{name}\", and this model is not in a folder")));
    };
    let path = folder.join(&name);
    let shown = path.display().to_string();
    let text = tomlfile::read_text(&path).map_err(|e| table.error_at(key, format!("\"{name}\": {}", e.message)))?;
    let mut numbers = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let row = line.trim();
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        // The first row may be a heading.
        if numbers.is_empty() && cells.iter().all(|c| c.parse::<f64>().is_err()) {
            continue;
        }
        for (column, cell) in cells.iter().enumerate() {
            let at = |message: String| FileError::at(&shown, index + 1, format!("column {}", column + 1), message);
            let value: f64 = cell.parse().map_err(|_| at(format!("expected a number, found \"{cell}\"")))?;
            tomlfile::check_range(value, range).map_err(at)?;
            numbers.push(value);
        }
    }
    Ok(numbers)
}
