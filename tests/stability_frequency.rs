//! The frequency-domain answer from recorded signals of the live graph, against the critical gain of the live graph.

mod common;

use backdrive_nodes::graph::{Graph, NodeKind, Settings};
use backdrive_plant::excitation::Excitation;
use backdrive_stability::frequency::{ExchangedParts, Frequency, Options, Verdict, analyse};
use backdrive_stability::outcome::{Closes, Unit};
use backdrive_stability::session::{AxisSignals, Session};
use common::{cancel_with, edge, growth, linear, response, run};

const PERIOD: f64 = 2e-4;

/// The linear loop at a gain, with a dither on its force and a hand that presses and rests.
fn shaken(lambda: f64, dither: &str, seconds: f64) -> Graph {
    let mut graph = linear(lambda);
    graph.timing.steps = Some((seconds / PERIOD).round() as u64);
    let samples = dither.parse::<Excitation>().unwrap().samples(1.0 / PERIOD).unwrap();
    for node in &mut graph.nodes {
        match &mut node.settings {
            Settings::Scaling { dither, .. } => *dither = vec![samples.clone()],
            Settings::Operator(intents) => {
                *intents = vec![backdrive_control::operator::Intent::Waypoints(vec![[0.0, 0.0], [0.2, 0.002], [1e3, 0.002]])];
            }
            _ => {}
        }
    }
    graph
}

/// What a bag of the run would hold.
fn session(graph: &Graph, lambda: f64, dither: &str) -> Session {
    let signals = run(graph);
    let n = signals.measured.len();
    let played = dither.parse::<Excitation>().unwrap().samples(1.0 / PERIOD).unwrap();
    let some = |column: Vec<f64>| (column.len() == n && column.iter().any(|x| *x != 0.0)).then_some(column);
    let axis = AxisSignals {
        name: "x".into(),
        intent: some(signals.intent),
        master: signals.measured,
        force: signals.force,
        dither: Some((0..n).map(|row| played[row % played.len()]).collect()),
        induced: some(signals.induced),
        command: signals.command,
        contact: signals.contact,
        slave_force: None,
        hand: None,
        slave: None,
        clamped: signals.clamped,
        stale: Vec::new(),
        travel: None,
        resolution: 0.0,
        noise: 0.0,
        unit: Unit::Metre,
        closes: Closes::InContact,
    };
    Session {
        name: "live".into(),
        period_s: PERIOD,
        axes: vec![axis],
        mu: vec![1.0; n],
        lambda: vec![lambda; n],
        notes: Vec::new(),
        sensors: Vec::new(),
        cut_short: None,
        parts: Vec::new(),
        elsewhere: None,
        bridged_s: backdrive_stability::unjudged::BRIDGED_S,
    }
}

fn answer(graph: &Graph, lambda: f64, dither: &str) -> Frequency {
    analyse(&session(graph, lambda, dither), &Options::default()).unwrap()
}

fn live_edge(low: f64, high: f64, change: impl Fn(&mut Graph)) -> f64 {
    edge(low, high, 2e-3, |lambda| {
        let mut graph = linear(lambda);
        change(&mut graph);
        growth(&run(&graph).measured, PERIOD) > 0.0
    })
}

const DITHER: &str = "multisine:peak=0.1,from=1,to=500,period=2";

#[test]
fn the_edge_and_the_limit_cycle_frequency_of_the_live_loop_come_from_its_record() {
    let truth = live_edge(0.2, 1.0, |_| {});
    let lambda = 0.4 * truth;
    let found = answer(&shaken(lambda, DITHER, 12.0), lambda, DITHER);
    println!("live {truth:.4}, from the record {:?}; {}", found.edge, found.method);
    let gain = found.edge.gain.unwrap();
    assert!((gain / truth - 1.0).abs() < 0.01, "{:?} {truth}", found.edge);
    let (low, high) = found.edge.ci95.unwrap();
    assert!(low <= 1.005 * truth && 0.995 * truth <= high.unwrap(), "{:?} {truth}", found.edge);
    assert_eq!((found.at(0.9 * truth).verdict, found.at(1.1 * truth).verdict), (Verdict::Stable, Verdict::Unstable));
    // Law 16: it would oscillate where the phase of L crosses over.
    let graph = linear(0.1);
    let l = |f: f64| {
        let turn = nalgebra::Complex::from_polar(1.0, -std::f64::consts::TAU * f * 1.5 * PERIOD);
        response(&graph, NodeKind::Master, f) * response(&graph, NodeKind::Slave, f) * turn
    };
    let (mut low, mut high) = (40.0, 120.0);
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        if l(middle).im > 0.0 { low = middle } else { high = middle }
    }
    assert!((found.edge.frequency_hz.unwrap() / low - 1.0).abs() < 0.02, "{:?} {low}", found.edge);
}

#[test]
fn a_canceller_that_takes_out_too_little_lifts_the_edge_by_one_over_what_is_left() {
    let bare = live_edge(0.2, 1.0, |_| {});
    for eps in [1.0 / 3.0, 0.1] {
        let lambda = 0.4 * bare;
        let mut graph = shaken(lambda, DITHER, 12.0);
        cancel_with(&mut graph, |model| {
            let measured = model.axes[0].measured;
            model.outputs[measured].gain *= 1.0 - eps;
        });
        let found = answer(&graph, lambda, DITHER);
        let gain = found.edge.gain.unwrap();
        println!("eps {eps:.3}: {:?}, expected {:.4}", found.edge, bare / eps);
        assert!((gain * eps / bare - 1.0).abs() < 0.02, "{:?}", found.edge);
    }
}

#[test]
fn over_cancelling_runs_away_at_the_dc_limit() {
    let lambda = 0.1;
    let mut graph = shaken(lambda, DITHER, 12.0);
    cancel_with(&mut graph, |model| {
        let measured = model.axes[0].measured;
        model.outputs[measured].gain *= 1.3;
    });
    let found = answer(&graph, lambda, DITHER);
    let still = linear(0.1);
    // 1 / [K_e (|Ghat(0)| - |G(0)|)]
    let excess = 0.3 * response(&still, NodeKind::Master, 0.0).re;
    let truth = 1.0 / (excess * -response(&still, NodeKind::Slave, 0.0).re);
    println!("{:?}, expected {truth:.4}", found.edge);
    assert_eq!(found.edge.frequency_hz, Some(0.0), "{:?}", found.edge);
    assert!((found.edge.gain.unwrap() / truth - 1.0).abs() < 0.02, "{:?} {truth}", found.edge);
}

#[test]
fn swapped_parts_are_answered_from_the_record_and_a_model() {
    let bare = live_edge(0.2, 1.0, |_| {});
    let lambda = 0.4 * bare;
    let graph = shaken(lambda, DITHER, 12.0);
    let record = session(&graph, lambda, DITHER);
    // An incomplete canceller over the recorded forces.
    let mut other = linear(lambda);
    cancel_with(&mut other, |model| {
        let measured = model.axes[0].measured;
        model.outputs[measured].gain *= 0.5;
    });
    let Settings::Canceller(canceller, corner, _) = &other.node_of(NodeKind::Canceller).unwrap().settings else { unreachable!() };
    let parts = ExchangedParts { canceller: Some((canceller, *corner, None)), ..ExchangedParts::default() };
    let found = analyse(&record, &Options { parts, ..Options::default() }).unwrap();
    println!("half cancelled: {:?}, expected {:.4}", found.edge, 2.0 * bare);
    assert!((found.edge.gain.unwrap() / (2.0 * bare) - 1.0).abs() < 0.02, "{:?}", found.edge);
    assert_eq!((found.provenance.canceller, found.provenance.master), ("from model", "measured"));
    // Master and slave from their models: the same loop as was recorded.
    let Settings::Master(master) = &graph.node_of(NodeKind::Master).unwrap().settings else { unreachable!() };
    let Settings::Slave(slave) = &graph.node_of(NodeKind::Slave).unwrap().settings else { unreachable!() };
    for parts in [
        ExchangedParts { master: Some(master), ..ExchangedParts::default() },
        ExchangedParts { slave: Some(slave), ..ExchangedParts::default() },
    ] {
        let found = analyse(&record, &Options { parts, ..Options::default() }).unwrap();
        println!("from model: {:?} {:?}, expected {bare:.4}", found.provenance, found.edge);
        assert!((found.edge.gain.unwrap() / bare - 1.0).abs() < 0.02, "{:?}", found.edge);
    }
}
