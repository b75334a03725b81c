//! A nominal model with some effects added, and every parameter of it that a fit may move.

use crate::hypothesis::Hypothesis;
use crate::output_error::coupling::Coupling;
use crate::output_error::simulate::{Conditions, Curve, Start, derivatives_under, predict_under};
use crate::output_error::work::Budget;
use crate::recordings::observer::rescaled;
use crate::recordings::problem::{Problem, Record, Stated};
use crate::recordings::unknown::Unknown;
use crate::tuning::tuning;
use backdrive_plant::model::Model;
use backdrive_plant::set::{Condition, Initial};
use backdrive_plant::stepper::segments;
use std::borrow::Cow;

/// The role of a parameter in a fit.
#[derive(Debug, Clone, PartialEq)]
pub enum Role {
    /// A parameter that the nominal file states: its place among [`Problem::stated`].
    Stated(usize),
    /// A parameter of an added effect: which hypothesis, which of its parameters.
    Added(usize, usize),
    /// A parameter that differs in one record, or in those of a session: path, and the record or the first of them.
    Condition(String, usize),
    /// Position with which a body starts in a record, m.
    Position(usize, usize),
    /// Velocity with which a body starts in a record, m/s.
    Velocity(usize, usize),
    /// A weight of the curve of an input that nobody measured: which of [`Problem::unknown`], which weight, which record.
    Knot(usize, usize, usize),
}

impl Role {
    /// The same for another record, where it belongs to one.
    pub fn in_record(&self, record: usize) -> Role {
        match self {
            Role::Condition(path, _) => Role::Condition(path.clone(), record),
            Role::Position(body, _) => Role::Position(*body, record),
            Role::Velocity(body, _) => Role::Velocity(*body, record),
            Role::Knot(unknown, knot, _) => Role::Knot(*unknown, *knot, record),
            Role::Stated(_) | Role::Added(..) => self.clone(),
        }
    }
}

/// An end of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// The lower one.
    Low,
    /// The upper one.
    High,
}

/// A parameter that a fit may move.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeParameter {
    /// What it is.
    pub role: Role,
    /// Lowest and highest value, as it stands in the model.
    pub range: (f64, f64),
    /// Whether the fit steps in its logarithm.
    pub log: bool,
    /// Step for differences, in the fit's own unit (the logarithm where `log`).
    pub step: f64,
    /// Whether that step is as wide as it can be (a delay, over about a sample).
    pub coarse: bool,
    /// The records that alone depend on it; `None` where all do.
    pub records: Option<Vec<usize>>,
    /// What it would be without data, and how sure that is, in the fit's own unit: holds what the recordings say nothing of.
    pub prior: Option<(f64, f64)>,
    /// What a fit starts from where no other fit has a value.
    pub start: f64,
}

impl FreeParameter {
    /// From the value in the model to the fit's own unit.
    pub fn to_internal(&self, value: f64) -> f64 {
        let inside = value.clamp(self.range.0, self.range.1);
        if self.log { inside.max(f64::MIN_POSITIVE).ln() } else { inside }
    }

    /// Back.
    pub fn to_external(&self, own: f64) -> f64 {
        let value = if self.log { own.exp() } else { own };
        value.clamp(self.range.0, self.range.1)
    }

    /// The end of its range at which a value is, where it is at one.
    pub fn at_bound(&self, value: f64) -> Option<Bound> {
        let (low, high) = self.bounds();
        let (own, near) = (self.to_internal(value), tuning().fit.at_bound * (high - low));
        match () {
            () if own - low < near => Some(Bound::Low),
            () if high - own < near => Some(Bound::High),
            () => None,
        }
    }

    /// Whether a record depends on it.
    pub fn is_of(&self, record: usize) -> bool {
        self.records.as_ref().is_none_or(|of| of.contains(&record))
    }

    /// Bounds in the fit's own unit.
    pub fn bounds(&self) -> (f64, f64) {
        if self.log { (self.range.0.max(f64::MIN_POSITIVE).ln(), self.range.1.ln()) } else { self.range }
    }
}

/// How a structure is simulated.
#[derive(Clone, Copy)]
pub struct Along<'r> {
    /// Substeps per sample, at most.
    pub substeps: usize,
    /// A coupling along the records, if it is to be coupled to what was measured.
    pub coupling: Option<&'r Coupling>,
    /// Counts the work.
    pub budget: &'r Budget<'r>,
}

/// A model in a record, with what belongs to that record alone.
struct Own<'m> {
    model: Cow<'m, Model>,
    starts: Vec<Start>,
    curves: Vec<Curve>,
}

impl Own<'_> {
    fn conditions<'r>(&'r self, record: usize, along: Along<'r>) -> Conditions<'r> {
        let Along { substeps, coupling, budget } = along;
        Conditions { starts: &self.starts, curves: &self.curves, substeps, coupling: coupling.map(|g| (g, record)), budget }
    }
}

/// A nominal model with effects added.
#[derive(Debug, Clone)]
pub struct Structure {
    /// What is added, in the order in which it is applied.
    pub added: Vec<Hypothesis>,
    /// What a fit may move.
    pub free: Vec<FreeParameter>,
}

impl Structure {
    /// The nominal model with `added`. Parameters of elements that it replaces, and parameters that it stands for, are no longer free.
    pub fn new(problem: &Problem, records: &[Record], added: Vec<Hypothesis>) -> Structure {
        let mut free = Vec::new();
        for (index, stated) in problem.stated.iter().enumerate() {
            let element = stated.path.strip_prefix("elements.").and_then(|p| p.rsplit_once('.')).map(|p| p.0);
            let conditioned = |r: &Record| r.conditions.iter().any(|(path, c)| *path == stated.path && estimated(c));
            let replaced = added.iter().any(|h| element.is_some_and(|name| h.replaces.iter().any(|r| r == name)));
            let all_conditioned = !records.is_empty() && records.iter().all(conditioned);
            if replaced || all_conditioned {
                continue;
            }
            free.push(stated_number(index, stated));
        }
        for (h, hypothesis) in added.iter().enumerate() {
            for (p, parameter) in hypothesis.parameters.iter().enumerate() {
                let period = problem.fit.first().map_or(1e-3, |r| r.period);
                let width = (parameter.range.1 - parameter.range.0).abs();
                let size = hypothesis.starts.iter().filter_map(|s| s.get(p)).fold(0.0f64, |a, x| a.max(x.abs())).min(width);
                let step = match () {
                    () if parameter.in_samples => tuning().fit.difference_of_delay * period,
                    () if parameter.log => tuning().fit.difference,
                    () if size > 0.0 && size.is_finite() => tuning().fit.difference * size,
                    () => 1e-5 * width,
                };
                free.push(FreeParameter {
                    start: 0.0,
                    role: Role::Added(h, p),
                    range: parameter.range,
                    log: parameter.log,
                    step,
                    coarse: parameter.in_samples,
                    records: None,
                    prior: None,
                });
            }
        }
        for (r, record) in records.iter().enumerate() {
            for (path, condition) in &record.conditions {
                if !estimated(condition) {
                    continue;
                }
                // The first of a session has the parameter for all.
                let of = |other: &Record| other.conditions.iter().any(|(p, c)| p == path && c == condition);
                let session = |r: &usize| matches!(condition, Condition::Shared(_)) && records.get(*r).is_some_and(of);
                if (0..r).any(|before| session(&before)) {
                    continue;
                }
                let later = (r + 1..records.len()).filter(session);
                let given = problem.model.values_at(path).ok().and_then(|v| v.first().copied()).unwrap_or(0.0);
                let (range, log) = if given > 0.0 { ((given / 1e3, given * 1e3), true) } else { ((-1e6, 1e6), false) };
                let step = if log { tuning().fit.difference } else { 1e-6 };
                free.push(FreeParameter {
                    role: Role::Condition(path.clone(), r),
                    range,
                    log,
                    step,
                    coarse: false,
                    records: Some(std::iter::once(r).chain(later).collect()),
                    start: 0.0,
                    prior: None,
                });
            }
            if problem.initial == Initial::Free {
                free.extend(start_numbers(problem, record, r));
            }
            free.extend(knots(problem, record, r));
        }
        Structure { added, free }
    }

    /// Values to start from, in the units of the model: the stated parameters as given, and for each hypothesis the values given. What belongs to single
    /// records, such as the curve of a hand that nobody measured, is taken from another fit.
    pub fn values(&self, problem: &Problem, stated: &[f64], added: &[Vec<f64>], of_records: &[(Role, f64)]) -> Vec<f64> {
        let own = |role: &Role| of_records.iter().find(|(other, _)| other == role).map(|(_, value)| *value);
        let value = |number: &FreeParameter| match &number.role {
            Role::Stated(i) => stated.get(*i).copied().or_else(|| problem.stated.get(*i).map(|s| s.given)),
            Role::Added(h, p) => added.get(*h).and_then(|values| values.get(*p)).copied(),
            Role::Condition(path, _) => own(&number.role).or_else(|| problem.model.values_at(path).ok().and_then(|v| v.first().copied())),
            Role::Position(..) | Role::Velocity(..) | Role::Knot(..) => own(&number.role),
        };
        self.free.iter().map(|n| value(n).unwrap_or(n.start).clamp(n.range.0, n.range.1)).collect()
    }

    /// The parameters among `values` that belong to single records.
    pub fn of_records(&self, values: &[f64]) -> Vec<(Role, f64)> {
        let numbers = self.free.iter().zip(values).filter(|(n, _)| n.records.is_some());
        numbers.map(|(n, value)| (n.role.clone(), *value)).collect()
    }

    /// The stated parameters among `values`, in the order of [`Problem::stated`]; those that are not free as given.
    pub fn stated_of(&self, problem: &Problem, values: &[f64]) -> Vec<f64> {
        let mut all: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
        for (number, value) in self.free.iter().zip(values) {
            if let Role::Stated(i) = number.role {
                all[i] = *value;
            }
        }
        all
    }

    /// The parameters of each hypothesis among `values`.
    pub fn added_of(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = self.added.iter().map(|h| vec![0.0; h.parameters.len()]).collect();
        for (number, value) in self.free.iter().zip(values) {
            if let Role::Added(h, p) = number.role
                && let Some(slot) = all.get_mut(h).and_then(|v| v.get_mut(p))
            {
                *slot = *value;
            }
        }
        all
    }

    /// The model with these values; `None` where they contradict each other.
    pub fn model(&self, problem: &Problem, values: &[f64]) -> Option<Model> {
        let mut model = problem.model.clone();
        for (stated, value) in problem.stated.iter().zip(self.stated_of(problem, values)) {
            if value != stated.given {
                set(&mut model, &stated.path, stated.index, value)?;
            }
        }
        for (hypothesis, values) in self.added.iter().zip(self.added_of(values)) {
            model = hypothesis.apply(&model, &values).ok()?;
        }
        Some(rescaled(model, &problem.model))
    }

    /// Predictions of one of the records that the structure was made for, where it stands among them; see [`crate::output_error::simulate::predict`].
    pub fn predict(&self, problem: &Problem, model: &Model, values: &[f64], record: (&Record, usize), along: Along) -> Option<Vec<f64>> {
        let own = self.own_of(problem, model, values, record)?;
        predict_under(&own.model, record.0, &own.conditions(record.1, along))
    }

    /// Derivatives of the same predictions by parameters, each given by a model that differs in it alone and by how much; see
    /// [`crate::output_error::simulate::derivatives_under`].
    pub fn derivatives(
        &self,
        problem: &Problem,
        (model, moved): (&Model, &[(Model, f64)]),
        values: &[f64],
        record: (&Record, usize),
        along: Along,
    ) -> Option<Vec<Vec<f64>>> {
        let own = self.own_of(problem, model, values, record)?;
        let lane = |(m, step): &(Model, f64)| Some((self.own_of(problem, m, values, record)?.model.into_owned(), *step));
        let moved: Option<Vec<(Model, f64)>> = moved.iter().map(lane).collect();
        derivatives_under(&own.model, &moved?, record.0, &own.conditions(record.1, along))
    }

    /// What values give a record of its own.
    fn own_of<'m>(&self, problem: &Problem, model: &'m Model, values: &[f64], (record, index): (&Record, usize)) -> Option<Own<'m>> {
        let mut own = Own { model: Cow::Borrowed(model), starts: Vec::new(), curves: Vec::new() };
        for (number, value) in self.free.iter().zip(values).filter(|(n, _)| n.records.is_some() && n.is_of(index)) {
            match &number.role {
                Role::Condition(path, _) => own.model.to_mut().set_values_at(path, &[*value]).ok()?,
                Role::Position(..) | Role::Velocity(..) | Role::Stated(_) | Role::Added(..) | Role::Knot(..) => {}
            }
        }
        own.starts = self.starts(values, index);
        let curve =
            |(u, unknown): (usize, &Unknown)| (unknown.input, unknown.curve(&self.weights(values, u, index).collect::<Vec<_>>(), record));
        own.curves = problem.unknown.iter().enumerate().map(curve).collect();
        Some(own)
    }

    /// How bodies begin in a record whose start is free, by these values.
    fn starts(&self, values: &[f64], record: usize) -> Vec<Start> {
        let mut starts: Vec<Start> = Vec::new();
        for (number, value) in self.free.iter().zip(values).filter(|(n, _)| n.records.is_some() && n.is_of(record)) {
            match number.role {
                Role::Position(body, _) => starts.push((body, *value, 0.0)),
                Role::Velocity(body, _) => match starts.iter_mut().find(|s| s.0 == body) {
                    Some(start) => start.2 = *value,
                    None => starts.push((body, 0.0, *value)),
                },
                Role::Condition(..) | Role::Stated(_) | Role::Added(..) | Role::Knot(..) => {}
            }
        }
        starts
    }

    /// Records with the starts that values give them, and the curves of inputs which nobody measured.
    pub fn with_unknown(&self, problem: &Problem, records: &[Record], values: &[f64]) -> Vec<Record> {
        let mut seen = records.to_vec();
        for (r, record) in seen.iter_mut().enumerate() {
            let starts = self.starts(values, r);
            if !starts.is_empty() {
                record.begins = starts;
            }
            for (index, unknown) in problem.unknown.iter().enumerate() {
                let weights: Vec<f64> = self.weights(values, index, r).collect();
                let samples = unknown.curve(&weights, record);
                let Some(input) = problem.model.inputs.get(unknown.input) else { continue };
                record.segments[unknown.input] = segments(input.hold, &samples, record.period);
                record.inputs[unknown.input] = samples;
            }
        }
        seen
    }

    /// Weights of an unknown input in a record, in order.
    fn weights<'a>(&'a self, values: &'a [f64], unknown: usize, record: usize) -> impl Iterator<Item = f64> + 'a {
        let here = move |n: &FreeParameter| matches!(n.role, Role::Knot(u, _, r) if u == unknown && r == record);
        self.free.iter().zip(values).filter(move |(n, _)| here(n)).map(|(_, value)| *value)
    }

    /// What the structure adds, such as `coulomb@drum-ground`; `nominal` where it adds nothing.
    pub fn name(&self) -> String {
        if self.added.is_empty() {
            return "nominal".to_string();
        }
        self.added.iter().map(|h| h.id.as_str()).collect::<Vec<_>>().join(" + ")
    }
}

/// Whether a parameter with this condition is estimated.
fn estimated(condition: &Condition) -> bool {
    matches!(condition, Condition::Free | Condition::Shared(_))
}

fn stated_number(index: usize, stated: &Stated) -> FreeParameter {
    let (range, log) = (stated.range, stated.log);
    let centre = if log { stated.given.ln() } else { stated.given };
    let spread = if log { tuning().fit.prior } else { 2.0 * stated.given.abs() };
    let step = if log { tuning().fit.difference } else { tuning().fit.difference * stated.given.abs() };
    FreeParameter { role: Role::Stated(index), range, log, step, coarse: false, records: None, prior: Some((centre, spread)), start: 0.0 }
}

/// The weights of the unknown inputs in a record.
fn knots<'a>(problem: &'a Problem, record: &'a Record, r: usize) -> impl Iterator<Item = FreeParameter> + 'a {
    problem.unknown.iter().enumerate().flat_map(move |(index, unknown)| {
        let size = unknown.scale(&problem.model, &problem.fit);
        (0..unknown.knots(record)).map(move |k| FreeParameter {
            role: Role::Knot(index, k, r),
            range: (-tuning().fit.unknown_range * size, tuning().fit.unknown_range * size),
            log: false,
            step: tuning().fit.difference * size,
            coarse: false,
            records: Some(vec![r]),
            start: 0.0,
            prior: Some((0.0, 0.01 * tuning().fit.unknown_range * size)),
        })
    })
}

/// Positions and velocities of the free bodies at a record's start, in the range of what the record shows.
fn start_numbers(problem: &Problem, record: &Record, r: usize) -> Vec<FreeParameter> {
    use backdrive_plant::model::{InputKind, OutputKind};
    let model = &problem.model;
    let mut size: f64 = 0.0;
    for (output, spread) in model.outputs.iter().zip(&record.spread) {
        if matches!(output.kind, OutputKind::Position(_)) {
            size = size.max(*spread);
        }
    }
    for (input, samples) in model.inputs.iter().zip(&record.inputs).filter(|(i, _)| i.kind == InputKind::Motion) {
        size = samples.iter().fold(size, |a, x| a.max((input.gain * x).abs()));
    }
    let size = if size > 0.0 { size } else { 1.0 };
    let free = (0..model.bodies.len()).filter(|b| !model.inputs.iter().any(|i| i.kind == InputKind::Motion && i.on == *b));
    free.flat_map(|body| {
        let [position, velocity] = measured_start(model, record, body).map_or([0.0; 2], |start| start);
        let number = |role, width: f64, start: f64| FreeParameter {
            start,
            role,
            range: (-width, width),
            log: false,
            step: 1e-5 * width,
            coarse: false,
            records: Some(vec![r]),
            prior: Some((0.0, tuning().fit.start_prior * width)),
        };
        let speed = size / (tuning().fit.start_range * record.period);
        [number(Role::Position(body, r), tuning().fit.start_range * size, position), number(Role::Velocity(body, r), speed, velocity)]
    })
    .collect()
}

/// Position and velocity with which a body begins, by a parabola through the first samples of its position; `None` where that was not recorded.
fn measured_start(model: &Model, record: &Record, body: usize) -> Option<[f64; 2]> {
    use backdrive_plant::model::OutputKind;
    let (output, samples) = model.outputs.iter().zip(&record.outputs).find_map(|(output, samples)| match output.kind {
        OutputKind::Position(own) if own == body && output.gain != 0.0 => Some((output, samples.as_deref()?)),
        _ => None,
    })?;
    let first = samples.get(..tuning().fit.start_samples.min(samples.len()))?;
    let time = |i: usize| i as f64 * record.period;
    let regressor = nalgebra::DMatrix::from_fn(first.len(), 3, |i, power| time(i).powi(power as i32));
    let measured = nalgebra::DVector::from_iterator(first.len(), first.iter().map(|y| (y - output.offset) / output.gain));
    let found = regressor.svd(true, true).solve(&measured, 0.0).ok()?;
    Some([found[0], found[1]]).filter(|start| start.iter().all(|x| x.is_finite()))
}

fn set(model: &mut Model, path: &str, index: usize, value: f64) -> Option<()> {
    let mut values = model.values_at(path).ok()?;
    *values.get_mut(index)? = value;
    model.set_values_at(path, &values).ok()
}
