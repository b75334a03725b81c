//! Evidence of a finding: the force that the recordings require at its place when the model lacks it, beside the force of its law.

use crate::hypothesis::{Against, Hypothesis, Place};
use crate::locate::{self, Course, force_along, locate};
use crate::output_error::candidate::Candidate;
use crate::output_error::structure::Structure;
use crate::recordings::problem::{Problem, Record};
use crate::tuning::tuning;
use backdrive_plant::describe::unit_for;
use backdrive_plant::model::{Element, Input, InputKind, Model, Output, OutputKind};
use backdrive_plant::set::Condition;
use backdrive_plant::stepper::{Options, simulate};
use backdrive_signal::derivative;

/// Two curves over one variable.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Time, s.
    pub time: Vec<f64>,
    /// The law's own variable.
    pub variable: Vec<f64>,
    /// Displacement across the place; empty at a signal.
    pub displacement: Vec<f64>,
    /// Force, or the signal's error.
    pub force: Vec<f64>,
}

/// One record.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The record.
    pub record: String,
    /// As estimated from the recordings.
    pub latent: Curve,
    /// Its standard deviation.
    pub deviation: Vec<f64>,
    /// As the law has it in the diagnosed model, simulated.
    pub law: Curve,
}

/// The force that the recordings require at the place of a finding, and the force of its law there.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// The finding's id.
    pub id: String,
    /// Its place.
    pub place: Place,
    /// What its law depends on.
    pub against: Against,
    /// Unit of that variable.
    pub variable_unit: String,
    /// Unit of displacements.
    pub displacement_unit: String,
    /// Unit of the force, or of the signal.
    pub force_unit: String,
    /// Whether the law has a memory, so that its curve is a loop.
    pub memory: bool,
    /// Elements that the law takes the place of: their force is in both curves.
    pub replaces: Vec<String>,
    /// One for each record.
    pub traces: Vec<Trace>,
}

/// Evidence of one of the effects that a candidate adds; `None` where nothing can be located there. `noise_sd` is the noise standard deviation of each
/// output, in its unit.
pub fn evidence(problem: &Problem, best: &Candidate, noise_sd: &[f64], which: usize) -> Option<Evidence> {
    let finding = best.structure.added.get(which)?;
    let values = &best.fit.values;
    let rest = |i: &usize| *i != which;
    let all = best.structure.added_of(values);
    let others: Vec<Hypothesis> = (0..all.len()).filter(rest).filter_map(|i| best.structure.added.get(i).cloned()).collect();
    let other_values: Vec<Vec<f64>> = (0..all.len()).filter(rest).filter_map(|i| all.get(i).cloned()).collect();
    let structure = Structure::new(problem, &problem.fit, others);
    let without = structure.model(problem, &structure.values(problem, &best.structure.stated_of(problem, values), &other_values, &[]))?;
    let with = best.structure.model(problem, values)?;

    let records = best.structure.with_unknown(problem, &problem.fit, values);
    let changed: Vec<Model> = records.iter().map(|r| under(&without, r)).collect();
    let runs: Vec<locate::Run> =
        records.iter().zip(&changed).map(|(r, m)| locate::Run { model: Some(m), ..locate::Run::from(r) }).collect();
    let options = locate::Options { most_samples: tuning().locate.samples, only: Some(finding.place.clone()), ..locate::Options::quick() };
    let location = locate(&without, &runs, noise_sd, &options).ok()?;
    let found = location.ranking.into_iter().find(|c| c.place.same(&finding.place))?;
    let against = finding.physics.against;
    let scene = Scene { without: &without, with: &with, finding, place: &found.place, against };
    let traces = records.iter().zip(&found.courses).filter_map(|(record, course)| scene.trace(record, course)).collect();
    let (variable_unit, displacement_unit, force_unit) = scene.units(problem);
    Some(Evidence {
        id: finding.id.clone(),
        place: found.place.clone(),
        against,
        variable_unit,
        displacement_unit,
        force_unit,
        memory: finding.physics.facts.memory,
        replaces: finding.replaces.clone(),
        traces,
    })
}

/// The model with the parameters that are known to differ in a record.
fn under(model: &Model, record: &Record) -> Model {
    let mut model = model.clone();
    for (path, condition) in &record.conditions {
        if let Condition::Value(value) = condition {
            // A path that the added effect replaced has no value to take.
            let _ = model.set_values_at(path, &[*value]);
        }
    }
    model
}

struct Scene<'a> {
    without: &'a Model,
    with: &'a Model,
    finding: &'a Hypothesis,
    place: &'a Place,
    against: Against,
}

impl Scene<'_> {
    fn body(&self, model: &Model, name: &str) -> Option<usize> {
        model.bodies.iter().position(|b| b.name == name)
    }

    fn input(&self) -> Option<(usize, &Input, &Input)> {
        let Place::Signal(name) = self.place else { return None };
        let index = self.with.inputs.iter().position(|i| i.name == *name)?;
        Some((index, self.without.inputs.get(index)?, self.with.inputs.get(index)?))
    }

    fn units(&self, problem: &Problem) -> (String, String, String) {
        let unit = |u: &str| unit_for(problem.model.motion, u);
        let force = match (self.place, self.input()) {
            (Place::Between(..), _) => unit("N"),
            (_, Some((_, input, _))) => unit(input.kind.unit()),
            (Place::Signal(name), None) => {
                let output = problem.model.outputs.iter().find(|o| o.name == *name);
                output.map_or(String::new(), |o| unit(o.kind.unit()))
            }
        };
        let variable = match self.against {
            Against::Velocity => unit("m/s"),
            Against::Displacement => unit("m"),
            Against::Acceleration => unit("m/s²"),
            Against::Signal => force.clone(),
            Against::SignalRate => format!("{force}/s"),
            Against::Time => "s".to_string(),
        };
        (variable, unit("m"), force)
    }

    fn trace(&self, record: &Record, course: &Course) -> Option<Trace> {
        let stride = ((course.period / record.period).round() as usize).max(1);
        let thin = |x: &[f64]| -> Vec<f64> { x.iter().step_by(stride).copied().collect() };
        let time: Vec<f64> = (0..course.force.len()).map(|k| k as f64 * course.period).collect();
        let signal = match (self.place, self.input()) {
            (_, Some((index, ..))) => thin(record.inputs.get(index)?),
            (Place::Signal(name), None) => {
                let output = self.with.outputs.iter().position(|o| o.name == *name)?;
                thin(record.outputs.get(output)?.as_deref()?)
            }
            _ => Vec::new(),
        };
        let variable = |velocity: &[f64], displacement: &[f64]| -> Vec<f64> {
            match self.against {
                Against::Velocity => velocity.to_vec(),
                Against::Displacement => displacement.to_vec(),
                Against::Acceleration => derivative(velocity, course.period),
                Against::Signal => signal.clone(),
                Against::SignalRate => derivative(&signal, course.period),
                Against::Time => time.clone(),
            }
        };
        // At a force input the error of the input pushes, where an element's force holds back.
        let turned = matches!(self.input(), Some((_, input, _)) if input.kind == InputKind::Force);
        let mut force: Vec<f64> = if turned { course.force.iter().map(|f| -f).collect() } else { course.force.clone() };
        for (element, sign) in self.removed() {
            let (x, v): (Vec<f64>, Vec<f64>) = course.displacement.iter().zip(&course.velocity).map(|(x, v)| (sign * x, sign * v)).unzip();
            for (f, own) in force.iter_mut().zip(force_along(&element.law, &x, &v, course.period)) {
                *f += sign * own;
            }
        }
        let latent = Curve {
            time: time.clone(),
            variable: variable(&course.velocity, &course.displacement),
            displacement: if matches!(self.place, Place::Between(..)) { course.displacement.clone() } else { Vec::new() },
            force,
        };
        let (displacement, velocity, law) = match self.place {
            Place::Between(a, b) => self.law_between(record, a, b)?,
            Place::Signal(_) => (Vec::new(), Vec::new(), self.law_at_signal(record)?),
        };
        let (displacement, velocity, law) = (thin(&displacement), thin(&velocity), thin(&law));
        let velocity = if velocity.is_empty() { course.velocity.clone() } else { velocity };
        let variable = variable(&velocity, &displacement);
        let law = Curve { time, variable, displacement, force: law };
        Some(Trace { record: record.name.clone(), latent, deviation: course.deviation.clone(), law })
    }

    /// Elements that the finding takes the place of, with the sign of their direction.
    fn removed(&self) -> Vec<(&Element, f64)> {
        let Place::Between(a, _) = self.place else { return Vec::new() };
        let first = self.body(self.without, a);
        let replaced = self.without.elements.iter().filter(|e| self.finding.replaces.contains(&e.name));
        // A joint that is split keeps its elements, which then act in a row with the new ones.
        let split = self.finding.splits_joint();
        let joint = self.without.elements.iter().filter(move |e| split && self.is_here(e));
        replaced.chain(joint).map(|e| (e, if e.between[0] == first { 1.0 } else { -1.0 })).collect()
    }

    fn is_here(&self, element: &Element) -> bool {
        let name = |end: Option<usize>| self.without.place_name(end).to_string();
        Place::Between(name(element.between[0]), name(element.between[1])).same(self.place)
    }

    /// Displacement, velocity and force of what the finding added, as it moves in the diagnosed model.
    fn law_between(&self, record: &Record, a: &str, b: &str) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
        let mut probe = under(self.with, record);
        let asked = probe.outputs.len();
        let ends = [a, b].map(|name| self.body(self.with, name));
        for body in ends.into_iter().flatten() {
            probe.outputs.push(plain(OutputKind::Position(body)));
            probe.outputs.push(plain(OutputKind::Velocity(body)));
            probe.outputs.push(plain(OutputKind::Acceleration(body)));
        }
        let before = |e: &Element| self.without.elements.iter().any(|o| o.name == e.name && o.law == e.law);
        let added: Vec<usize> = (0..probe.elements.len()).filter(|i| !before(&self.with.elements[*i])).collect();
        for index in &added {
            probe.outputs.push(plain(OutputKind::Force(vec![*index])));
        }
        let columns = simulate(&probe, &record.inputs, record.period, &Options::default()).ok()?;
        let mut columns = columns.into_iter().skip(asked);
        let mut across = vec![vec![0.0; record.len]; 3];
        for (end, sign) in ends.iter().zip([1.0, -1.0]) {
            if end.is_some() {
                for column in &mut across {
                    let own = columns.next()?;
                    column.iter_mut().zip(own).for_each(|(x, own)| *x += sign * own);
                }
            }
        }
        let mut force = vec![0.0; record.len];
        if self.finding.adds_inertia() {
            let inertia = |m: &Model| ends[0].or(ends[1]).and_then(|b| m.bodies.get(b)).map_or(0.0, |b| b.inertia);
            let more = inertia(self.with) - inertia(self.without);
            force.iter_mut().zip(&across[2]).for_each(|(f, a)| *f = more * a);
        }
        for (index, column) in added.iter().zip(columns) {
            let element = &self.with.elements[*index];
            // What an added body is held by pulls the joint's second end, what holds it the first.
            let sign = if element.between[0] == ends[0] && ends[0].is_some() || element.between[1] == ends[1] { 1.0 } else { -1.0 };
            force.iter_mut().zip(column).for_each(|(f, own)| *f += sign * own);
        }
        let [x, v, _] = <[Vec<f64>; 3]>::try_from(across).ok()?;
        Some((x, v, force))
    }

    /// What a finding at a signal makes of it: the difference to the signal without the finding.
    fn law_at_signal(&self, record: &Record) -> Option<Vec<f64>> {
        let run = |model: &Model| simulate(&under(model, record), &record.inputs, record.period, &Options::default()).ok();
        let Some((index, before, after)) = self.input() else {
            let Place::Signal(name) = self.place else { return None };
            let output = self.with.outputs.iter().position(|o| o.name == *name)?;
            let (a, b) = (run(self.without)?, run(self.with)?);
            return Some(b.get(output)?.iter().zip(a.get(output)?).map(|(b, a)| b - a).collect());
        };
        let samples = record.inputs.get(index)?;
        let mut error: Vec<f64> =
            arriving(after, samples, record.period).iter().zip(arriving(before, samples, record.period)).map(|(b, a)| b - a).collect();
        let lost = after.back_emf - before.back_emf;
        if lost != 0.0 {
            let mut probe = under(self.with, record);
            probe.outputs = vec![plain(OutputKind::Velocity(after.on))];
            let columns = simulate(&probe, &record.inputs, record.period, &Options::default()).ok()?;
            error.iter_mut().zip(columns.first()?).for_each(|(e, v)| *e -= lost * v);
        }
        Some(error)
    }
}

/// A command behind gain, saturation, delay and lag, at the samples.
fn arriving(input: &Input, samples: &[f64], period: f64) -> Vec<f64> {
    let late = input.delay / period;
    let keep = if input.bandwidth.is_finite() { (-std::f64::consts::TAU * input.bandwidth * period).exp() } else { 0.0 };
    let at = |place: f64| -> f64 {
        let place = place.clamp(0.0, samples.len().saturating_sub(1) as f64);
        let (k, part) = (place.floor() as usize, place.fract());
        let of = |k: usize| samples.get(k).copied().unwrap_or(0.0);
        let value = if part > 0.0 { of(k) + part * (of(k + 1) - of(k)) } else { of(k) };
        (input.gain * value).clamp(-input.saturation, input.saturation)
    };
    let mut state = at(0.0);
    (0..samples.len())
        .map(|k| {
            let now = at(k as f64 - late);
            state = keep * state + (1.0 - keep) * now;
            state
        })
        .collect()
}

/// An output that adds nothing of its own.
fn plain(kind: OutputKind) -> Output {
    Output { name: String::new(), kind, gain: 1.0, delay: 0.0, offset: 0.0, resolution: 0.0, noise: 0.0 }
}
