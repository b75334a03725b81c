//! Numbers of a model by their path: `bodies.drum`, `elements.cable.stiffness`, `inputs.feedback_force.delay`.

use super::signals::delay_range;
use crate::elements::Range;
use crate::model::{Model, Output};
use crate::tomlfile::{check_range, unknown};

const INPUT_KEYS: [(&str, Range, f64); 6] = [
    ("gain", Range::Any, 1.0),
    ("saturation", Range::Positive, f64::INFINITY),
    ("delay", Range::NonNegative, 0.0),
    ("bandwidth", Range::Positive, f64::INFINITY),
    ("back_emf", Range::Any, 0.0),
    ("offset", Range::Any, 0.0),
];

const OUTPUT_KEYS: [(&str, Range, f64); 5] = [
    ("gain", Range::Any, 1.0),
    ("delay", Range::NonNegative, 0.0),
    ("offset", Range::Any, 0.0),
    ("resolution", Range::NonNegative, 0.0),
    ("noise", Range::NonNegative, 0.0),
];

/// What a path leads to.
enum Spot {
    Body(usize),
    /// Element, and index of its parameter.
    Element(usize, usize),
    Input(usize, usize),
    Output(usize, usize),
}

impl Model {
    /// Values at a path (a number is a list of one); the error says in one sentence what there is instead.
    pub fn values_at(&self, path: &str) -> Result<Vec<f64>, String> {
        Ok(match self.spot(path)? {
            Spot::Body(body) => vec![self.bodies[body].inertia],
            Spot::Element(element, parameter) => self.elements[element].law.values().swap_remove(parameter),
            Spot::Input(input, key) => {
                let i = &self.inputs[input];
                vec![[i.gain, i.saturation, i.delay, i.bandwidth, i.back_emf, i.offset][key]]
            }
            Spot::Output(output, key) => {
                let o = &self.outputs[output];
                vec![[o.gain, o.delay, o.offset, o.resolution, o.noise][key]]
            }
        })
    }

    /// Sets the values at a path; the error says in one sentence what is wrong with path or values, and the model stays as it was.
    pub fn set_values_at(&mut self, path: &str, values: &[f64]) -> Result<(), String> {
        let spot = self.spot(path)?;
        let one = |range: Range, unlimited: f64| match values {
            // What a file says by leaving the key out.
            [x] if *x == unlimited => Ok(*x),
            [x] => check_range(*x, range).map(|()| *x).map_err(|e| format!("{path} {e}")),
            _ => Err(format!("{path} takes one number, not {}", values.len())),
        };
        match spot {
            Spot::Body(body) => self.bodies[body].inertia = one(Range::NonNegative, 0.0)?,
            Spot::Element(element, parameter) => {
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
            Spot::Input(input, key) => {
                let range = if INPUT_KEYS[key].0 == "delay" { delay_range(self.inputs[input].kind) } else { INPUT_KEYS[key].1 };
                let x = one(range, INPUT_KEYS[key].2)?;
                let i = &mut self.inputs[input];
                *[&mut i.gain, &mut i.saturation, &mut i.delay, &mut i.bandwidth, &mut i.back_emf, &mut i.offset][key] = x;
            }
            Spot::Output(output, key) => {
                let x = one(OUTPUT_KEYS[key].1, OUTPUT_KEYS[key].2)?;
                let Output { gain, delay, offset, resolution, noise, .. } = &mut self.outputs[output];
                *[gain, delay, offset, resolution, noise][key] = x;
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

    fn spot(&self, path: &str) -> Result<Spot, String> {
        let bad = || format!("\"{path}\" is no path of a number; expected bodies.NAME or (elements|inputs|outputs).NAME.KEY");
        let (section, rest) = path.split_once('.').ok_or_else(bad)?;
        if section == "bodies" {
            let body = self.bodies.iter().position(|b| b.name == rest);
            return body.map(Spot::Body).ok_or_else(|| unknown("body", rest, self.bodies.iter().map(|b| b.name.as_str())));
        }
        // Keys hold no dots, names may.
        let (name, key) = rest.rsplit_once('.').ok_or_else(bad)?;
        match section {
            "elements" => {
                let all = self.elements.iter().map(|e| e.name.as_str());
                let element = all.clone().position(|n| n == name).ok_or_else(|| unknown("element", name, all))?;
                let parameters = self.elements[element].law.kind().parameters.iter().map(|p| p.key);
                let parameter = parameters.clone().position(|k| k == key).ok_or_else(|| unknown("key", key, parameters))?;
                Ok(Spot::Element(element, parameter))
            }
            "inputs" => {
                let all = self.inputs.iter().map(|i| i.name.as_str());
                let input = all.clone().position(|n| n == name).ok_or_else(|| unknown("input", name, all))?;
                Ok(Spot::Input(input, key_index(&INPUT_KEYS, key)?))
            }
            "outputs" => {
                let all = self.outputs.iter().map(|o| o.name.as_str());
                let output = all.clone().position(|n| n == name).ok_or_else(|| unknown("output", name, all))?;
                Ok(Spot::Output(output, key_index(&OUTPUT_KEYS, key)?))
            }
            _ => Err(bad()),
        }
    }
}

fn key_index(keys: &[(&str, Range, f64)], key: &str) -> Result<usize, String> {
    keys.iter().position(|k| k.0 == key).ok_or_else(|| unknown("key", key, keys.iter().map(|k| k.0)))
}
