//! Models by hand, for tests of the stepper.
#![allow(dead_code)] // every test file takes what it needs

use backdrive_plant::elements::{Law, kind_named};
use backdrive_plant::model::{Body, Element, Hold, Input, InputKind, Model, Output, OutputKind, Place};
use backdrive_plant::stepper::{Options, simulate};
use std::f64::consts::TAU;

pub const GROUND: Place = None;

/// A body by its index.
pub const fn at(body: usize) -> Place {
    Some(body)
}

/// A law of this kind from numbers in the order of its parameters; those at the end that are left out have their defaults.
pub fn law(kind: &str, values: &[f64]) -> Law {
    let kind = kind_named(kind).expect("a kind");
    let defaults = kind.parameters.iter().skip(values.len()).map(|p| p.default.expect("a default"));
    let lists: Vec<Vec<f64>> = values.iter().copied().chain(defaults).map(|v| vec![v]).collect();
    (kind.build)(&lists).expect("a law")
}

pub fn element(kind: &str, between: [Place; 2], values: &[f64]) -> Element {
    Element { name: kind.to_owned(), between, law: law(kind, values) }
}

pub fn spring(between: [Place; 2], stiffness: f64) -> Element {
    element("spring", between, &[stiffness, 0.0])
}

pub fn damper(between: [Place; 2], damping: f64) -> Element {
    element("damper", between, &[damping])
}

pub fn coulomb(between: [Place; 2], force: f64) -> Element {
    element("coulomb", between, &[force])
}

pub fn force_input(on: usize) -> Input {
    Input::ideal("force", InputKind::Force, on, Hold::Linear)
}

pub fn motion_input(on: usize) -> Input {
    Input { name: "motion".to_owned(), kind: InputKind::Motion, hold: Hold::Cubic, ..force_input(on) }
}

pub fn output(kind: OutputKind) -> Output {
    Output { name: "output".to_owned(), kind, gain: 1.0, delay: 0.0, offset: 0.0, resolution: 0.0, noise: 0.0 }
}

pub fn model(inertias: &[f64], elements: Vec<Element>, inputs: Vec<Input>, outputs: Vec<OutputKind>) -> Model {
    Model {
        name: "test".to_owned(),
        bodies: inertias.iter().enumerate().map(|(i, m)| Body { name: format!("body{i}"), inertia: *m }).collect(),
        elements,
        inputs,
        outputs: outputs.into_iter().map(output).collect(),
        ..Model::default()
    }
}

/// Outputs, a column each, with `substeps` in each period.
pub fn run(model: &Model, inputs: &[Vec<f64>], period_s: f64, substeps: Option<usize>) -> Vec<Vec<f64>> {
    simulate(model, inputs, period_s, &Options { substeps, ..Options::default() }).expect("a model that can be stepped")
}

/// `count` samples of a function of time.
pub fn samples(count: usize, period_s: f64, f: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..count).map(|i| f(i as f64 * period_s)).collect()
}

/// A force of total impulse `impulse` over the first 20 samples.
pub fn knock(count: usize, period_s: f64, impulse: f64) -> Vec<f64> {
    let mut u = vec![0.0; count];
    u[1..20].fill(impulse / (19.0 * period_s));
    u
}

/// A sine that sweeps from `from` to `to` Hz.
pub fn sweep(count: usize, period_s: f64, from: f64, to: f64, amplitude: f64) -> Vec<f64> {
    let length = count as f64 * period_s;
    samples(count, period_s, |t| amplitude * (t / 0.05).min(1.0) * (TAU * (from + 0.5 * (to - from) * t / length) * t).sin())
}

pub fn range(column: &[f64]) -> f64 {
    column.iter().copied().fold(f64::NEG_INFINITY, f64::max) - column.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Root mean square of the difference, over the range of the second.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (sum / a.len() as f64).sqrt() / range(b)
}

pub fn largest(column: impl IntoIterator<Item = f64>) -> f64 {
    column.into_iter().fold(0.0, |largest: f64, q| if q.abs() > largest || q.is_nan() { q.abs() } else { largest })
}
