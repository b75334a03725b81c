//! The physics that a model may have left out: each kind of it at each place where it could sit.
//!
//! A physics is one file here (where it can sit, its parameters, where a fit starts) and one line in [`PHYSICS`].

mod apply;
mod asymmetric_coulomb;
mod asymmetric_damper;
mod back_emf;
mod backlash;
mod bandwidth;
mod bias;
mod bouc_wen;
mod builder;
mod cogging;
mod contact;
mod coulomb;
mod cubic_spring;
mod dahl;
mod damper;
mod delay;
mod friction_deficit;
mod gain;
mod hunt_crossley;
mod hysteretic_spring;
mod inerter;
mod inertia;
mod lugre;
mod maxwell_slip;
mod offset;
mod preisach_lugre;
mod quadratic_drag;
mod saturation;
mod scales;
mod series_compliance;
mod sites;
mod spring;
mod stribeck;
#[cfg(test)]
mod tests;

pub use apply::apply_edits;
pub use scales::{Scales, Span};
pub(crate) use sites::is_seen;

use backdrive_plant::elements::Kind;
use backdrive_plant::model::Model;
use backdrive_plant::write::Edit;
use sites::Sites;

/// Every physics, simple ones first: of two that explain alike, the earlier is the simpler.
pub const PHYSICS: &[&Physics] = &[
    &bias::PHYSICS,
    &offset::PHYSICS,
    &gain::PHYSICS,
    &inertia::PHYSICS,
    &damper::PHYSICS,
    &back_emf::PHYSICS,
    &spring::PHYSICS,
    &inerter::PHYSICS,
    &coulomb::PHYSICS,
    &quadratic_drag::PHYSICS,
    &delay::PHYSICS,
    &bandwidth::PHYSICS,
    &saturation::PHYSICS,
    &asymmetric_damper::PHYSICS,
    &asymmetric_coulomb::PHYSICS,
    &cubic_spring::PHYSICS,
    &dahl::PHYSICS,
    &stribeck::PHYSICS,
    &friction_deficit::PHYSICS,
    &cogging::PHYSICS,
    &backlash::PHYSICS,
    &contact::PHYSICS,
    &hunt_crossley::PHYSICS,
    &series_compliance::PHYSICS,
    &bouc_wen::PHYSICS,
    &lugre::PHYSICS,
    &hysteretic_spring::PHYSICS,
    &maxwell_slip::PHYSICS,
    &preisach_lugre::PHYSICS,
];

/// What is known of a physics before any device is looked at.
pub struct Physics {
    /// Name in verdicts: an element kind, the key of a signal, `inertia` or `series_compliance`.
    pub name: &'static str,
    /// What it belongs to: `friction`, `stiffness`, `hysteresis`, `contact`, `damping`, `inertia`, `lag`, `limit`, `scale`, `ripple`, `bias`.
    pub family: &'static str,
    /// Physics that it contains as a special or limiting case: who withholds one of these withholds it too.
    pub contains: &'static [&'static str],
    /// The hypotheses that it makes of a device.
    propose: fn(&Sites) -> Vec<Hypothesis>,
}

/// Where a physics sits.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Place {
    /// Between two bodies, or a body and `ground`.
    Between(String, String),
    /// At an input or an output.
    Signal(String),
}

impl Place {
    /// Whether both are the same place; the order of the ends does not matter.
    pub fn same(&self, other: &Place) -> bool {
        match (self, other) {
            (Place::Between(a, b), Place::Between(c, d)) => (a, b) == (c, d) || (a, b) == (d, c),
            _ => self == other,
        }
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Place::Between(a, b) => write!(f, "{a}-{b}"),
            Place::Signal(name) => write!(f, "{name}"),
        }
    }
}

/// A number that a hypothesis adds.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in a verdict.
    pub key: String,
    /// Its unit in this model.
    pub unit: String,
    /// Where it stands in the edited model, as [`Model::values_at`] takes it. For `inertia` that holds the body's own as well.
    pub path: String,
    /// Its place in the list, where the path leads to one.
    pub index: Option<usize>,
    /// Smallest and largest value a fit may try.
    pub range: (f64, f64),
    /// Value at which it has no effect, which may be infinite; `None` where it does not matter once the others have none.
    pub neutral: Option<f64>,
    /// Whether a fit steps in its logarithm; the range is then above 0.
    pub log: bool,
}

/// Values with which one hypothesis does nearly what another at the same place with fewer numbers does with its own, where it is the same law drawn
/// more finely: friction that builds up over a distance is that of many contacts, drawn with one state. `None` where they are no such two.
pub(crate) fn refined(coarse: &Hypothesis, values: &[f64], finer: &Hypothesis) -> Option<Vec<f64>> {
    if !coarse.place.same(&finer.place) || coarse.replaces != finer.replaces {
        return None;
    }
    match (coarse.physics, finer.physics) {
        ("maxwell_slip", "maxwell_slip") => maxwell_slip::split(coarse, values, finer),
        ("dahl" | "lugre", "maxwell_slip") => maxwell_slip::spread(coarse, values, finer),
        ("dahl", "lugre") => lugre::around(values, finer),
        ("backlash", "backlash") => backlash::blunted(values, finer),
        _ => None,
    }
}

/// Where a fit of `other` starts in the place of a law that was fitted: of friction that holds and slides the forces are those of the one before, all
/// scaled alike. Elsewhere its own starts.
pub(crate) fn starts_beside(law: &Hypothesis, values: &[f64], other: &Hypothesis) -> Vec<Vec<f64>> {
    let is_force = |p: &Parameter| matches!(p.unit.as_str(), "N" | "N m");
    let forces = |h: &Hypothesis, values: &[f64]| {
        let all: Vec<f64> = h.parameters.iter().zip(values).filter(|(p, _)| is_force(p)).map(|(_, v)| *v).collect();
        // Sliders carry what they do together, other laws at one time one of their levels.
        let share = if h.physics == "maxwell_slip" { 1.0 } else { 1.0 / all.len().max(1) as f64 };
        share * all.iter().sum::<f64>()
    };
    let level = forces(law, values);
    if law.family != "friction" || other.family != "friction" || level.is_nan() || level <= 0.0 {
        return other.starts.clone();
    }
    let scaled = |start: &Vec<f64>| {
        let own = forces(other, start);
        let scale = if own > 0.0 { level / own } else { 1.0 };
        let value = |(p, v): (&Parameter, &f64)| (if is_force(p) { scale * v } else { *v }).clamp(p.range.0, p.range.1);
        other.parameters.iter().zip(start).map(value).collect()
    };
    let mut starts: Vec<Vec<f64>> = other.starts.iter().map(scaled).collect();
    starts.dedup();
    starts
}

/// A physics at a place.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Such as `coulomb@drum-ground`: unique among the hypotheses of a model.
    pub id: String,
    /// Its name in a verdict.
    pub physics: &'static str,
    /// Where it sits.
    pub place: Place,
    /// Names of the elements it takes the place of, first the one whose name it keeps.
    pub replaces: Vec<String>,
    /// As [`Physics::family`].
    pub family: &'static str,
    /// What it adds.
    pub parameters: Vec<Parameter>,
    /// Where fits start, most plausible first: one value for each parameter.
    pub starts: Vec<Vec<f64>>,
    /// Path of a number that the model states and that does the same; nothing is gained where a fit has that one free.
    pub same_as: Option<String>,
    /// Equal for hypotheses that no recording can tell apart.
    pub class: String,
    form: Form,
}

/// What a hypothesis does to a model.
#[derive(Debug, Clone)]
enum Form {
    /// Puts an element, new or in the place of another.
    Element(ElementForm),
    /// Sets a key of an input or output.
    Key { path: String },
    /// Adds to a body's inertia.
    Inertia { body: String },
    /// Adds a body behind the elements of a joint, and a spring and a damper from it to the joint's other end.
    Series { joint: [String; 2], body: String, spring: String, damper: String },
}

#[derive(Debug, Clone)]
struct ElementForm {
    name: String,
    between: [String; 2],
    /// Whether it takes the place of the element of that name, whose ends it then takes, too.
    in_place: bool,
    kind: &'static Kind,
    /// For each parameter of the kind: where its values come from.
    slots: Vec<Vec<Source>>,
    /// Brings values that contradict each other to the nearest ones that do not.
    tidy: fn(&mut [Vec<f64>]),
    /// Elements that go.
    removes: Vec<String>,
}

#[derive(Debug, Clone, Copy)]
enum Source {
    Parameter(usize),
    Fixed(f64),
}

/// Why a hypothesis cannot be applied.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HypothesisError {
    /// Not one value for each parameter.
    #[error("{id} takes {expected} values, not {found}")]
    Count {
        /// The hypothesis.
        id: String,
        /// How many it takes.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A value that a model cannot hold.
    #[error("{id}: {reason}")]
    Value {
        /// The hypothesis.
        id: String,
        /// One sentence.
        reason: String,
    },
    /// The model is another than the one the hypothesis was made for.
    #[error("{id}: the model has no {what} \"{name}\"; the hypothesis was made for another model")]
    NoSuch {
        /// The hypothesis.
        id: String,
        /// `element` or `body`.
        what: &'static str,
        /// Its name.
        name: String,
    },
}

impl Hypothesis {
    /// The model with this physics added.
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
        apply::edits(self, model, values)
    }

    /// The same hypothesis as its parameters stand in a model that it was applied to: what a later fit of the whole starts from.
    pub fn values_in(&self, edited: &Model, without: &Model) -> Option<Vec<f64>> {
        let own = match &self.form {
            Form::Inertia { body } => without.values_at(&format!("bodies.{body}")).ok()?.first().copied()?,
            _ => 0.0,
        };
        self.parameters.iter().map(|p| Some(edited.values_at(&p.path).ok()?.get(p.index.unwrap_or(0))? - own)).collect()
    }

    /// Whether both may be applied to one model: they neither take the place of the same element nor set the same number.
    pub fn compatible(&self, other: &Hypothesis) -> bool {
        let same_element = self.replaces.iter().any(|name| other.replaces.contains(name));
        let same_number = self.parameters.iter().any(|p| other.parameters.iter().any(|q| p.path == q.path));
        let same_joint = self.physics == "series_compliance" && other.physics == self.physics && self.place.same(&other.place);
        !same_element && !same_number && !same_joint && self.class != other.class
    }
}

/// Every hypothesis about a device. `scales` are those of the same model.
pub fn all(model: &Model, scales: &Scales) -> Vec<Hypothesis> {
    let sites = Sites::of(model, scales);
    PHYSICS.iter().flat_map(|physics| (physics.propose)(&sites)).collect()
}

/// What is known of the physics of this name.
pub fn physics_named(name: &str) -> Option<&'static Physics> {
    PHYSICS.iter().copied().find(|p| p.name == name)
}

/// Whether one physics has another as a special or limiting case.
pub(crate) fn contains(physics: &str, simpler: &str) -> bool {
    PHYSICS.iter().any(|p| p.name == physics && p.contains.contains(&simpler))
}

/// Names of everything that goes when these are withheld: themselves and whatever contains one of them.
pub fn withheld(names: &[&str]) -> Vec<&'static str> {
    let mut gone: Vec<&'static str> = PHYSICS.iter().map(|p| p.name).filter(|name| names.contains(name)).collect();
    loop {
        let next: Vec<_> =
            PHYSICS.iter().filter(|p| !gone.contains(&p.name) && p.contains.iter().any(|c| gone.contains(c))).map(|p| p.name).collect();
        if next.is_empty() {
            return gone;
        }
        gone.extend(next);
    }
}

/// The hypotheses that are left when these physics, and all that contain one of them, are withheld.
pub fn without(hypotheses: Vec<Hypothesis>, names: &[&str]) -> Vec<Hypothesis> {
    let gone = withheld(names);
    hypotheses.into_iter().filter(|h| !gone.contains(&h.physics)).collect()
}
