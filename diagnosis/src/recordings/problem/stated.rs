//! The parameters that the nominal file states, each of which may be off.

use crate::tuning::tuning;
use backdrive_plant::model::{InputKind, Model, OutputKind};
use backdrive_plant::parse::{InputKey, NumberOf, OutputKey};

/// A parameter that the nominal file states, and that may be off.
#[derive(Debug, Clone, PartialEq)]
pub struct Stated {
    /// Its path, as [`Model::values_at`] takes it.
    pub path: String,
    /// Its place where the path leads to a list.
    pub index: usize,
    /// The value in the file.
    pub given: f64,
    /// Lowest and highest value that a fit may try.
    pub range: (f64, f64),
    /// Whether it is searched in logarithms.
    pub log: bool,
}

impl Stated {
    /// The body whose inertia it is, by its index in the model; `None` where it is another parameter.
    pub fn body(&self, model: &Model) -> Option<usize> {
        match model.number_at(&self.path) {
            Ok(NumberOf::Body(body)) => Some(body),
            Ok(NumberOf::Element(..) | NumberOf::Input(..) | NumberOf::Output(..)) | Err(_) => None,
        }
    }
}

/// Parameters that the file states. Those that are 0 have no scale: what they would add is an effect, not a parameter.
pub(super) fn stated_numbers(model: &Model, text: &str) -> Vec<Stated> {
    let keys = stated_keys(text);
    let writes_elements = keys.iter().any(|k| k.starts_with("elements."));
    let elements_and_bodies = model.parameter_paths().into_iter().filter(|path| match model.number_at(path) {
        // A default that the file does not write is not stated.
        Ok(NumberOf::Element(..)) => keys.contains(path) || !writes_elements,
        Ok(NumberOf::Body(_) | NumberOf::Input(..) | NumberOf::Output(..)) | Err(_) => true,
    });
    let signals = keys.iter().filter(|k| model.number_at(k).is_ok_and(is_of_signal));
    let mut found = Vec::new();
    for path in elements_and_bodies.chain(signals.cloned()) {
        let Ok(values) = model.values_at(&path) else { continue };
        for (index, given) in values.into_iter().enumerate() {
            if given == 0.0 || !given.is_finite() || is_idle(model, &path) {
                continue;
            }
            let key = path.rsplit('.').next().unwrap_or("");
            // A shape, not a size: moved a little only.
            let factor = if ["exponent", "ratio"].contains(&key) { 2.0 } else { tuning().recordings.stated_range };
            let (range, log) = match () {
                () if key == "phase" => ((given - std::f64::consts::PI, given + std::f64::consts::PI), false),
                () if given > 0.0 => ((given / factor, given * factor), true),
                () => ((given - 10.0 * given.abs(), given + 10.0 * given.abs()), false),
            };
            found.push(Stated { path: path.clone(), index, given, range, log });
        }
    }
    found
}

/// Whether it is a parameter of an input or an output that may be off. The offset of an input is set where its recording is made; resolution and noise of
/// an output do not move its prediction.
fn is_of_signal(number: NumberOf) -> bool {
    match number {
        NumberOf::Input(_, key) => match key {
            InputKey::Gain | InputKey::Delay | InputKey::Bandwidth | InputKey::Saturation | InputKey::BackEmf => true,
            InputKey::Offset => false,
        },
        NumberOf::Output(_, key) => match key {
            OutputKey::Gain | OutputKey::Delay | OutputKey::Offset => true,
            OutputKey::Resolution | OutputKey::Noise => false,
        },
        NumberOf::Body(_) | NumberOf::Element(..) => false,
    }
}

/// Whether a parameter cannot have any effect: the inertia of a prescribed body whose reaction nobody reads.
fn is_idle(model: &Model, path: &str) -> bool {
    let Ok(NumberOf::Body(body)) = model.number_at(path) else { return false };
    let moved = model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == body);
    moved && !model.outputs.iter().any(|o| o.kind == OutputKind::Reaction(body))
}

/// Paths of the keys that the file writes in its elements, inputs and outputs.
fn stated_keys(text: &str) -> Vec<String> {
    let Ok(document) = text.parse::<toml_edit::DocumentMut>() else { return Vec::new() };
    let mut keys = Vec::new();
    for section in ["elements", "inputs", "outputs"] {
        let Some(item) = document.get(section) else { continue };
        let Ok(tables) = item.clone().into_array_of_tables() else { continue };
        for (index, table) in tables.iter().enumerate() {
            let name = table.get("name").and_then(|n| n.as_str()).map_or_else(|| format!("element{index}"), str::to_string);
            keys.extend(table.iter().map(|(key, _)| format!("{section}.{name}.{key}")));
        }
    }
    keys
}
