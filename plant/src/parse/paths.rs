//! Parameters of a model by their path: `bodies.drum`, `elements.cable.stiffness`, `inputs.feedback_force.delay`.

use super::signals::delay_range;
use crate::describe::unit_for;
use crate::elements::Range;
use crate::model::{Input, Model, Output};
use crate::tomlfile::{check_range, unknown};

/// A number of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputKey {
    /// `gain`.
    Gain,
    /// `saturation`.
    Saturation,
    /// `delay`.
    Delay,
    /// `bandwidth`.
    Bandwidth,
    /// `back_emf`.
    BackEmf,
    /// `offset`.
    Offset,
}

impl InputKey {
    const ALL: [InputKey; 6] =
        [InputKey::Gain, InputKey::Saturation, InputKey::Delay, InputKey::Bandwidth, InputKey::BackEmf, InputKey::Offset];

    /// Its key in the model file, its unit for a translation, its range, and what it is where the file leaves it out.
    fn row(self) -> (&'static str, &'static str, Range, f64) {
        match self {
            InputKey::Gain => ("gain", "-", Range::Any, 1.0),
            InputKey::Saturation => ("saturation", "N", Range::Positive, f64::INFINITY),
            InputKey::Delay => ("delay", "s", Range::NonNegative, 0.0),
            InputKey::Bandwidth => ("bandwidth", "Hz", Range::Positive, f64::INFINITY),
            InputKey::BackEmf => ("back_emf", "N s/m", Range::Any, 0.0),
            InputKey::Offset => ("offset", "m", Range::Any, 0.0),
        }
    }

    fn value(self, input: &Input) -> f64 {
        match self {
            InputKey::Gain => input.gain,
            InputKey::Saturation => input.saturation,
            InputKey::Delay => input.delay,
            InputKey::Bandwidth => input.bandwidth,
            InputKey::BackEmf => input.back_emf,
            InputKey::Offset => input.offset,
        }
    }

    fn value_mut(self, input: &mut Input) -> &mut f64 {
        match self {
            InputKey::Gain => &mut input.gain,
            InputKey::Saturation => &mut input.saturation,
            InputKey::Delay => &mut input.delay,
            InputKey::Bandwidth => &mut input.bandwidth,
            InputKey::BackEmf => &mut input.back_emf,
            InputKey::Offset => &mut input.offset,
        }
    }
}

/// A number of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputKey {
    /// `gain`.
    Gain,
    /// `delay`.
    Delay,
    /// `offset`.
    Offset,
    /// `resolution`.
    Resolution,
    /// `noise`.
    Noise,
}

impl OutputKey {
    const ALL: [OutputKey; 5] = [OutputKey::Gain, OutputKey::Delay, OutputKey::Offset, OutputKey::Resolution, OutputKey::Noise];

    /// Its key in the model file, its unit (`None` for that of the output), its range, and what it is where the file leaves it out.
    fn row(self) -> (&'static str, Option<&'static str>, Range, f64) {
        match self {
            OutputKey::Gain => ("gain", Some("-"), Range::Any, 1.0),
            OutputKey::Delay => ("delay", Some("s"), Range::NonNegative, 0.0),
            OutputKey::Offset => ("offset", None, Range::Any, 0.0),
            OutputKey::Resolution => ("resolution", None, Range::NonNegative, 0.0),
            OutputKey::Noise => ("noise", None, Range::NonNegative, 0.0),
        }
    }

    fn value(self, output: &Output) -> f64 {
        match self {
            OutputKey::Gain => output.gain,
            OutputKey::Delay => output.delay,
            OutputKey::Offset => output.offset,
            OutputKey::Resolution => output.resolution,
            OutputKey::Noise => output.noise,
        }
    }

    fn value_mut(self, output: &mut Output) -> &mut f64 {
        match self {
            OutputKey::Gain => &mut output.gain,
            OutputKey::Delay => &mut output.delay,
            OutputKey::Offset => &mut output.offset,
            OutputKey::Resolution => &mut output.resolution,
            OutputKey::Noise => &mut output.noise,
        }
    }
}

/// The number that a path leads to, and whose it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberOf {
    /// The inertia of a body, by its index.
    Body(usize),
    /// A parameter of an element: index of the element, and of the parameter in its kind.
    Element(usize, usize),
    /// A number of an input, by its index.
    Input(usize, InputKey),
    /// A number of an output, by its index.
    Output(usize, OutputKey),
}

impl Model {
    /// Values at a path (a number is a list of one); the error names in one sentence what there is instead.
    pub fn values_at(&self, path: &str) -> Result<Vec<f64>, String> {
        Ok(match self.number_at(path)? {
            NumberOf::Body(body) => vec![self.bodies[body].inertia],
            NumberOf::Element(element, parameter) => self.elements[element].law.values().swap_remove(parameter),
            NumberOf::Input(input, key) => vec![key.value(&self.inputs[input])],
            NumberOf::Output(output, key) => vec![key.value(&self.outputs[output])],
        })
    }

    /// Unit of the number at a path for this model's motion, such as `N/m` or `N m/rad`; `-` where it has none. The error names in one sentence what
    /// there is instead of the path.
    pub fn unit_at(&self, path: &str) -> Result<String, String> {
        let unit = match self.number_at(path)? {
            NumberOf::Body(_) => "kg",
            NumberOf::Element(element, parameter) => self.elements[element].law.kind().parameters[parameter].unit,
            NumberOf::Input(_, key) => key.row().1,
            NumberOf::Output(output, key) => key.row().1.unwrap_or_else(|| self.outputs[output].kind.unit()),
        };
        Ok(unit_for(self.motion, unit))
    }

    /// Sets the values at a path; the error explains in one sentence what is wrong with path or values, and the model stays unchanged.
    pub fn set_values_at(&mut self, path: &str, values: &[f64]) -> Result<(), String> {
        let number = self.number_at(path)?;
        let one = |range: Range, unlimited: f64| match values {
            // The meaning of an omitted key in a file.
            [x] if *x == unlimited => Ok(*x),
            [x] => check_range(*x, range).map(|()| *x).map_err(|e| format!("{path} {e}")),
            _ => Err(format!("{path} takes one number, not {}", values.len())),
        };
        match number {
            NumberOf::Body(body) => self.bodies[body].inertia = one(Range::NonNegative, 0.0)?,
            NumberOf::Element(element, parameter) => {
                let kind = self.elements[element].law.kind();
                let p = &kind.parameters[parameter];
                let mut all = self.elements[element].law.values();
                if p.list {
                    for x in values {
                        check_range(*x, p.range).map_err(|e| format!("{path} {e}"))?;
                    }
                    all[parameter] = values.to_vec();
                } else {
                    all[parameter] = vec![one(p.range, p.default.unwrap_or(f64::NAN))?];
                }
                self.elements[element].law = (kind.build)(&all).map_err(|e| format!("{path}: {e}"))?;
            }
            NumberOf::Input(input, key) => {
                let (_, _, range, absent) = key.row();
                let range = if key == InputKey::Delay { delay_range(self.inputs[input].kind) } else { range };
                *key.value_mut(&mut self.inputs[input]) = one(range, absent)?;
            }
            NumberOf::Output(output, key) => {
                let (_, _, range, absent) = key.row();
                *key.value_mut(&mut self.outputs[output]) = one(range, absent)?;
            }
        }
        Ok(())
    }

    /// Paths of every number of the bodies and elements, in the order of the file; lists count as one.
    pub fn parameter_paths(&self) -> Vec<String> {
        let bodies = self.bodies.iter().map(|b| format!("bodies.{}", b.name));
        let keys = |e: &crate::model::Element| {
            let name = e.name.clone();
            e.law.kind().parameters.iter().map(move |p| format!("elements.{name}.{}", p.key)).collect::<Vec<_>>()
        };
        bodies.chain(self.elements.iter().flat_map(keys)).collect()
    }

    /// Whose number a path leads to; the error names in one sentence what there is instead.
    pub fn number_at(&self, path: &str) -> Result<NumberOf, String> {
        let bad = || format!("\"{path}\" is not the path of a parameter; expected bodies.NAME or (elements|inputs|outputs).NAME.KEY");
        let (section, rest) = path.split_once('.').ok_or_else(bad)?;
        if section == "bodies" {
            let body = self.bodies.iter().position(|b| b.name == rest);
            return body.map(NumberOf::Body).ok_or_else(|| unknown("body", rest, self.bodies.iter().map(|b| b.name.as_str())));
        }
        // Keys hold no dots, names may.
        let (name, key) = rest.rsplit_once('.').ok_or_else(bad)?;
        match section {
            "elements" => {
                let all = self.elements.iter().map(|e| e.name.as_str());
                let element = all.clone().position(|n| n == name).ok_or_else(|| unknown("element", name, all))?;
                let parameters = self.elements[element].law.kind().parameters.iter().map(|p| p.key);
                let parameter = parameters.clone().position(|k| k == key).ok_or_else(|| unknown("key", key, parameters))?;
                Ok(NumberOf::Element(element, parameter))
            }
            "inputs" => {
                let all = self.inputs.iter().map(|i| i.name.as_str());
                let input = all.clone().position(|n| n == name).ok_or_else(|| unknown("input", name, all))?;
                Ok(NumberOf::Input(input, key_named(&InputKey::ALL, |k| k.row().0, key)?))
            }
            "outputs" => {
                let all = self.outputs.iter().map(|o| o.name.as_str());
                let output = all.clone().position(|n| n == name).ok_or_else(|| unknown("output", name, all))?;
                Ok(NumberOf::Output(output, key_named(&OutputKey::ALL, |k| k.row().0, key)?))
            }
            _ => Err(bad()),
        }
    }
}

fn key_named<K: Copy>(all: &[K], name: impl Fn(K) -> &'static str, key: &str) -> Result<K, String> {
    all.iter().copied().find(|k| name(*k) == key).ok_or_else(|| unknown("key", key, all.iter().map(|k| name(*k))))
}
