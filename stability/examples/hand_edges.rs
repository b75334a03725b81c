//! The stable gain on the contact script for hands whose grip differs from the one in the canceller's file. Three cases are compared: no cancellation,
//! the exact model with the grip of the file, and the canceller that estimates the hand. The last one runs without and with the gain that is stable
//! without a canceller (docs/canceller.md).
//!
//!     cargo run --release -p backdrive-stability --example hand_edges [GRAPH [GRIP...]]

use backdrive_control::hand::HandSettings;
use backdrive_nodes::graph::{Graph, Limits, NodeKind, Overrides, Sensors, Settings};
use backdrive_stability::resimulate::edge::{Search, edge};
use backdrive_stability::resimulate::{RunOptions, Scenario};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

const GRIPS: [f64; 6] = [0.5, 0.8, 1.0, 1.1, 1.5, 2.0];

/// As `backdrive prove` searches.
const SEARCH: Search =
    Search { lowest: 0.05, floor: 0.05, highest: 50.0, tolerance: 0.03, per_decade: 8, whole_grid: false, around: false };

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/contact.toml"), PathBuf::from);
    let mut grips: Vec<f64> = arguments.map(|a| a.parse()).collect::<Result<_, _>>()?;
    if grips.is_empty() {
        grips = GRIPS.to_vec();
    }
    let mut none = Vec::new();
    for grip in grips.iter().chain(&[0.5, 2.0]) {
        none.push(stable_to(&file, "none", None, *grip)?.0);
    }
    let without = none.iter().copied().reduce(f64::min);
    println!("{:<12} {:>10} {:>10} {:>10} {:>18}", "grip", "none", "fixed", "estimated", "and edge_without");
    for (grip, none) in grips.iter().zip(none) {
        let fixed = stable_to(&file, "fixed", None, *grip)?.0;
        let estimated = stable_to(&file, "estimated", None, *grip)?;
        let known = stable_to(&file, "estimated", without, *grip)?;
        println!("{grip:<12} {none:>10.3} {fixed:>10.3} {:>10.3} {:>18.3}   {}", estimated.0, known.0, known.1);
    }
    Ok(())
}

/// The stable gain with a canceller, and what is beyond it.
fn stable_to(file: &Path, canceller: &str, edge_without: Option<f64>, grip: f64) -> Result<(f64, String), Box<dyn std::error::Error>> {
    let changes = Overrides {
        canceller: (canceller == "none").then(|| "none".into()),
        limits: Some(Limits::Ignored),
        sensors: std::env::var("IDEAL").ok().map(|_| Sensors::Ideal),
        ..Overrides::default()
    };
    let mut graph = Graph::load(file, &changes)?;
    for node in graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Canceller) {
        if let Settings::Canceller(.., hand) = &mut node.settings {
            *hand = (canceller == "estimated").then(|| HandSettings { edge_without, ..HandSettings::default() });
        }
    }
    let scenario = Scenario::new(graph, None, None)?;
    let options = RunOptions { grip_scale: grip, ..RunOptions::default() };
    let found = edge(&scenario, &SEARCH, &options, &|_, _| {}, &AtomicBool::new(false))?;
    Ok((found.at_least, found.reason))
}
