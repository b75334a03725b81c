//! The gain at which each canceller's loop stops being stable, on the contact script of `launch/contact.toml`.
//!
//!     cargo run --release --example critical_gains
//!
//! Sensors are ideal and the devices' limits do not act: with them the outcome is `limited` in most of the range, which is no information on the loop.

#[path = "../tests/common/mod.rs"]
mod common;

use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use backdrive_plant::elements::Law;
use backdrive_plant::model::Fragment;
use backdrive_stability::outcome::Outcome;
use common::{cancel_with, contact, file, growth, linear, run};

const PERIOD: f64 = 1.0 / 5000.0;
const LOWEST: f64 = 0.05;
const HIGHEST: f64 = 50.0;

/// The lowest gain at which the verdict is not stable (found on a grid of 10 %, then to 1 %), and that verdict.
fn critical(outcome: impl Fn(f64) -> Outcome) -> Option<(f64, Outcome)> {
    let steps = ((HIGHEST / LOWEST).ln() / 1.1_f64.ln()).ceil() as i32;
    let mut before = LOWEST;
    for i in 0..=steps {
        let gain = (LOWEST * 1.1_f64.powi(i)).min(HIGHEST);
        let mut found = outcome(gain);
        if found != Outcome::Stable {
            let (mut low, mut high) = (before, gain);
            while high > 1.01 * low {
                let middle = (low * high).sqrt();
                match outcome(middle) {
                    Outcome::Stable => low = middle,
                    other => (high, found) = (middle, other),
                }
            }
            return Some((high, found));
        }
        before = gain;
    }
    None
}

fn show(name: &str, found: Option<(f64, Outcome)>) {
    match found {
        Some((gain, outcome)) => println!("  {name:<52} {gain:>7.3}  {outcome}"),
        None => println!("  {name:<52} > {HIGHEST:>4}   stable at every gain tried"),
    }
}

/// The graph's grip, firmer (above 1) or softer (below 1).
fn scale_grip(grip: &mut Fragment, factor: f64) {
    for element in &mut grip.network.elements {
        match &mut element.law {
            Law::Spring(spring) => spring.stiffness *= factor,
            Law::Damper(damper) => damper.damping *= factor,
            _ => {}
        }
    }
}

fn with(graph: &Graph, lambda: f64, grip: f64) -> Outcome {
    let mut graph = graph.clone();
    graph.gains.lambda = lambda;
    for node in &mut graph.nodes {
        if let Settings::Master(files) = &mut node.settings
            && let Some(fragment) = &mut files.fragment
        {
            scale_grip(fragment, grip);
        }
    }
    run(&graph).outcome(PERIOD)
}

fn main() {
    let canceller = |path: &str| {
        let path = if path == "none" { "none".into() } else { file(path) };
        contact(Overrides { canceller: Some(path), ..Overrides::default() })
    };
    let reduced = canceller("plant/models/impulse-engine-second-order.toml");
    let second = best_second_order("the script", &reduced, |graph, l| with(graph, l, 1.0));
    println!("critical mu*lambda, nonlinear master (launch/contact.toml), searched from {LOWEST} to {HIGHEST}:");
    show("no canceller", critical(|l| with(&canceller("none"), l, 1.0)));
    show("second order, as in the model file", critical(|l| with(&canceller("plant/models/impulse-engine-second-order.toml"), l, 1.0)));
    show("second order, best found for this script", critical(|l| with(&second, l, 1.0)));
    for (name, path) in
        [("sixth order, linear", "plant/models/impulse-engine-linear.toml"), ("sixth order, nonlinear", "plant/models/impulse-engine.toml")]
    {
        let graph = canceller(path);
        show(name, critical(|l| with(&graph, l, 1.0)));
        show(&format!("{name}, real grip 10 % firmer"), critical(|l| with(&graph, l, 1.1)));
        show(&format!("{name}, real grip 10 % softer"), critical(|l| with(&graph, l, 0.9)));
    }

    println!("\ncritical mu*lambda, linear master against a wall that pushes and pulls (growth of the loop):");
    let tried = |change: &dyn Fn(&mut Graph), l: f64| {
        let mut graph = linear(l);
        change(&mut graph);
        let growth = growth(&run(&graph).contact, PERIOD);
        if growth > 0.0 { Outcome::Unstable { growth_per_s: growth } } else { Outcome::Stable }
    };
    let take = |from: &Graph, graph: &mut Graph| {
        let settings = from.node_of(NodeKind::Canceller).map(|n| n.settings.clone());
        if let (Some(node), Some(settings)) = (graph.nodes.iter_mut().find(|n| n.kind == NodeKind::Canceller), settings) {
            node.settings = settings;
        }
    };
    let second = best_second_order("the linear loop", &reduced, |from, l| tried(&|graph| take(from, graph), l));
    show("no canceller", critical(|l| tried(&|_| {}, l)));
    show("second order, as in the model file", critical(|l| tried(&|graph| take(&reduced, graph), l)));
    show("second order, best found for this loop", critical(|l| tried(&|graph| take(&second, graph), l)));
    show("sixth order, exact", critical(|l| tried(&|graph| cancel_with(graph, |_| {}), l)));
}

/// The second-order canceller with the highest critical gain: pattern search in the logarithms of mass, damping, stiffness.
fn best_second_order(what: &str, start: &Graph, outcome: impl Fn(&Graph, f64) -> Outcome) -> Graph {
    let numbers = ["bodies.handle", "elements.damping.damping", "elements.spring.stiffness"];
    let with_numbers = |values: &[f64; 3]| {
        let mut graph = start.clone();
        if let Some(node) = graph.nodes.iter_mut().find(|n| n.kind == NodeKind::Canceller)
            && let Settings::Canceller(files, ..) = &mut node.settings
            && let Some(model) = &mut files.model
        {
            for (path, value) in numbers.iter().zip(values) {
                model.set_values_at(path, &[*value]).expect("the model has these numbers");
            }
        }
        graph
    };
    // A coarser search for the critical gain than the table's: only the order of candidates matters.
    let edge = |values: &[f64; 3]| {
        let graph = with_numbers(values);
        let gains = (0..).map(|i| 0.2 * 1.05_f64.powi(i)).take_while(|g| *g < HIGHEST);
        gains.into_iter().find(|l| outcome(&graph, *l) != Outcome::Stable).unwrap_or(HIGHEST)
    };
    let mut best = [0.025, 8.5, 4160.0];
    let (mut height, mut stride) = (edge(&best), 2.0_f64);
    while stride > 1.1 {
        let mut improved = false;
        for number in 0..3 {
            for factor in [stride, 1.0 / stride] {
                let mut trial = best;
                trial[number] *= factor;
                let found = edge(&trial);
                if found > height {
                    (best, height, improved) = (trial, found, true);
                }
            }
        }
        if !improved {
            stride = stride.sqrt();
        }
    }
    println!("best second order for {what}: m {:.4} kg, b {:.2} N s/m, k {:.0} N/m", best[0], best[1], best[2]);
    with_numbers(&best)
}
