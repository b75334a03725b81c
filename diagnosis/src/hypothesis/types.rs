//! An effect, its properties that are independent of any device, and an effect at a place.

use super::sites::Sites;
use backdrive_plant::elements::Kind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// A force that has always the same sign and size, or a reading that is off by as much.
    Bias,
    /// An actuator or sensor of another scale.
    Scale,
    /// Force over acceleration.
    Inertia,
    /// Force over velocity.
    Damping,
    /// Force over displacement.
    Stiffness,
    /// Dry friction, with or without presliding.
    Friction,
    /// A signal that comes late.
    Lag,
    /// A signal that ends at some size.
    Limit,
    /// A force that repeats with position.
    Ripple,
    /// Bodies that touch and part.
    Contact,
    /// A joint that is softer than the model has it.
    Compliance,
    /// Stiffness that loses energy whatever the rate.
    Hysteresis,
    /// A force that depends on how the device stands.
    Gravity,
}

impl Family {
    /// Common description of a family in words; `None` where there is no informative one.
    pub fn words(self) -> Option<&'static str> {
        match self {
            Family::Friction => Some("dry friction"),
            Family::Hysteresis => Some("hysteresis"),
            Family::Contact => Some("a contact or backlash"),
            Family::Stiffness => Some("stiffness"),
            Family::Damping => Some("viscous friction"),
            Family::Lag => Some("a delay or lag"),
            Family::Gravity => Some("gravity"),
            Family::Bias | Family::Scale | Family::Inertia | Family::Limit | Family::Ripple | Family::Compliance => None,
        }
    }
}

/// The variable that an effect's force is plotted against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Against {
    /// Velocity across the place.
    Velocity,
    /// Displacement across the place.
    Displacement,
    /// Acceleration across the place.
    Acceleration,
    /// Value of the signal.
    Signal,
    /// Rate of change of the signal.
    SignalRate,
    /// Time.
    Time,
}

/// The state of the device in which an effect shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Where the velocity changes its sign.
    Reversals,
    /// Where bodies meet or part.
    Contact,
    /// At large values of the signal.
    Large,
    /// Again and again over the displacement.
    Periodic,
    /// With the variable that it is plotted against.
    WithItsVariable,
}

/// The mark of an effect among those that are easily confused. Two effects with different marks are separated by the property that [`crate::experiment`]
/// names for the pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Mark {
    Dry,
    Viscous,
    Drag,
    NearRest,
    Presliding,
    Memory,
    Gap,
    Delay,
    Lag,
    Mass,
    Soft,
    Limit,
    Shape,
    Lopsided,
    Bias,
    Ripple,
    Spring,
    Other,
}

/// An effect: everything that diagnosis knows of it before any device is looked at.
pub struct Physics {
    /// Name in verdicts: an element kind, the key of a signal, `inertia`, `gravity` or `series_compliance`.
    pub name: &'static str,
    /// What it belongs to.
    pub family: Family,
    /// Its name in words, with an article where it takes one.
    pub words: &'static str,
    /// The parameter that gives its size.
    pub size: &'static str,
    /// What its force is plotted against.
    pub against: Against,
    /// In which state of the device it shows.
    pub state: State,
    /// What it is among those that are easily taken for each other.
    pub mark: Mark,
    /// What is so of a few only.
    pub facts: Facts,
    /// The hypotheses that it makes of a device.
    pub(crate) propose: fn(&Sites) -> Vec<Hypothesis>,
}

/// Properties of a few effects only: a file states what differs from [`Facts::NONE`].
pub struct Facts {
    /// Whether its force is proportional to its first parameter, so that the smallest detectable size can be computed.
    pub proportional: bool,
    /// The information needed to separate it from an effect whose force is the same in the same place; `None` where there is none.
    pub twin: Option<&'static str>,
    /// Of dry friction: the parameters whose mean is the level at speed (the values of a list add up).
    pub sliding: &'static [&'static str],
    /// Parameters that start from the level of a dry friction that stood in its place.
    pub from_level: &'static [&'static str],
    /// Whether its force depends on the path: its element kind has a memory.
    pub memory: bool,
    /// Whether it holds a joint, as a spring does.
    pub holds: bool,
    /// Values with which a hypothesis of this effect nearly reproduces a coarser one at the same place, where it is the same law at finer resolution.
    /// Example: friction that builds up over a distance is that of many contacts, described by one state.
    pub refine: fn(&Hypothesis, &[f64], &Hypothesis) -> Option<Vec<f64>>,
    /// Ranges of parameters that a device may have, by key, in SI units: what a fit finds outside them is never claimed. Narrower than what it may try.
    pub plausible: &'static [(&'static str, f64, f64)],
    /// Physics that it contains as a special or limiting case: who withholds one of these withholds it too.
    pub contains: &'static [&'static str],
    /// Numbers of its law that are known beforehand, and yet are claimed with it.
    pub fixed: usize,
    /// Whether the misfit has many local minima over its size, so that fits start from sizes all over its range.
    pub scanned: bool,
    /// Its forces along a motion as sums of a few, for each choice of its nonlinear parameters; none where it is only simulated.
    pub(crate) spans: fn(&Hypothesis, &Seen) -> Vec<Span>,
}

/// What is known of a motion before any law is looked at along it.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    /// From the lowest to the highest position, m or rad.
    pub travel: f64,
    /// Magnitudes of the velocity, m/s or rad/s, in rising order.
    pub speeds: Vec<f64>,
    /// Sample time, s.
    pub period: f64,
}

impl Seen {
    /// The speed that is not exceeded for so large a share of the time, m/s or rad/s.
    pub fn speed(&self, share: f64) -> f64 {
        let at = (share * self.speeds.len().saturating_sub(1) as f64).round() as usize;
        self.speeds.get(at).copied().unwrap_or(0.0)
    }
}

/// Forces along a motion that a law can have with the same nonlinear parameters: sums of the forces of a few sets of its parameters, each times a factor.
#[derive(Debug, Clone)]
pub(crate) struct Span {
    /// Parameters whose forces span all of them.
    pub values: Vec<Vec<f64>>,
    /// The parameters with which the law has the sum of those forces, each times its factor.
    pub sum: fn(&[f64], &[Vec<f64>]) -> Vec<f64>,
}

impl Span {
    /// Of a law in proportion to its first parameter.
    pub fn proportional(values: Vec<f64>) -> Span {
        let sum = |factors: &[f64], values: &[Vec<f64>]| {
            let mut sum = values.first().cloned().unwrap_or_default();
            if let (Some(first), Some(factor)) = (sum.first_mut(), factors.first()) {
                *first *= factor;
            }
            sum
        };
        Span { values: vec![values], sum }
    }

    /// Of a law in proportion to all its parameters together, each of which has a force of its own.
    pub fn linear(values: Vec<Vec<f64>>) -> Span {
        let sum = |factors: &[f64], values: &[Vec<f64>]| {
            let of = |p: usize| factors.iter().zip(values).map(|(f, v)| f * v.get(p).copied().unwrap_or(0.0)).sum();
            (0..values.first().map_or(0, Vec::len)).map(of).collect()
        };
        Span { values, sum }
    }
}

impl Facts {
    /// No twin, no level of friction, no memory, no finer form, no special case.
    pub const NONE: Facts = Facts {
        proportional: false,
        twin: None,
        sliding: &[],
        from_level: &[],
        memory: false,
        holds: false,
        refine: |_, _, _| None,
        plausible: &[],
        contains: &[],
        fixed: 0,
        scanned: false,
        spans: |h, _| match (h.physics.facts.proportional, h.parameters.len(), h.starts.first()) {
            (true, 1, Some(start)) => vec![Span::proportional(start.clone())],
            _ => Vec::new(),
        },
    };
}

impl std::fmt::Debug for Physics {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}", self.name)
    }
}

impl PartialEq for Physics {
    fn eq(&self, other: &Physics) -> bool {
        self.name == other.name
    }
}

impl Physics {
    /// In which state it shows at a place (as places are written, `drum-ground` or a signal's name), in words.
    pub fn state_at(&self, place: &str) -> String {
        match (self.state, self.against) {
            (State::Reversals, _) => format!("reversals of the velocity across {place}"),
            (State::Contact, _) => format!("where the displacement across {place} makes or breaks contact"),
            (State::Large, _) => format!("large values of {place}"),
            (State::Periodic, _) => format!("periodically in the displacement across {place}"),
            (State::WithItsVariable, Against::Velocity) => format!("with the velocity across {place}"),
            (State::WithItsVariable, Against::Displacement) => format!("with the displacement across {place}"),
            (State::WithItsVariable, Against::Acceleration) => format!("with the acceleration across {place}"),
            (State::WithItsVariable, Against::Signal) => format!("with the value of {place}"),
            (State::WithItsVariable, Against::SignalRate) => format!("with the rate of change of {place}"),
            (State::WithItsVariable, Against::Time) => format!("all the time, at {place}"),
        }
    }
}

/// Where an effect acts.
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

/// A parameter that a hypothesis adds.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name in a verdict.
    pub key: String,
    /// Its unit in this model.
    pub unit: String,
    /// Where it stands in the edited model, as [`backdrive_plant::model::Model::values_at`] takes it. For `inertia` that holds the body's own as well.
    pub path: String,
    /// Its place in the list, where the path leads to one.
    pub index: Option<usize>,
    /// Smallest and largest value a fit may try.
    pub range: (f64, f64),
    /// Value at which it has no effect, which may be infinite; `None` where it does not matter once the others have none.
    pub neutral: Option<f64>,
    /// Whether a fit steps in its logarithm; the range is then above 0.
    pub log: bool,
    /// Whether it shifts a signal in time, so that differences by it take about a sample period.
    pub in_samples: bool,
}

/// An effect at a place.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Such as `coulomb@drum-ground`: unique among the hypotheses of a model.
    pub id: String,
    /// Which effect.
    pub physics: &'static Physics,
    /// Where it sits.
    pub place: Place,
    /// Names of the elements it takes the place of, first the one whose name it keeps.
    pub replaces: Vec<String>,
    /// What it adds.
    pub parameters: Vec<Parameter>,
    /// Where fits start, most plausible first: one value for each parameter.
    pub starts: Vec<Vec<f64>>,
    /// Path of a parameter that the model states and that does the same; nothing is gained where a fit has that one free.
    pub same_as: Option<String>,
    /// Equal for hypotheses that no recording can tell apart.
    pub class: String,
    pub(super) form: Form,
}

/// What a hypothesis does to a model.
#[derive(Debug, Clone)]
pub(super) enum Form {
    /// Adds an element, or replaces one.
    Element(ElementForm),
    /// Sets a key of an input or output.
    Key { path: String },
    /// Adds to a body's inertia.
    Inertia { body: String },
    /// Adds a body behind the elements of a joint, and a spring and a damper from it to the joint's other end.
    Series { joint: [String; 2], body: String, spring: String, damper: String },
    /// Hangs a free body on another by an element of this kind. The last parameter of the hypothesis is the body's inertia; the others are those of the
    /// kind, in the hypothesis' order.
    Hung { on: String, body: String, element: String, kind: &'static Kind },
}

#[derive(Debug, Clone)]
pub(super) struct ElementForm {
    pub name: String,
    pub between: [String; 2],
    /// Whether it takes the place of the element of that name, whose ends it then takes, too.
    pub in_place: bool,
    pub kind: &'static Kind,
    /// For each parameter of the kind: where its values come from.
    pub slots: Vec<Vec<Source>>,
    /// Brings values that contradict each other to the nearest ones that do not.
    pub tidy: fn(&mut [Vec<f64>]),
    /// Elements that go.
    pub removes: Vec<String>,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Source {
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
