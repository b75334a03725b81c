use super::*;
use crate::session::{AxisSignals, Session};
use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::{Limits, NodeKind, Overrides, Settings};
use std::path::Path;

const WALL: f64 = 1000.0;

/// A loop at rest in contact whose shown stiffness, drag and tracking are known by hand: mu = 2, lambda = 0.5.
fn session() -> Session {
    let (period_s, rows) = (1e-3, 3000);
    let mut axis = AxisSignals { name: "x".into(), clamped: vec![false; rows], ..AxisSignals::default() };
    let (mut intent, mut slave) = (Vec::new(), Vec::new());
    for row in 0..rows {
        // Free to 10 mm at 20 mm/s with a drag of 3 N s/m, the slave 1 mm behind; then still, 4 mm inside at the master, 6 mm at the slave.
        let free = row < 1000;
        let x = if free { 20e-3 * row as f64 * period_s } else { 14e-3 };
        intent.push(x);
        axis.master.push(x);
        slave.push(match row {
            0..1000 => 2.0 * x - 1e-3,
            1000 => 20e-3,
            _ => 26e-3,
        });
        axis.contact.push(if free { 0.0 } else { -WALL * 6e-3 });
        axis.force.push(if free { -3.0 * 20e-3 } else { -2.4 });
    }
    axis.command = slave.clone();
    (axis.slave, axis.intent) = (Some(slave), Some(intent));
    Session {
        sensors: Vec::new(),
        name: "by hand".into(),
        period_s,
        axes: vec![axis],
        mu: vec![2.0; rows],
        lambda: vec![0.5; rows],
        notes: Vec::new(),
        cut_short: None,
        parts: Vec::new(),
        elsewhere: None,
        bridged_s: 0.02,
    }
}

#[test]
fn measures_are_those_computed_by_hand() {
    let found = Measures::of(&session(), &Outcome::Stable);
    // 2.4 N over 4 mm at the master, beside 2 * 0.5 * 1000 N/m.
    assert!((found.stiffness_share.unwrap() - 0.6).abs() < 1e-9, "{found:?}");
    assert!((found.drag.unwrap() - 3.0).abs() < 1e-9, "{found:?}");
    assert!((found.tracking_free.unwrap() - 1e-3).abs() < 1e-12, "{found:?}");
    assert!((found.effort.unwrap() - 2.4).abs() < 1e-12 && (found.contact_peak.unwrap() - 6.0).abs() < 1e-12);
    let cycling = Outcome::LimitCycle { amplitude_m: 1e-3, frequency_hz: 20.0, unit: Default::default() };
    assert!(Measures::of(&session(), &cycling).stiffness_share.is_none(), "what does not rest shows no stiffness");
}

#[test]
fn jitter_is_about_its_mean_and_both_ways_differ() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut graph = Graph::load(&root.join("launch/coupling.toml"), &Overrides::default()).unwrap();
    let condition = Condition { varied: Varied::Jitter, jitter_s: 0.04, ..Condition::delay(0.12) };
    condition.impair(&mut graph);
    let ways: Vec<_> = graph.connections.iter().filter_map(|c| c.impairment).collect();
    assert_eq!(ways.len(), 2);
    for way in &ways {
        assert!((way.delay_s - 0.08).abs() < 1e-12 && (way.jitter_s - 0.08).abs() < 1e-12);
    }
    assert_ne!(ways[0].seed, ways[1].seed);
    Condition::delay(0.0).impair(&mut graph);
    assert!(graph.connections.iter().all(|c| c.impairment.is_none()));
}

#[test]
fn a_canceller_that_subtracts_nothing_gets_to_know_the_master() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let graph = |file: &str| {
        let changes = Overrides { coupling: Some(LawKind::Direct), ..Overrides::default() };
        Graph::load(&root.join(file), &changes).unwrap()
    };
    let knows = |graph: &Graph| match &graph.node_of(NodeKind::Canceller).unwrap().settings {
        Settings::Canceller(files, ..) => files.model.as_ref().map(|m| m.name.clone()),
        _ => None,
    };
    let mut with = graph("launch/coupling.toml");
    Rival::Canceller.settle(&mut with).unwrap();
    assert_eq!(knows(&with).as_deref(), Some("impulse-engine"));
    // A graph with scaling gets a coupling in its place.
    let mut without = graph("launch/contact.toml");
    Rival::Law(LawKind::Direct).settle(&mut without).unwrap();
    assert_eq!(knows(&without), None);
}

/// With the canceller the loop is stable above the critical gain of the bare law, and a bare law's critical gain falls with the delay.
#[test]
fn a_comparison_ranks_what_is_known() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    // Without the motor's limit of force, which a canceller reaches before it oscillates.
    let limits = Some(Limits::Ignored);
    let changes = Overrides { coupling: Some(LawKind::Direct), limits, duration_s: Some(2.0), ..Overrides::default() };
    let of = |rival: Rival| {
        let mut graph = Graph::load(&root.join("launch/coupling.toml"), &changes).unwrap();
        rival.settle(&mut graph).unwrap();
        (rival, graph)
    };
    let direct = Rival::Law(LawKind::Direct);
    let comparison = Comparison {
        rivals: vec![of(Rival::Canceller), of(direct)],
        conditions: vec![Condition::delay(0.0), Condition::delay(0.05)],
        intents: None,
        search: Search { highest: 5.0, ..Comparison::SEARCH },
    };
    let cells: Vec<Cell> = comparison.run(&|_| (), &AtomicBool::new(false)).unwrap().into_iter().flatten().collect();
    assert_eq!(cells.len(), 4);
    let edge = |at: usize| cells[at].critical_gain.unwrap_or(cells[at].stable_up_to);
    assert!(edge(0) > edge(1), "with a canceller {} and without {}", edge(0), edge(1));
    assert!(edge(1) > edge(3), "without delay {} and with {}", edge(1), edge(3));
}
