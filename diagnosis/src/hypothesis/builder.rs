//! Puts hypotheses together: names, units and paths follow from the element registry and the site.

use super::sites::{DryFriction, Site, Sites};
use super::types::{ElementForm, Form, Hypothesis, Parameter, Physics, Place, Source};
use backdrive_plant::describe::unit_for;
use backdrive_plant::elements::{Kind, Law, kind_named};
use backdrive_plant::model::{InputKind, Model};

/// An element in the making.
pub(crate) struct ElementBuilder<'a> {
    sites: &'a Sites<'a>,
    physics: &'static Physics,
    kind: &'static Kind,
    between: [String; 2],
    name: String,
    in_place: bool,
    removes: Vec<String>,
    slots: Vec<Vec<Source>>,
    parameters: Vec<Parameter>,
    tidy: fn(&mut [Vec<f64>]),
    tag: &'static str,
}

/// What a fit may do with a parameter.
#[derive(Clone, Copy)]
pub(crate) struct Freedom {
    pub range: (f64, f64),
    pub neutral: Option<f64>,
    pub log: bool,
}

/// From `low` to `high` in even steps, without effect at `neutral`.
pub(crate) fn even(low: f64, high: f64, neutral: f64) -> Freedom {
    Freedom { range: (low, high), neutral: Some(neutral), log: false }
}

/// From `low` to `high` in even steps, of no matter where others have no effect.
pub(crate) fn any(low: f64, high: f64) -> Freedom {
    Freedom { range: (low, high), neutral: None, log: false }
}

/// From `low` to `high`, both above 0, by its logarithm.
pub(crate) fn log(low: f64, high: f64) -> Freedom {
    Freedom { range: (low, high), neutral: None, log: true }
}

impl<'a> ElementBuilder<'a> {
    /// A new element at a site. `None` where the registry has no such kind.
    pub fn new(sites: &'a Sites<'a>, physics: &'static Physics, site: &Site) -> Option<ElementBuilder<'a>> {
        ElementBuilder::of_kind(sites, physics, physics.name, site)
    }

    /// The same where the element's kind has another name than the effect.
    pub fn of_kind(sites: &'a Sites<'a>, physics: &'static Physics, kind: &str, site: &Site) -> Option<ElementBuilder<'a>> {
        let kind = kind_named(kind)?;
        let name = free_name(sites.model, &format!("{}_{}", physics.name, site.label()));
        Some(ElementBuilder {
            sites,
            physics,
            kind,
            between: site.between.clone(),
            name,
            in_place: false,
            removes: Vec::new(),
            slots: kind
                .parameters
                .iter()
                .map(|p| p.default_values().unwrap_or(vec![0.0]).into_iter().map(Source::Fixed).collect())
                .collect(),
            parameters: Vec::new(),
            tidy: |_| (),
            tag: "",
        })
    }

    /// It takes the place and name of this element.
    pub fn replacing(mut self, index: usize) -> Self {
        if let Some(element) = self.sites.model.element_spec(index) {
            (self.name, self.between, self.in_place) = (element.name, element.between, true);
        }
        self
    }

    /// It takes the place of the dry friction that the model has at its site, if any, and starts from its level. `None` where that is of the same kind.
    pub fn in_place_of_friction(self, site: &Site) -> Option<(Self, Option<DryFriction>)> {
        match self.sites.dry_friction(site) {
            None => Some((self, None)),
            Some(there) if there.kind == self.physics.name => None,
            Some(there) => Some((self.replacing(there.index), Some(there))),
        }
    }

    /// The same of a law that has friction of one level as its only special case, and that level. `None` where another law stands there.
    pub fn in_place_of_plain_friction(self, site: &Site) -> Option<(Self, Option<f64>)> {
        match self.sites.dry_friction(site) {
            None => Some((self, None)),
            Some(there) => there.is_plain().then(|| (self.replacing(there.index), Some(there.level))),
        }
    }

    /// It takes the place of the spring that holds the joint, if any, and starts from its stiffness. `None` where another law holds it.
    pub fn in_place_of_spring(self, site: &Site) -> Option<(Self, Option<f64>)> {
        match self.sites.holding(site) {
            None => Some((self, None)),
            Some((index, there)) => (there.law.kind().name == "spring").then(|| (self.replacing(index), Some(first_value(&there.law)))),
        }
    }

    /// It stands for this element, too, which goes.
    pub fn removing(mut self, index: Option<usize>) -> Self {
        self.removes.extend(index.and_then(|i| self.sites.model.elements.get(i)).map(|e| e.name.clone()));
        self
    }

    /// The other way round: what pushes in one direction only pushes in the other.
    pub fn reversed(mut self) -> Self {
        self.between.swap(0, 1);
        if !self.in_place {
            self.name = free_name(self.sites.model, &format!("{}_{}_{}", self.physics.name, self.between[0], self.between[1]));
        }
        self
    }

    /// A word that distinguishes its id from others of this effect at this place.
    pub fn tag(mut self, tag: &'static str) -> Self {
        self.tag = tag;
        self
    }

    /// A parameter that is fitted.
    pub fn number(mut self, key: &'static str, freedom: Freedom) -> Self {
        self.push(key, None, freedom);
        self
    }

    /// A list of parameters that are fitted.
    pub fn list(mut self, key: &'static str, count: usize, freedom: Freedom) -> Self {
        (0..count).for_each(|index| self.push(key, Some(index), freedom));
        self
    }

    /// A parameter that stays fixed.
    pub fn fixed(mut self, key: &'static str, value: f64) -> Self {
        if let Some(slot) = self.slot(key) {
            self.slots[slot] = vec![Source::Fixed(value)];
        }
        self
    }

    /// What brings values that contradict each other together.
    pub fn tidy(mut self, tidy: fn(&mut [Vec<f64>])) -> Self {
        self.tidy = tidy;
        self
    }

    fn slot(&self, key: &str) -> Option<usize> {
        self.kind.parameters.iter().position(|p| p.key == key)
    }

    fn push(&mut self, key: &'static str, index: Option<usize>, freedom: Freedom) {
        let Some(slot) = self.slot(key) else { return };
        let source = Source::Parameter(self.parameters.len());
        match index {
            None | Some(0) => self.slots[slot] = vec![source],
            Some(_) => self.slots[slot].push(source),
        }
        self.parameters.push(Parameter {
            key: key.to_string(),
            unit: unit_for(self.sites.model.motion, self.kind.parameters[slot].unit),
            path: String::new(),
            index,
            range: freedom.range,
            neutral: freedom.neutral,
            log: freedom.log,
            in_samples: false,
        });
    }

    /// Ready, with the values that fits start from; each is brought into its range.
    pub fn starts(mut self, starts: Vec<Vec<f64>>) -> Hypothesis {
        for p in &mut self.parameters {
            p.path = format!("elements.{}.{}", self.name, p.key);
        }
        let replaces = if self.in_place { std::iter::once(self.name.clone()).chain(self.removes.clone()).collect() } else { Vec::new() };
        let place = Place::Between(self.between[0].clone(), self.between[1].clone());
        let id = id(self.physics.name, &place, self.tag);
        let form = Form::Element(ElementForm {
            name: self.name,
            between: self.between,
            in_place: self.in_place,
            kind: self.kind,
            slots: self.slots,
            tidy: self.tidy,
            removes: self.removes,
        });
        finish(id, self.physics, place, replaces, self.parameters, starts, form)
    }
}

/// A key of an input (`inputs`) or an output (`outputs`) that the file does not state.
pub(crate) fn key(
    sites: &Sites,
    physics: &'static Physics,
    section: &str,
    signal: &str,
    unit: &str,
    freedom: Freedom,
    starts: &[f64],
) -> Hypothesis {
    let path = format!("{section}.{signal}.{}", physics.name);
    let parameter = Parameter {
        key: physics.name.to_string(),
        unit: unit_for(sites.model.motion, unit),
        path: path.clone(),
        index: None,
        range: freedom.range,
        neutral: freedom.neutral,
        log: freedom.log,
        in_samples: false,
    };
    let place = Place::Signal(signal.to_string());
    let id = id(physics.name, &place, "");
    finish(id, physics, place, Vec::new(), vec![parameter], starts.iter().map(|s| vec![*s]).collect(), Form::Key { path })
}

/// More inertia on a body.
pub(crate) fn inertia(sites: &Sites, physics: &'static Physics, body: &str, freedom: Freedom, starts: &[f64]) -> Hypothesis {
    let parameter = Parameter {
        key: "inertia".to_string(),
        unit: unit_for(sites.model.motion, "kg"),
        path: format!("bodies.{body}"),
        index: None,
        range: freedom.range,
        neutral: freedom.neutral,
        log: freedom.log,
        in_samples: false,
    };
    let place = Place::Between(body.to_string(), "ground".to_string());
    let id = id(physics.name, &place, "");
    let form = Form::Inertia { body: body.to_string() };
    finish(id, physics, place, Vec::new(), vec![parameter], starts.iter().map(|s| vec![*s]).collect(), form)
}

/// A body added into a joint; `ranges` are those of stiffness, damping and inertia, as are the parameters of each start.
pub(crate) fn series(
    sites: &Sites,
    physics: &'static Physics,
    joint: [String; 2],
    freedoms: [Freedom; 3],
    starts: Vec<Vec<f64>>,
) -> Hypothesis {
    let model = sites.model;
    let label = format!("{}_{}", joint[0], joint[1]);
    let body = {
        let taken = |name: &str| name == "ground" || model.bodies.iter().any(|b| b.name == name);
        unique(&format!("{label}_between"), taken)
    };
    let spring = free_name(model, &format!("series_spring_{label}"));
    let damper = free_name(model, &format!("series_damping_{label}"));
    let paths = [format!("elements.{spring}.stiffness"), format!("elements.{damper}.damping"), format!("bodies.{body}")];
    let keys = [("stiffness", "N/m"), ("damping", "N s/m"), ("inertia", "kg")];
    let parameters = keys
        .iter()
        .zip(paths)
        .zip(freedoms)
        .map(|(((key, unit), path), freedom)| Parameter {
            key: key.to_string(),
            unit: unit_for(model.motion, unit),
            path,
            index: None,
            range: freedom.range,
            neutral: freedom.neutral,
            log: freedom.log,
            in_samples: false,
        })
        .collect();
    let place = Place::Between(joint[0].clone(), joint[1].clone());
    let id = id(physics.name, &place, "");
    finish(id, physics, place, Vec::new(), parameters, starts, Form::Series { joint, body, spring, damper })
}

/// A free body hung on another by an element of the effect's kind: `freedoms` are those of the keys, and of the body's inertia.
pub(crate) fn hung(
    sites: &Sites,
    physics: &'static Physics,
    on: &str,
    keys: &[(&'static str, Freedom)],
    inertia: Freedom,
    starts: Vec<Vec<f64>>,
) -> Option<Hypothesis> {
    let (model, kind) = (sites.model, kind_named(physics.name)?);
    let taken = |name: &str| name == "ground" || model.bodies.iter().any(|b| b.name == name);
    let body = unique(&format!("behind_{on}"), taken);
    let element = free_name(model, &format!("{}_{on}_{body}", physics.name));
    let parameter = |key: &str, unit: &str, path: String, freedom: Freedom| Parameter {
        key: key.to_string(),
        unit: unit_for(model.motion, unit),
        path,
        index: None,
        range: freedom.range,
        neutral: freedom.neutral,
        log: freedom.log,
        in_samples: false,
    };
    let mut parameters = Vec::new();
    for (key, freedom) in keys {
        let unit = kind.parameters.iter().find(|p| p.key == *key)?.unit;
        parameters.push(parameter(key, unit, format!("elements.{element}.{key}"), *freedom));
    }
    parameters.push(parameter("inertia", "kg", format!("bodies.{body}"), inertia));
    let place = Place::Between(on.to_string(), body.clone());
    let id = id(physics.name, &place, "");
    let form = Form::Hung { on: on.to_string(), body, element, kind };
    Some(finish(id, physics, place, Vec::new(), parameters, starts, form))
}

impl Hypothesis {
    /// Sets the parameter of the model that has the same effect.
    pub(crate) fn same_as(mut self, path: Option<String>) -> Hypothesis {
        self.same_as = path;
        self
    }

    /// Marks its parameters as shifts of a signal in time.
    pub(crate) fn in_samples(mut self) -> Hypothesis {
        self.parameters.iter_mut().for_each(|p| p.in_samples = true);
        self
    }

    /// Puts it into a class with others that no recording can tell from it.
    pub(crate) fn class(mut self, class: String) -> Hypothesis {
        self.class = class;
        self
    }
}

/// Class of the lags that a device with one driven force and one sensor shows at both, if it is such a device.
pub(crate) fn only_input_and_output(model: &Model) -> bool {
    model.inputs.len() == 1 && model.outputs.len() == 1 && model.inputs[0].kind == InputKind::Force
}

/// The parameter of a linear element of this kind between a body and ground.
pub(crate) fn stated(model: &Model, body: usize, kind: &str, key: &str) -> Option<String> {
    let to_ground = |between: [Option<usize>; 2]| between.contains(&Some(body)) && between.contains(&None);
    let found = model.elements.iter().find(|e| e.law.kind().name == kind && to_ground(e.between));
    found.map(|e| format!("elements.{}.{key}", e.name))
}

/// The only parameter of a law.
pub(crate) fn first_value(law: &Law) -> f64 {
    law.values().first().and_then(|v| v.first()).copied().unwrap_or(0.0)
}

fn id(physics: &str, place: &Place, tag: &str) -> String {
    if tag.is_empty() { format!("{physics}@{place}") } else { format!("{physics}@{place}:{tag}") }
}

fn free_name(model: &Model, wanted: &str) -> String {
    unique(wanted, |name| model.elements.iter().any(|e| e.name == name))
}

fn unique(wanted: &str, taken: impl Fn(&str) -> bool) -> String {
    let numbered = (2..).map(|i| format!("{wanted}_{i}"));
    std::iter::once(wanted.to_string()).chain(numbered).find(|name| !taken(name)).unwrap_or_else(|| wanted.to_string())
}

fn finish(
    id: String,
    physics: &'static Physics,
    place: Place,
    replaces: Vec<String>,
    parameters: Vec<Parameter>,
    mut starts: Vec<Vec<f64>>,
    form: Form,
) -> Hypothesis {
    for start in &mut starts {
        for (x, p) in start.iter_mut().zip(&parameters) {
            *x = x.max(p.range.0).min(p.range.1);
        }
    }
    Hypothesis { class: id.clone(), id, physics, place, replaces, parameters, starts, same_as: None, form }
}
