//! What the recordings themselves say, before any physics: their clock, their sensors, and what that limits.

mod rates;
mod signals;
mod units;

pub use rates::rates;

use crate::problem::{Problem, Record};
use backdrive_plant::model::{InputKind, OutputKind};
use backdrive_plant::set::Initial;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use signals::{answers, clipped_share, is_constant, off_grid, quiet_top};

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Weight {
    /// Good to know.
    Note,
    /// Limits what can be claimed.
    Caution,
    /// Nothing can be claimed of this signal.
    Unusable,
}

/// A finding about recordings or one of their signals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remark {
    /// How much it matters.
    pub weight: Weight,
    /// The recordings, by file name; empty where it is about all of them.
    pub records: Vec<String>,
    /// The signal; empty where it is about the clock.
    pub signal: String,
    /// What was looked at: `clock`, `gaps`, `missing`, `constant`, `encoder`, `filtered`, `saturated`, `sign`, `unit`, `loop`, `repeats`, `noise`.
    pub about: &'static str,
    /// One clause; of several recordings that of the first.
    pub text: String,
}

impl Remark {
    /// Where it is: files, signal, or `all recordings`.
    pub fn place(&self) -> String {
        let files = match self.records.as_slice() {
            [] if self.signal.is_empty() => "all recordings".to_string(),
            [] => String::new(),
            [one] => one.clone(),
            [one, two] => format!("{one} and {two}"),
            [one, rest @ ..] => format!("{one} and {} more", rest.len()),
        };
        match (files.is_empty(), self.signal.is_empty()) {
            (true, _) => self.signal.clone(),
            (false, true) => files,
            (false, false) => format!("{} in {files}", self.signal),
        }
    }
}

impl std::fmt::Display for Remark {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}: {}", self.place(), self.text)
    }
}

/// Distance from the even grid, in sample periods, above which a clock is called uneven.
const JITTER: f64 = 0.05;
/// Share of samples at a signal's two extremes above which it looks clipped.
const CLIPPED: f64 = 0.02;
/// Correlation of a command's noise with a sensor's above which a controller closes the loop.
const CLOSED: f64 = 0.5;

/// Looks at every recording of a problem, those held out included: nothing here fits anything. What matters most comes first; what is the
/// same in several recordings is said once.
pub fn audit(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    for record in problem.fit.iter().chain(&problem.held_out) {
        clock(record, &mut all);
        for (index, (input, samples)) in problem.model.inputs.iter().zip(&record.inputs).enumerate() {
            if problem.unknown.iter().any(|u| u.input == index) {
                continue;
            }
            constant(record, &input.name, samples, &mut all);
            if input.kind == InputKind::Force {
                clipped(record, &input.name, samples, "its source may be limited", &mut all);
            }
        }
        for (output, samples) in problem.model.outputs.iter().zip(&record.outputs) {
            match samples {
                None => add(&mut all, Weight::Caution, record, &output.name, "missing", "was not recorded".to_string()),
                Some(samples) => {
                    constant(record, &output.name, samples, &mut all);
                    sensor(record, &output.name, output.resolution, samples, &mut all);
                    if !matches!(output.kind, OutputKind::Position(_)) {
                        clipped(record, &output.name, samples, "its sensor may be at the end of its range", &mut all);
                    }
                }
            }
        }
    }
    closed_loop(problem, &mut all);
    let mut all = merged(all, problem.fit.len() + problem.held_out.len());
    all.extend(repeats(problem));
    all.extend(units::remarks(problem));
    all.extend(noises(problem));
    all.sort_by_key(|r| std::cmp::Reverse(r.weight));
    all
}

/// Whether there is anything to fit: a sentence says what is wrong and what to do where there is not.
///
/// # Errors
/// When nothing drives the device, nothing that was measured moves, or a unit, that of time among them, is off by so much that no fit can be meant.
pub fn usable(problem: &Problem) -> Result<(), String> {
    let model = &problem.model;
    let file = |r: &Record| file_name(&r.name).to_string();
    let first = problem.fit.first().map_or(String::new(), file);
    let still = |input: usize| {
        let force = model.inputs.get(input).is_some_and(|i| i.kind == InputKind::Force);
        let quiet = |samples: &Vec<f64>| is_constant(samples) && (!force || samples.first().is_none_or(|x| *x == 0.0));
        problem.fit.iter().all(|r| r.inputs.get(input).is_none_or(quiet))
    };
    if problem.initial == Initial::Rest && !model.inputs.is_empty() && (0..model.inputs.len()).all(still) {
        let names: Vec<&str> = model.inputs.iter().map(|i| i.name.as_str()).collect();
        let them = names.join(", ");
        return Err(format!("{first}: nothing drives the device: {them} is constant in every recording; record an excitation"));
    }
    let moves =
        |output: usize| problem.fit.iter().any(|r| r.outputs.get(output).is_some_and(|o| o.as_deref().is_some_and(|s| !is_constant(s))));
    if !(0..model.outputs.len()).any(moves) {
        let names: Vec<&str> = model.outputs.iter().map(|o| o.name.as_str()).collect();
        let them = names.join(", ");
        return Err(format!("{first}: {them} is constant in every recording: the sensor is dead, or the column is another one"));
    }
    if let Some(text) = rates::unit_of_time(problem) {
        return Err(text);
    }
    match units::remarks(problem).into_iter().find(|r| r.weight == Weight::Unusable) {
        Some(remark) => Err(format!("{first}: {remark}")),
        None => Ok(()),
    }
}

fn add(all: &mut Vec<Remark>, weight: Weight, record: &Record, signal: &str, about: &'static str, text: String) {
    all.push(Remark { weight, records: vec![file_name(&record.name).to_string()], signal: signal.to_string(), about, text });
}

/// The last part of a path.
pub(crate) fn file_name(path: &str) -> &str {
    path.rsplit('/').find(|part| !part.is_empty()).unwrap_or(path)
}

/// What is the same in several recordings, said once; in all of `count`, without their names.
fn merged(all: Vec<Remark>, count: usize) -> Vec<Remark> {
    let mut out: Vec<Remark> = Vec::new();
    for remark in all {
        match out.iter_mut().find(|r| (r.weight, &r.signal, r.about) == (remark.weight, &remark.signal, remark.about)) {
            Some(same) => same.records.extend(remark.records),
            None => out.push(remark),
        }
    }
    for remark in &mut out {
        remark.records.dedup();
        if remark.records.len() == count && count > 1 {
            remark.records.clear();
        }
    }
    out
}

fn clock(record: &Record, all: &mut Vec<Remark>) {
    let jitter = &record.jitter;
    if !jitter.gaps.is_empty() {
        let missing: usize = jitter.gaps.iter().map(|g| g.missing).sum();
        let text = format!(
            "{missing} samples are missing in {} gaps, the first after {:.4} s; they are filled in as the input's hold says",
            jitter.gaps.len(),
            jitter.gaps[0].after
        );
        add(all, Weight::Caution, record, "", "gaps", text);
    } else if jitter.largest > JITTER * record.period {
        let text = format!(
            "the clock is off its grid by {:.1} % of a sample rms and {:.0} % at worst; delays below that are not claimed",
            100.0 * jitter.rms / record.period,
            100.0 * jitter.largest / record.period
        );
        add(all, Weight::Caution, record, "", "clock", text);
    }
}

fn constant(record: &Record, name: &str, samples: &[f64], all: &mut Vec<Remark>) {
    if is_constant(samples) {
        let value = samples.first().copied().unwrap_or(0.0);
        add(all, Weight::Caution, record, name, "constant", format!("is {value} throughout: it says nothing"));
    }
}

/// Samples that stay at an extreme for longer than a smooth turn would.
fn clipped(record: &Record, name: &str, samples: &[f64], why: &str, all: &mut Vec<Remark>) {
    let (share, low, high) = clipped_share(samples);
    if share > CLIPPED {
        let text = format!("stays at {low:.4} or {high:.4} for {:.0} % of the time: {why}", 100.0 * share);
        add(all, Weight::Note, record, name, "saturated", text);
    }
}

fn sensor(record: &Record, name: &str, stated: f64, samples: &[f64], all: &mut Vec<Remark>) {
    match crate::floor::step_of(samples) {
        Some(step) if stated > 0.0 && ((step / stated) - (step / stated).round()).abs() > 0.02 => {
            let text = format!("moves in steps of {step:.4e}, the model says {stated:.4e}");
            add(all, Weight::Caution, record, name, "encoder", text);
        }
        Some(step) if stated == 0.0 => add(all, Weight::Note, record, name, "encoder", format!("moves in steps of {step:.4e}")),
        Some(_) => {}
        None => {
            if stated > 0.0 && off_grid(samples, stated) {
                let text =
                    format!("is not on the grid of {stated:.4e} that the model says: it was filtered or converted before it was recorded");
                add(all, Weight::Caution, record, name, "filtered", text);
            }
            if let Some(share) = quiet_top(samples)
                && share < 1e-4
            {
                let text = "has nothing in the upper part of its band, not even noise: it was low-pass filtered before it was recorded, \
                            or simulated; fast effects (delay, bandwidth) may be the filter's"
                    .to_string();
                add(all, Weight::Caution, record, name, "filtered", text);
            }
        }
    }
}

/// Measuring error of each output.
fn noises(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    for (index, (output, floor)) in problem.model.outputs.iter().zip(&problem.floor).enumerate() {
        let spreads: Vec<f64> = problem.fit.iter().filter(|r| r.outputs[index].is_some()).map(|r| r.spread[index]).collect();
        if spreads.is_empty() {
            continue;
        }
        let spread = spreads.iter().sum::<f64>() / spreads.len() as f64;
        let text = format!("its measuring error is {floor:.2e}, {:.3} % of what it moves", 100.0 * floor / spread);
        let weight = if floor / spread > 0.3 { Weight::Caution } else { Weight::Note };
        all.push(Remark { weight, records: Vec::new(), signal: output.name.clone(), about: "noise", text });
    }
    all
}

/// Recordings of the same excitation: how well the device repeats itself.
fn repeats(problem: &Problem) -> Vec<Remark> {
    let mut all = Vec::new();
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let apart = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>();
    for (i, a) in problem.fit.iter().enumerate() {
        for b in &problem.fit[..i] {
            let same = a.len == b.len && a.inputs.iter().zip(&b.inputs).all(|(x, y)| square(x) > 0.0 && apart(x, y) < 1e-6 * square(x));
            if !same {
                continue;
            }
            for (o, output) in problem.model.outputs.iter().enumerate() {
                let (Some(Some(x)), Some(Some(y))) = (a.outputs.get(o), b.outputs.get(o)) else { continue };
                let off = (apart(x, y) / (2 * x.len()) as f64).sqrt();
                let floors = off / problem.floor[o];
                let text = if floors > 3.0 {
                    format!("repeats {} to {off:.2e} only, {floors:.1} times its noise: no model can do better", file_name(&b.name))
                } else {
                    format!("repeats {} to its noise", file_name(&b.name))
                };
                let weight = if floors > 3.0 { Weight::Caution } else { Weight::Note };
                add(&mut all, weight, a, &output.name, "repeats", text);
            }
        }
    }
    all
}

/// Whether a force answers what is measured: noise of the output then shows in the input one sample later.
fn closed_loop(problem: &Problem, all: &mut Vec<Remark>) {
    for record in &problem.fit {
        for (input, u) in problem.model.inputs.iter().zip(&record.inputs).filter(|(i, _)| i.kind == InputKind::Force) {
            for (output, y) in problem.model.outputs.iter().zip(&record.outputs) {
                let Some(y) = y else { continue };
                if !matches!(output.kind, OutputKind::Position(_) | OutputKind::Velocity(_)) {
                    continue;
                }
                let found = answers(u, y);
                if found > CLOSED {
                    let text = format!(
                        "follows the noise of {} (correlation {found:.2}): a controller closes the loop, and hides what it can reject",
                        output.name
                    );
                    add(all, Weight::Note, record, &input.name, "loop", text);
                }
            }
        }
    }
}
