//! Hypotheses as edits, and edits made to a model in memory as [`backdrive_plant::write::patch`] makes them to its file.

use super::types::{ElementForm, Form, Hypothesis, HypothesisError, Source};
use backdrive_plant::elements::{Kind, Law, kind_named};
use backdrive_plant::model::{Body, Element, Model, OutputKind, Place};
use backdrive_plant::write::{Edit, ElementSpec, Value};

impl Hypothesis {
    /// The model with this effect added.
    ///
    /// # Errors
    /// When the values are not one for each parameter or not possible, or the model is not the one that the hypothesis was made for.
    pub fn apply(&self, model: &Model, values: &[f64]) -> Result<Model, HypothesisError> {
        let mut edited = model.clone();
        apply_edits(&mut edited, &self.edits(model, values)?).map_err(|reason| HypothesisError::Value { id: self.id.clone(), reason })?;
        Ok(edited)
    }

    /// The same on the text of the model's file: [`backdrive_plant::write::patch`] with these edits gives the file of the edited model.
    ///
    /// # Errors
    /// As [`Hypothesis::apply`].
    pub fn edits(&self, model: &Model, values: &[f64]) -> Result<Vec<Edit>, HypothesisError> {
        if values.len() != self.parameters.len() {
            return Err(HypothesisError::Count { id: self.id.clone(), expected: self.parameters.len(), found: values.len() });
        }
        edits(self, model, values)
    }

    /// The same hypothesis as its parameters stand in a model that it was applied to: what a later fit of the whole starts from.
    pub fn values_in(&self, edited: &Model, without: &Model) -> Option<Vec<f64>> {
        let own = match &self.form {
            Form::Inertia { body } => without.values_at(&format!("bodies.{body}")).ok()?.first().copied()?,
            _ => 0.0,
        };
        self.parameters.iter().map(|p| Some(edited.values_at(&p.path).ok()?.get(p.index.unwrap_or(0))? - own)).collect()
    }

    /// Whether both may be applied to one model: they neither replace the same element nor set the same parameter.
    pub fn compatible(&self, other: &Hypothesis) -> bool {
        let same_element = self.replaces.iter().any(|name| other.replaces.contains(name));
        let same_number = self.parameters.iter().any(|p| other.parameters.iter().any(|q| p.path == q.path));
        let same_joint = self.splits_joint() && other.splits_joint() && self.place.same(&other.place);
        !same_element && !same_number && !same_joint && self.class != other.class
    }

    /// Whether it adds a body behind the elements of a joint.
    pub fn splits_joint(&self) -> bool {
        matches!(self.form, Form::Series { .. })
    }

    /// Whether it adds to the inertia of a body.
    pub fn adds_inertia(&self) -> bool {
        matches!(self.form, Form::Inertia { .. })
    }
}

/// The edits of a hypothesis; `values` are one for each of its parameters.
fn edits(hypothesis: &Hypothesis, model: &Model, values: &[f64]) -> Result<Vec<Edit>, HypothesisError> {
    let wrong = |reason: String| HypothesisError::Value { id: hypothesis.id.clone(), reason };
    let no_such = |what, name: &str| HypothesisError::NoSuch { id: hypothesis.id.clone(), what, name: name.to_string() };
    match &hypothesis.form {
        Form::Element(form) => put(form, model, values).map_err(|problem| match problem {
            Problem::NoElement(name) => no_such("element", &name),
            Problem::Reason(reason) => wrong(reason),
        }),
        // What a key without effect looks like is that the file does not have it; the others all have a finite number.
        Form::Key { path } => match values {
            [value] if value.is_finite() => Ok(vec![Edit::Set { path: path.clone(), value: Value::Number(*value), comment: None }]),
            [value] if *value == f64::INFINITY => Ok(Vec::new()),
            _ => Err(wrong(format!("{path} must be a number"))),
        },
        Form::Inertia { body } => {
            let own = model.bodies.iter().find(|b| b.name == *body).ok_or_else(|| no_such("body", body))?.inertia;
            let added = values.first().copied().unwrap_or(f64::NAN);
            if !(own + added).is_finite() || own + added < 0.0 {
                return Err(wrong(format!("the inertia of {body} must be at least 0, is {own} and {added}")));
            }
            Ok(vec![Edit::PutBody { name: body.clone(), inertia: own + added, comment: None }])
        }
        Form::Hung { on, body, element, kind } => hung(hypothesis, [on, body], element, kind, values).map_err(wrong),
        Form::Series { joint, body, spring, damper } => series(model, joint, body, [spring, damper], values).map_err(wrong),
    }
}

enum Problem {
    NoElement(String),
    Reason(String),
}

fn put(form: &ElementForm, model: &Model, values: &[f64]) -> Result<Vec<Edit>, Problem> {
    let find = |name: &str| model.elements.iter().position(|e| e.name == name);
    let mut numbers: Vec<Vec<f64>> = form
        .slots
        .iter()
        .map(|slot| {
            slot.iter()
                .map(|source| match source {
                    Source::Parameter(index) => values.get(*index).copied().unwrap_or(f64::NAN),
                    Source::Fixed(value) => *value,
                })
                .collect()
        })
        .collect();
    if let Some((p, x)) = form.kind.parameters.iter().zip(&numbers).find_map(|(p, list)| Some((p, list.iter().find(|x| !x.is_finite())?))) {
        return Err(Problem::Reason(format!("{} must be a finite number, is {x}", p.key)));
    }
    (form.tidy)(&mut numbers);
    for (p, list) in form.kind.parameters.iter().zip(&numbers) {
        for x in list {
            backdrive_plant::tomlfile::check_range(*x, p.range).map_err(|e| Problem::Reason(format!("{} {e}", p.key)))?;
        }
    }
    let law = (form.kind.build)(&numbers).map_err(Problem::Reason)?;
    let mut edits = Vec::new();
    // Another hypothesis may have moved the element's ends, so they are those of the model at hand.
    let between = match (form.in_place, find(&form.name)) {
        (true, Some(index)) => model.elements[index].between.map(|end| model.place_name(end).to_string()),
        (true, None) => return Err(Problem::NoElement(form.name.clone())),
        (false, _) => form.between.clone(),
    };
    let element = ElementSpec { name: form.name.clone(), between, law };
    edits.push(Edit::PutElement { element, comment: None });
    for name in &form.removes {
        let index = find(name).ok_or_else(|| Problem::NoElement(name.clone()))?;
        let read = model.outputs.iter().any(|o| matches!(&o.kind, OutputKind::Force(read) if read.contains(&index)));
        // An output that reads it must find it: a damper of no damping is none.
        edits.push(if read {
            Edit::Set { path: format!("elements.{name}.damping"), value: Value::Number(0.0), comment: None }
        } else {
            Edit::RemoveElement { name: name.clone() }
        });
    }
    Ok(edits)
}

/// A free body, and the element that it hangs on.
fn hung(hypothesis: &Hypothesis, [on, body]: [&String; 2], name: &str, kind: &'static Kind, values: &[f64]) -> Result<Vec<Edit>, String> {
    let Some((inertia, values)) = values.split_last() else { return Err("an inertia is needed".to_string()) };
    let of = |key: &str| hypothesis.parameters.iter().zip(values).find(|(p, _)| p.key == key).map(|(_, value)| *value);
    let numbers: Vec<Vec<f64>> = kind.parameters.iter().map(|p| vec![of(p.key).or(p.default).unwrap_or(0.0)]).collect();
    for (p, list) in kind.parameters.iter().zip(&numbers) {
        for x in list {
            backdrive_plant::tomlfile::check_range(*x, p.range).map_err(|e| format!("{} {e}", p.key))?;
        }
    }
    if !(inertia.is_finite() && *inertia > 0.0) {
        return Err(format!("the inertia of {body} must be above 0, is {inertia}"));
    }
    let element = ElementSpec { name: name.to_string(), between: [on.clone(), body.clone()], law: (kind.build)(&numbers)? };
    Ok(vec![Edit::PutBody { name: body.clone(), inertia: *inertia, comment: None }, Edit::PutElement { element, comment: None }])
}

/// What was between the ends of the joint is now between the first of them and the new body; spring and damper lead from there to the second.
fn series(model: &Model, joint: &[String; 2], body: &str, names: [&String; 2], values: &[f64]) -> Result<Vec<Edit>, String> {
    let [stiffness, damping, inertia] = values else { return Err("stiffness, damping and inertia are needed".to_string()) };
    let mut edits = vec![Edit::PutBody { name: body.to_string(), inertia: *inertia, comment: None }];
    for index in 0..model.elements.len() {
        let Some(mut element) = model.element_spec(index) else { continue };
        let at = |end: &String| joint.iter().position(|j| j == end);
        if let (Some(i), Some(k)) = (at(&element.between[0]), at(&element.between[1]))
            && i != k
        {
            element.between[usize::from(i == 0)] = body.to_string();
            edits.push(Edit::PutElement { element, comment: None });
        }
    }
    for (kind, name, value) in [("spring", names[0], *stiffness), ("damper", names[1], *damping)] {
        let kind = kind_named(kind).ok_or("the element registry lacks springs or dampers")?;
        let rest = kind.parameters.iter().skip(1).map(|p| vec![p.default.unwrap_or(0.0)]);
        let law: Law = (kind.build)(&std::iter::once(vec![value]).chain(rest).collect::<Vec<_>>())?;
        let element = ElementSpec { name: name.clone(), between: [body.to_string(), joint[1].clone()], law };
        edits.push(Edit::PutElement { element, comment: None });
    }
    Ok(edits)
}

/// Makes edits to a model in memory, with the result that [`backdrive_plant::write::patch`] has on its file.
///
/// # Errors
/// In one sentence, when an edit names something that the model does not have or a number it cannot hold. The model is then half edited.
pub fn apply_edits(model: &mut Model, edits: &[Edit]) -> Result<(), String> {
    for edit in edits {
        match edit {
            Edit::Set { path, value, .. } => match value {
                Value::Number(x) => model.set_values_at(path, &[*x])?,
                Value::Numbers(list) => model.set_values_at(path, list)?,
            },
            Edit::PutBody { name, inertia, .. } => {
                if !inertia.is_finite() || *inertia < 0.0 {
                    return Err(format!("the inertia of {name} must be at least 0, is {inertia}"));
                }
                match model.bodies.iter_mut().find(|b| b.name == *name) {
                    Some(body) => body.inertia = *inertia,
                    None => model.bodies.push(Body { name: name.clone(), inertia: *inertia }),
                }
            }
            Edit::PutElement { element, .. } => {
                let ends = [place(model, &element.between[0])?, place(model, &element.between[1])?];
                let new = Element { name: element.name.clone(), between: ends, law: element.law.clone() };
                match model.elements.iter_mut().find(|e| e.name == element.name) {
                    Some(old) => *old = new,
                    None => model.elements.push(new),
                }
            }
            Edit::RemoveElement { name } => remove(model, name)?,
        }
    }
    Ok(())
}

fn place(model: &Model, name: &str) -> Result<Place, String> {
    if name == "ground" {
        return Ok(None);
    }
    model.bodies.iter().position(|b| b.name == name).map(Some).ok_or_else(|| format!("the model has no body \"{name}\""))
}

fn remove(model: &mut Model, name: &str) -> Result<(), String> {
    let gone = model.elements.iter().position(|e| e.name == name).ok_or_else(|| format!("the model has no element \"{name}\""))?;
    for output in &mut model.outputs {
        if let OutputKind::Force(read) = &mut output.kind {
            if read.contains(&gone) {
                return Err(format!("output \"{}\" reads element \"{name}\", which cannot be removed", output.name));
            }
            read.iter_mut().filter(|index| **index > gone).for_each(|index| *index -= 1);
        }
    }
    for axis in &mut model.axes {
        axis.touches.retain(|index| *index != gone);
        axis.touches.iter_mut().filter(|index| **index > gone).for_each(|index| *index -= 1);
    }
    model.elements.remove(gone);
    Ok(())
}
