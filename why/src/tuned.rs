//! Which numbers of a device, one or several at once, make it do what was recorded: a firmer hand, a wrong torque constant, a lag. Tried before any
//! effect, because numbers of a known model that explain everything are the simplest answer.

use crate::knob::Knob;
use crate::trial::Trial;
use backdrive_nodes::graph::Settings;
use backdrive_signal::statistics::rms;
use backdrive_stability::by_itself::compared::SMALL;
use backdrive_stability::by_itself::recorded::{Quantity, Recorded};
use rayon::prelude::*;
use serde::Serialize;

/// Numbers explain a difference where they leave no more of it than this.
const EXPLAINS: f64 = 0.1;

/// A difference as large as this is all of a signal: what is larger is not explained by leaving more.
const ALL: f64 = 0.5;

/// Another number has to leave less than this share of what was left before it.
const WORTH: f64 = 0.4;

/// Of several explanations that leave as much as this many times the least, the simplest counts.
const ALIKE: f64 = 1.25;

/// Numbers at once.
const MOST: usize = 3;

/// Places from which one more number is tried.
const BEAM: usize = 4;

/// Values of an output that are compared.
const COMPARED: usize = 4000;

/// Steps of a fit.
const STEPS: usize = 12;

/// A number that was found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tuned {
    /// Which.
    pub knob: Knob,
    /// Its value.
    pub value: f64,
    /// Half the width of the interval in which the rest that is left could hide it.
    pub give: f64,
}

/// Numbers with what they leave.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// The numbers, the most important first.
    pub numbers: Vec<Tuned>,
    /// Share of the outputs that they leave.
    pub left: f64,
    /// The same without them.
    pub before: f64,
}

impl Explained {
    /// Whether little enough is left.
    pub fn is_enough(&self) -> bool {
        self.left <= (EXPLAINS * self.before.min(ALL)).max(0.5 * SMALL).min(0.5 * self.before)
    }
}

/// A device by itself, beside its recorded outputs.
pub struct Beside<'a> {
    was: &'a Trial,
    node: String,
    recorded: &'a Recorded,
    /// Topic, quantity, axis, size.
    outputs: Vec<(String, Quantity, usize, f64)>,
    stride: usize,
}

impl<'a> Beside<'a> {
    /// The outputs of a node that are looked at; `None` where none was recorded.
    pub fn new(was: &'a Trial, node: &str, quantities: &[Quantity], recorded: &'a Recorded) -> Option<Beside<'a>> {
        let graph = &was.graph;
        let index = graph.nodes.iter().position(|n| n.name == node)?;
        let topic = graph.topic_of(index, "measured").name;
        let track = recorded.track(&topic)?;
        let mut outputs = Vec::new();
        for quantity in quantities {
            for axis in 0..graph.nodes[index].axes {
                let column: Vec<f64> = track.column(*quantity, axis).iter().copied().filter(|x| x.is_finite()).collect();
                let mean = column.iter().sum::<f64>() / column.len().max(1) as f64;
                let size = rms(column.iter().map(|x| x - mean));
                if size > 0.0 && size.is_finite() {
                    outputs.push((topic.clone(), *quantity, axis, size));
                }
            }
        }
        let stride = (recorded.rows / COMPARED).max(1);
        (!outputs.is_empty()).then(|| Beside { was, node: node.to_string(), recorded, outputs, stride })
    }

    /// The loop with other numbers.
    pub fn with(&self, numbers: &[(Knob, f64)]) -> Trial {
        let mut trial = self.was.clone();
        numbers.iter().for_each(|(knob, value)| knob.apply(&mut trial, &self.node, *value));
        trial
    }

    /// What is left of the outputs with other numbers, as shares of their sizes; `None` where the device cannot be run.
    fn rest(&self, numbers: &[(Knob, f64)]) -> Option<Vec<f64>> {
        let trial = self.with(numbers);
        let put = trial.alone(&self.node, self.recorded).ok()?;
        let mut all = Vec::new();
        for (topic, quantity, axis, size) in &self.outputs {
            let track = self.recorded.track(topic)?;
            let put = put.iter().find(|p| p.topic == *topic)?;
            for (r, sample) in track.column(*quantity, *axis).iter().zip(&put.samples).step_by(self.stride) {
                let p = quantity.of(sample, *axis);
                // What leaves all bounds is as far away as can be told.
                all.push(if r.is_finite() { ((r - p) / size).clamp(-FAR, FAR) } else { 0.0 });
            }
        }
        all.iter().all(|x| x.is_finite()).then_some(all)
    }

    fn left(&self, numbers: &[(Knob, f64)]) -> f64 {
        self.rest(numbers).map_or(f64::INFINITY, |rest| size_of(&rest))
    }

    /// Levenberg and Marquardt's way from a start, with sensitivities by differences.
    fn fitted(&self, start: &[(Knob, f64)]) -> (Vec<Tuned>, f64) {
        let mut at: Vec<(Knob, f64)> = start.to_vec();
        let Some(mut rest) = self.rest(&at) else { return (untold(&at), f64::INFINITY) };
        let mut left = size_of(&rest);
        let mut damping = 1e-3;
        let mut slopes = vec![0.0; at.len()];
        for _ in 0..STEPS {
            let Some(columns) = self.sensitivities(&at, &rest) else { break };
            slopes = columns.iter().map(|c| size_of(c)).collect();
            let mut moved = false;
            for _ in 0..4 {
                let Some(step) = solved(&columns, &rest, damping) else { break };
                let next: Vec<(Knob, f64)> = at
                    .iter()
                    .zip(&step)
                    .map(|((knob, value), step)| {
                        let [low, high] = knob.bounds();
                        let most = if knob.is_time() { 0.5 * value + 4e-3 } else { 0.4 * value.abs() + 0.1 };
                        (*knob, (value + step.clamp(-most, most)).clamp(low, high))
                    })
                    .collect();
                let Some(new) = self.rest(&next) else { break };
                let new_left = size_of(&new);
                if new_left < left {
                    let gained = left - new_left;
                    (at, rest, left, damping) = (next, new, new_left, 0.2 * damping);
                    moved = gained > 1e-3 * left + 1e-7;
                    break;
                }
                damping *= 10.0;
            }
            if !moved {
                break;
            }
        }
        let give = |slope: f64| if slope > 0.0 { left / slope } else { f64::INFINITY };
        let told = at.iter().zip(&slopes).map(|((knob, value), slope)| Tuned { knob: *knob, value: *value, give: give(*slope) });
        (told.collect(), left)
    }

    fn sensitivities(&self, at: &[(Knob, f64)], rest: &[f64]) -> Option<Vec<Vec<f64>>> {
        (0..at.len())
            .map(|i| {
                let mut near = at.to_vec();
                let h = if near[i].0.is_time() { 2e-4_f64.max(0.02 * near[i].1) } else { 0.01 * near[i].1.abs().max(0.1) };
                near[i].1 += h;
                let other = self.rest(&near)?;
                Some(other.iter().zip(rest).map(|(o, r)| (o - r) / h).collect())
            })
            .collect()
    }
}

/// An error counts up to this many times the size of its signal.
const FAR: f64 = 30.0;

fn untold(at: &[(Knob, f64)]) -> Vec<Tuned> {
    at.iter().map(|(knob, value)| Tuned { knob: *knob, value: *value, give: f64::INFINITY }).collect()
}

fn size_of(rest: &[f64]) -> f64 {
    let rows = rest.len().max(1) as f64;
    (rest.iter().map(|x| x * x).sum::<f64>() / rows).sqrt()
}

/// The step that the normal equations give; `None` where they give none.
fn solved(columns: &[Vec<f64>], rest: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = columns.len();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut table: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let mut row: Vec<f64> = (0..n).map(|j| dot(&columns[i], &columns[j])).collect();
            row[i] *= 1.0 + damping;
            row.push(-dot(&columns[i], rest));
            row
        })
        .collect();
    for i in 0..n {
        let pivot = (i..n).max_by(|a, b| table[*a][i].abs().total_cmp(&table[*b][i].abs()))?;
        table.swap(i, pivot);
        let head = table[i][i];
        if head == 0.0 || !head.is_finite() {
            return None;
        }
        for k in 0..n {
            if k == i {
                continue;
            }
            let factor = table[k][i] / head;
            for j in i..=n {
                let taken = factor * table[i][j];
                table[k][j] -= taken;
            }
        }
    }
    (0..n).map(|i| Some(table[i][n] / table[i][i]).filter(|x| x.is_finite())).collect()
}

/// Searches for the numbers of the device of `node`, as few as explain its outputs; `None` where the device cannot be run. What is returned may leave too
/// much: see [`Explained::is_enough`].
pub fn tuned(beside: &Beside) -> Option<Explained> {
    let node = beside.was.graph.node(&beside.node)?;
    let (Settings::Master(files) | Settings::Slave(files)) = &node.settings else { return None };
    let knobs = Knob::all(node.kind, files);
    let period_s = beside.was.graph.period_s();
    let before = size_of(&beside.rest(&[])?);
    let mut best = Explained { numbers: Vec::new(), left: before, before };
    let mut places: Vec<(Vec<Tuned>, f64)> = vec![(Vec::new(), before)];
    for _ in 0..MOST {
        let tries: Vec<(Vec<(Knob, f64)>, Knob)> = places
            .iter()
            .flat_map(|(numbers, _)| {
                let at: Vec<(Knob, f64)> = numbers.iter().map(|n| (n.knob, n.value)).collect();
                knobs.iter().filter(|k| !numbers.iter().any(|n| n.knob == **k)).map(move |k| (at.clone(), *k)).collect::<Vec<_>>()
            })
            .collect();
        let one = |(at, knob): &(Vec<(Knob, f64)>, Knob)| {
            let with = |value: f64| [&at[..], &[(*knob, value)]].concat();
            let starts = knob.starts(period_s).into_iter().chain([knob.neutral()]);
            let mut scanned: Vec<(f64, f64)> = starts.map(|value| (beside.left(&with(value)), value)).collect();
            scanned.sort_by(|a, b| a.0.total_cmp(&b.0));
            // A delay beside a vibration has several valleys.
            let valleys = if knob.is_time() { 2 } else { 1 };
            let fits = scanned.iter().take(valleys).map(|(_, value)| beside.fitted(&with(*value)));
            fits.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Vec::new(), f64::INFINITY))
        };
        let mut found: Vec<(Vec<Tuned>, f64)> = tries.par_iter().map(one).collect();
        let least = found.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
        if least > WORTH.max(if best.numbers.is_empty() { 0.8 } else { 0.0 }) * best.left {
            break;
        }
        // In the order of the knobs, the simplest first.
        if let Some((numbers, left)) = found.iter().find(|f| f.1 <= ALIKE * least) {
            best = Explained { numbers: numbers.clone(), left: *left, before };
        }
        if best.is_enough() {
            break;
        }
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        found.truncate(BEAM);
        places = found;
    }
    Some(best)
}
