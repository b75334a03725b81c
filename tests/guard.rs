//! The guard and the live margin on the contact graph: what is stable is left alone, what is not is bounded and ends stable.

mod common;

use backdrive_control::operator::Intent;
use backdrive_msgs::{Message, margin};
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use backdrive_nodes::sequence::Sequence;
use backdrive_stability::judgement::judge;
use backdrive_stability::outcome::{Outcome, Trace};
use common::{contact, file};

const PERIOD: f64 = 1.0 / 5000.0;
const DITHER: &str = "multisine:peak=0.05,from=1,to=500,period=2";

/// A loop, and the gain at which it stops being stable (see examples/critical_gains.rs; the firm grip found the same way).
struct Case {
    what: &'static str,
    master: &'static str,
    canceller: Option<&'static str>,
    grip: &'static str,
    environment: &'static str,
    edge: f64,
}

const NONLINEAR: &str = "plant/models/impulse-engine.toml";
const LINEAR: &str = "plant/models/impulse-engine-linear.toml";

const fn case(what: &'static str, master: &'static str, canceller: Option<&'static str>, grip: &'static str, edge: f64) -> Case {
    Case { what, master, canceller, grip, environment: "plant/environments/stiff-wall.toml", edge }
}

const NORMAL: &str = "plant/grips/normal.toml";
const FIRM: &str = "plant/grips/firm.toml";

const UNCANCELLED: Case = case("nonlinear, nothing cancelled", NONLINEAR, None, NORMAL, 2.1);
const LINEAR_LOOP: Case = case("linear, nothing cancelled", LINEAR, None, NORMAL, 0.59);
const SIXTH: Case = case("nonlinear, sixth order linear canceller", NONLINEAR, Some(LINEAR), NORMAL, 0.40);
const OVER: Case = case("over-cancelled: firm grip, canceller for the normal one", NONLINEAR, Some(NONLINEAR), FIRM, 0.115);
const OVER_LINEAR: Case = case("over-cancelled by the linear canceller", NONLINEAR, Some(LINEAR), FIRM, 0.115);

impl Case {
    fn graph(&self, share: f64, dither: bool) -> Graph {
        contact(Overrides {
            master: Some(file(self.master)),
            canceller: Some(self.canceller.map_or("none".into(), file)),
            grip: Some(file(self.grip)),
            environment: Some(file(self.environment)),
            lambda: Some(share * self.edge),
            guard: Some(true),
            dither: dither.then(|| DITHER.into()),
            ..Overrides::default()
        })
    }
}

/// The same push held for longer, so that a loop near its stability limit has rung down.
fn held(mut graph: Graph) -> Graph {
    for node in &mut graph.nodes {
        if let Settings::Operator(intents) = &mut node.settings {
            *intents = vec![Intent::Waypoints(vec![[0.2, 0.0], [0.6, 0.003], [0.8, 0.003], [0.95, 0.007], [6.0, 0.007], [6.4, 0.0]])];
        }
    }
    graph.timing.steps = Some((7.0 / PERIOD) as u64);
    graph
}

fn unguarded(graph: &mut Graph) {
    for node in &mut graph.nodes {
        if let Settings::Scaling { guard, .. } = &mut node.settings {
            *guard = false;
        }
    }
}

#[derive(Default)]
struct Guarded {
    /// Time, s, name and value of every back-off.
    acts: Vec<(f64, String, f64)>,
    margins: Vec<backdrive_msgs::Margin>,
    trace: Trace,
    lambda: f64,
}

fn run(graph: &Graph) -> Guarded {
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name).unwrap()).collect();
    let mut sequence = Sequence::new(plans, &graph.timing).unwrap();
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let mut done = Guarded { trace: Trace { period_s: PERIOD, ..Trace::default() }, ..Guarded::default() };
    let mut take = |topic: usize, message: &Message| match (names[topic].as_str(), message) {
        ("/operator/setpoint_js", Message::Sample(s)) => done.trace.intent.push(s.position[0]),
        ("/master/measured_js", Message::Sample(s)) => {
            done.trace.position.push(s.position[0]);
            done.trace.feedback.push(s.effort[0]);
            done.trace.clamped.push(false);
        }
        ("/slave/measured_js", Message::Sample(s)) => done.trace.contact.push(s.effort[0]),
        ("/scaling/events", Message::Event(e)) => done.acts.push((e.step as f64 * PERIOD, e.kind.as_str().to_string(), e.value)),
        (_, Message::Margin(m)) => done.margins.push(*m),
        (_, Message::Gains(g)) => done.lambda = g.lambda,
        _ => {}
    };
    sequence.run(graph.timing.steps.unwrap(), Some(&mut take));
    done
}

impl Guarded {
    fn peak(&self) -> f64 {
        self.trace.position.iter().fold(0.0, |m, x| m.max(x.abs()))
    }

    /// The verdict on the last second of the push and on the release.
    fn end(&self) -> Outcome {
        let from = (2.0 / PERIOD) as usize;
        judge(&Trace {
            period_s: PERIOD,
            intent: self.trace.intent[from..].to_vec(),
            position: self.trace.position[from..].to_vec(),
            contact: self.trace.contact[from..].to_vec(),
            feedback: self.trace.feedback[from..].to_vec(),
            clamped: self.trace.clamped[from..].to_vec(),
            ..Trace::default()
        })
    }
}

#[test]
fn a_stable_loop_is_left_alone() {
    let soft = |case: Case| Case { environment: "plant/environments/soft-tissue.toml", ..case };
    // This wall's stiffness grows with the force: its critical gain is lower.
    let hard = |case: Case| Case { environment: "plant/environments/hunt-crossley-wall.toml", edge: 0.7 * case.edge, ..case };
    for case in
        [UNCANCELLED, LINEAR_LOOP, SIXTH, OVER, OVER_LINEAR, soft(UNCANCELLED), soft(LINEAR_LOOP), hard(UNCANCELLED), hard(LINEAR_LOOP)]
    {
        for share in [0.3, 0.6, 0.9] {
            let done = run(&case.graph(share, false));
            assert!(done.acts.is_empty(), "{}, {} at {share} of the edge: {:?}", case.what, case.environment, done.acts);
            assert!(done.trace.contact.iter().any(|f| *f < -0.05), "nothing was touched");
        }
    }
    // Also with a dither, which itself makes the force oscillate; above half of the critical gain the margin may be thin.
    for case in [UNCANCELLED, LINEAR_LOOP, SIXTH, OVER] {
        for share in [0.3, 0.6] {
            let done = run(&case.graph(share, true));
            assert!(done.acts.is_empty(), "{} with a dither at {share} of the edge: {:?}", case.what, done.acts);
        }
    }
}

#[test]
fn a_loop_far_below_the_edge_of_a_good_canceller_is_left_alone() {
    let full = case("nonlinear, full canceller", NONLINEAR, Some(NONLINEAR), NORMAL, 50.0);
    for share in [0.01, 0.02, 0.04, 0.1] {
        let done = run(&full.graph(share, false));
        assert!(done.acts.is_empty(), "{share}: {:?}", done.acts);
    }
}

#[test]
fn beyond_the_edge_the_motion_is_bounded_and_ends_stable() {
    // Bounds of the master's motion: without the guard it oscillates by up to 1 mm (uncancelled) or leaves all bounds (over-cancelled).
    for (case, bound) in [(UNCANCELLED, 0.007), (LINEAR_LOOP, 0.007), (OVER, 0.03), (OVER_LINEAR, 0.03)] {
        for share in [1.2, 2.0, 5.0] {
            let graph = case.graph(share, false);
            let done = run(&graph);
            let acts: Vec<String> = done.acts.iter().map(|(t, kind, lambda)| format!("{t:.2} s {kind} -> {lambda:.3}")).collect();
            println!(
                "{} at {share} of the edge: peak {:.1} mm, ends at lambda {:.3}: {}",
                case.what,
                done.peak() * 1e3,
                done.lambda,
                acts.join(", ")
            );
            assert!(done.peak() < bound, "{} at {share}: {} m", case.what, done.peak());
            assert_eq!(done.end(), Outcome::Stable, "{} at {share}", case.what);
            let is_over = case.grip == FIRM;
            assert!(!is_over || done.acts.iter().any(|(_, kind, _)| kind == "guard_runaway"), "{} at {share}: {acts:?}", case.what);
            assert!(share < 2.0 || !done.acts.is_empty(), "{} at {share}: it did nothing", case.what);
            // It never raises the gain by itself.
            assert!(done.acts.windows(2).all(|w| w[1].2 < w[0].2), "{acts:?}");
            assert!(done.acts.last().is_none_or(|(_, _, told)| (done.lambda / told - 1.0).abs() < 1e-3), "{} {acts:?}", done.lambda);
        }
    }
}

#[test]
fn the_live_margin_says_where_the_edge_of_the_linear_loop_is() {
    // The loop in contact is linear: its critical gain by bisection, from a run without guard and dither.
    let runs = |lambda: f64| {
        let mut graph = LINEAR_LOOP.graph(lambda / LINEAR_LOOP.edge, false);
        unguarded(&mut graph);
        run(&graph).end() != Outcome::Stable
    };
    let edge = common::edge(0.3, 1.0, 0.01, runs);
    for share in [0.4, 0.6, 0.8] {
        let mut graph = held(LINEAR_LOOP.graph(share * edge / LINEAR_LOOP.edge, true));
        unguarded(&mut graph);
        let done = run(&graph);
        let known: Vec<_> = done.margins.iter().filter(|m| m.known == margin::KNOWN).collect();
        let last = known.last().unwrap_or_else(|| panic!("{share}: never known"));
        println!(
            "at {share} of the edge {edge:.3}: known from {:.2} s; {:.2}x +-{:.0} % at {:.1} Hz",
            known[0].step as f64 * PERIOD,
            last.factor,
            last.deviation * 100.0,
            last.frequency_hz
        );
        assert!((last.factor * share).ln().abs() < 0.1 + 2.0 * last.deviation, "{share}: {last:?}");
        for m in &done.margins {
            let t = m.step as f64 * PERIOD;
            assert!((0.8..=6.5).contains(&t) || m.known == margin::FREE, "{t}: {m:?}");
            assert!(m.known == margin::KNOWN || m.known == margin::ABOVE || m.factor.is_nan(), "{m:?}");
            assert!(m.known != margin::ABOVE || m.factor * share < 1.1, "{t}: above {} at {share}", m.factor);
        }
    }
}

#[test]
fn without_a_dither_no_margin_is_told_but_what_rings_is() {
    let done = run(&LINEAR_LOOP.graph(0.85, false));
    assert_eq!(done.margins.len(), 40);
    assert!(done.margins.iter().all(|m| m.known == margin::NO_DITHER && m.factor.is_nan()));
    let rings: Vec<f64> = done.margins.iter().map(|m| m.decay_per_s).filter(|d| !d.is_nan()).collect();
    println!("{rings:?}");
    assert!(!rings.is_empty() && rings[0] > 0.0, "the impact rings down: {rings:?}");
}

#[test]
fn a_thin_margin_is_widened_before_the_loop_shakes() {
    let done = run(&held(LINEAR_LOOP.graph(0.9, true)));
    println!("{:?}", done.acts);
    let first = done.acts.first().expect("it acts");
    assert_eq!(first.1, "guard_thin_margin");
    let last = done.margins.iter().rev().find(|m| m.known == margin::KNOWN).unwrap();
    assert!(last.factor > 1.25, "{last:?}");
    assert!(done.acts.len() <= 2, "it hunts: {:?}", done.acts);
}

#[test]
fn a_guarded_push_and_hold_tells_its_margin_while_it_touches() {
    let changes = Overrides { guard: Some(true), ..Overrides::default() };
    let graph = Graph::load(&file("launch/push-and-hold.toml"), &changes).unwrap();
    let done = run(&graph);
    // In contact from 0.89 s on, with a knock at 10 s; an answer needs three windows of 0.6 s.
    let held: Vec<_> = done.margins.iter().filter(|m| (2.5..9.9).contains(&(m.step as f64 * PERIOD))).collect();
    let told = held.iter().filter(|m| m.known == margin::KNOWN || m.known == margin::ABOVE).count();
    println!("{told} of {}", held.len());
    assert!(held.len() > 70 && 10 * told >= 6 * held.len(), "{told} of {}", held.len());
    assert!(held.iter().all(|m| m.known != margin::FREE), "it touches");
    // The critical gain of this loop by bisection is 2.1: no known margin or bound is above it by more than its own uncertainty.
    for m in held.iter().filter(|m| !m.factor.is_nan()) {
        let sd = if m.deviation.is_nan() { 0.0 } else { m.deviation };
        println!("{:.1} {} {:.2} {:.2}", m.step as f64 * PERIOD, m.known, m.factor, sd);
    }
}
