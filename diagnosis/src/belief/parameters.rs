//! The parameters of a fit beside those that the file gives: how far each had to move, how sure it is, and which are correlated.

use crate::belief::intervals::Uncertainty;
use crate::output_error::candidate::Candidate;
use crate::output_error::structure::Role;
use crate::recordings::problem::Problem;
use crate::tuning::tuning;
use backdrive_plant::describe::unit_for;
use backdrive_plant::model::{InputKind, OutputKind};
use backdrive_plant::write::{Edit, PatchError, Value, patch, round_significant};
use serde::Serialize;

/// A parameter of a fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Path in the model, such as `elements.cable.stiffness`; of an added effect its id and key; of a record's start what starts where.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The value in the file; `None` where the file has none.
    pub given: Option<f64>,
    /// As fitted.
    pub value: f64,
    /// Standard error, in the parameter's unit; not finite where the recordings do not determine it.
    pub standard_error: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// How far it moved from the file's value, in its own standard deviations.
    pub moved_sd: Option<f64>,
    /// Whether the recordings say more of it than what was assumed before.
    pub determined: bool,
    /// Whether it ended at a bound of the range that a fit may try.
    pub at_bound: bool,
}

/// Two parameters that are correlated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pair {
    /// One.
    pub first: String,
    /// The other.
    pub second: String,
    /// From -1 to 1.
    pub correlation: f64,
}

/// Every parameter of a fit.
pub fn rows(problem: &Problem, candidate: &Candidate, spread: &Uncertainty) -> Vec<Row> {
    // The weights of a curve that nobody measured are no parameters of the device.
    let numbers = candidate.structure.free.iter().zip(&candidate.fit.values).enumerate();
    let numbers = numbers.filter(|(_, (number, _))| !matches!(number.role, Role::Knot(..)));
    let row = |(index, (number, value)): (usize, (&crate::output_error::structure::FreeParameter, &f64))| {
        let given = match &number.role {
            Role::Stated(i) => problem.stated.get(*i).map(|s| s.given),
            _ => None,
        };
        let deviation = spread.deviation.get(index).copied().unwrap_or(f64::INFINITY);
        let (low, high) = number.bounds();
        let own = number.to_internal(*value);
        let edge = tuning().fit.at_bound * (high - low);
        let sure = match (number.log, given) {
            (true, _) => deviation < tuning().claim.undetermined,
            (false, Some(given)) => deviation < tuning().claim.undetermined * given.abs().max(value.abs()),
            (false, None) => deviation < tuning().claim.undetermined_range * (high - low),
        };
        Row {
            name: name_of(problem, candidate, index),
            unit: unit_of(problem, candidate, index),
            given,
            value: *value,
            standard_error: if number.log { deviation * value.abs() } else { deviation },
            ci95: spread.interval(candidate, index),
            moved_sd: given.map(|given| (own - number.to_internal(given)) / deviation),
            determined: sure,
            at_bound: own <= low + edge || own >= high - edge,
        }
    };
    numbers.map(row).collect()
}

/// Pairs of parameters whose correlation is at least `least` in size, the strongest first.
pub fn correlated(problem: &Problem, candidate: &Candidate, spread: &Uncertainty, least: f64) -> Vec<Pair> {
    let n = spread.correlation.nrows().min(candidate.structure.free.len());
    let mut all = Vec::new();
    for a in 0..n {
        for b in 0..a {
            let correlation = spread.correlation[(a, b)];
            if correlation.abs() >= least {
                let (first, second) = (name_of(problem, candidate, b), name_of(problem, candidate, a));
                all.push(Pair { first, second, correlation });
            }
        }
    }
    all.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    all
}

/// Name of a parameter of a fit, as [`Row::name`].
pub fn name_of(problem: &Problem, candidate: &Candidate, index: usize) -> String {
    let Some(number) = candidate.structure.free.get(index) else { return String::new() };
    let record = |r: usize| problem.fit.get(r).map_or("?", |r| r.name.as_str());
    let body = |b: usize| problem.model.bodies.get(b).map_or("?", |b| b.name.as_str());
    match &number.role {
        Role::Stated(i) => {
            let Some(stated) = problem.stated.get(*i) else { return String::new() };
            let list = problem.stated.iter().filter(|s| s.path == stated.path).count() > 1;
            if list { format!("{}[{}]", stated.path, stated.index) } else { stated.path.clone() }
        }
        Role::Added(h, p) => {
            let Some(hypothesis) = candidate.structure.added.get(*h) else { return String::new() };
            let Some(parameter) = hypothesis.parameters.get(*p) else { return String::new() };
            let at = parameter.index.map_or(String::new(), |i| format!("[{i}]"));
            format!("{}: {}{at}", hypothesis.id, parameter.key)
        }
        Role::Condition(path, r) => format!("{path} in {}", record(*r)),
        Role::Position(b, r) => format!("start of {} in {}", body(*b), record(*r)),
        Role::Velocity(b, r) => format!("start speed of {} in {}", body(*b), record(*r)),
        Role::Knot(u, k, r) => {
            let input = problem.unknown.get(*u).and_then(|u| problem.model.inputs.get(u.input)).map_or("?", |i| i.name.as_str());
            format!("{input}, weight {k}, in {}", record(*r))
        }
    }
}

fn unit_of(problem: &Problem, candidate: &Candidate, index: usize) -> String {
    let motion = problem.model.motion;
    let of_path = |path: &str| unit_of_path(problem, path);
    match candidate.structure.free.get(index).map(|n| &n.role) {
        Some(Role::Stated(i)) => problem.stated.get(*i).map_or(String::new(), |s| of_path(&s.path)),
        Some(Role::Added(h, p)) => {
            let parameter = candidate.structure.added.get(*h).and_then(|h| h.parameters.get(*p));
            parameter.map_or(String::new(), |p| p.unit.clone())
        }
        Some(Role::Condition(path, _)) => of_path(path),
        Some(Role::Position(..)) => unit_for(motion, "m"),
        Some(Role::Velocity(..)) => unit_for(motion, "m/s"),
        Some(Role::Knot(u, ..)) => {
            let input = problem.unknown.get(*u).and_then(|u| problem.model.inputs.get(u.input));
            unit_for(motion, input.map_or(InputKind::Force, |i| i.kind).unit())
        }
        None => String::new(),
    }
}

/// Unit of a parameter of the model by its path; empty where it has none.
fn unit_of_path(problem: &Problem, path: &str) -> String {
    problem.model.unit_at(path).ok().filter(|unit| unit != "-").unwrap_or_default()
}

/// Unit of what an output measures, such as `m` or `rad/s`.
pub fn unit_of_output(problem: &Problem, kind: &OutputKind) -> String {
    unit_for(problem.model.motion, kind.unit())
}

/// Edits that put the stated parameters as fitted into the nominal model's text; comments say what was given and the 95 % interval, or that
/// the recordings do not determine it.
pub fn stated_edits(problem: &Problem, candidate: &Candidate, spread: &Uncertainty) -> Vec<Edit> {
    let rows = rows(problem, candidate, spread);
    let mut edits = Vec::new();
    let mut done: Vec<&str> = Vec::new();
    for stated in &problem.stated {
        if done.contains(&stated.path.as_str()) {
            continue;
        }
        done.push(&stated.path);
        let Ok(mut list) = problem.model.values_at(&stated.path) else { continue };
        let before = list.clone();
        let mut said = Vec::new();
        for (number, row) in candidate.structure.free.iter().zip(&rows) {
            let Role::Stated(i) = number.role else { continue };
            let Some(own) = problem.stated.get(i).filter(|s| s.path == stated.path) else { continue };
            if let Some(slot) = list.get_mut(own.index) {
                *slot = round_significant(row.value, 7);
                let [low, high] = row.ci95.map(|x| round_significant(x, 4));
                said.push(match row.determined {
                    true => format!("was {}, 95 %: {low} to {high}", own.given),
                    false => format!("was {}, not determined by the recordings", own.given),
                });
            }
        }
        if said.is_empty() || list == before {
            continue;
        }
        let value = match list.as_slice() {
            [one] => Value::Number(*one),
            _ => Value::Numbers(list),
        };
        edits.push(Edit::Set { path: stated.path.clone(), value, comment: Some(said.join("; ")) });
    }
    edits
}

/// The nominal model's text with the stated parameters as fitted.
///
/// # Errors
/// When the text cannot be edited.
pub fn refitted_text(problem: &Problem, candidate: &Candidate, spread: &Uncertainty) -> Result<String, PatchError> {
    patch(&problem.text, &stated_edits(problem, candidate, spread))
}
