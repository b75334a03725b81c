//! Re-simulation of the graphs in the workspace: known stability limits, clamps, grips, recovered hands.

use super::edge::{Edge, Search, edge};
use super::over_cancelling::{against_none, over_cancelling};
use super::recover::recover_intent;
use super::script::Script;
use super::sweep::{log_grid, sweep};
use super::*;
use crate::outcome::Outcome;
use backdrive_control::operator::Intent;
use backdrive_nodes::graph::{Graph, Hand, Limits, NodeKind, Overrides, Sensors, Settings};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

static NEVER: AtomicBool = AtomicBool::new(false);

fn file(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

fn graph(path: &str, changes: Overrides) -> Graph {
    Graph::load(&file(path), &changes).unwrap()
}

/// Ideal sensors, no limits.
fn ideal(changes: Overrides) -> Overrides {
    Overrides { sensors: Some(Sensors::Ideal), limits: Some(Limits::Ignored), ..changes }
}

/// The linear loop of `tests/common`: linear master with the normal grip, a wall that pushes and pulls, a small bump of the hand.
fn linear(canceller: Option<&str>) -> Scenario {
    let graph = graph(
        "launch/contact.toml",
        ideal(Overrides {
            master: Some(file("plant/models/impulse-engine-linear.toml")),
            environment: Some(file("plant/environments/bilateral-wall.toml")),
            canceller: Some(canceller.map_or("none".into(), file)),
            duration_s: Some(2.0),
            ..Overrides::default()
        }),
    );
    let bump = vec![[0.0, 0.0], [0.02, 1e-4], [0.04, 0.0]];
    Scenario::new(graph, Some(vec![Intent::Waypoints(bump)]), None).unwrap()
}

fn coarse(lowest: f64, highest: f64) -> Search {
    Search { lowest, floor: lowest, highest, per_decade: 8, ..Search::default() }
}

fn find(scenario: &Scenario, search: &Search) -> Edge {
    edge(scenario, search, &RunOptions::default(), &|_, _| {}, &NEVER).unwrap()
}

/// Grip of the canceller scaled, the master's unchanged.
fn assume_grip(scenario: &Scenario, factor: f64) -> Scenario {
    let mut scenario = scenario.clone();
    for node in &mut scenario.graph.nodes {
        if let Settings::Canceller(files, ..) = &mut node.settings {
            grip::scale(files.fragment.as_mut().unwrap(), factor);
        }
    }
    scenario
}

#[test]
fn the_linear_loop_ends_where_its_frequency_response_says() {
    let found = find(&linear(None), &coarse(0.05, 5.0));
    let critical = found.critical_gain.unwrap();
    let (law, law_hz) = phase_crossover(&linear(None), 1.0);
    assert!((law / 0.42 - 1.0).abs() < 0.01 && (law_hz / 71.5 - 1.0).abs() < 0.01, "{law} at {law_hz} Hz");
    assert!((critical / law - 1.0).abs() < 0.02, "{critical} against {law}");
    assert!(found.at_least < critical && found.limited_from.is_none() && found.returns_to_stable.is_none());
    let run = linear(None).run(Gain { mu: 1.0, lambda: 1.02 * critical }, &RunOptions::default(), &NEVER).unwrap();
    let frequency = match run.outcome {
        Outcome::LimitCycle { frequency_hz, .. } => frequency_hz,
        // A growing oscillation has the frequency of its line nevertheless.
        _ => {
            let run =
                linear(None).run(Gain { mu: 1.0, lambda: critical }, &RunOptions { keep_signals: true, ..Default::default() }, &NEVER);
            let signals = run.unwrap().signals.unwrap();
            crate::oscillation::oscillation(&signals.axes[0].master, signals.period_s, 8.0).unwrap().frequency_hz
        }
    };
    assert!((frequency / law_hz - 1.0).abs() < 0.02, "{frequency} Hz against {law_hz} Hz");
}

/// The linear loop's critical gain and its frequency, Hz, from the models' frequency responses. It is where L = G_f H_se e^(-1.5 s T) crosses the
/// positive real axis (one step of delay on F_s, half a step of the force's hold).
fn phase_crossover(scenario: &Scenario, grip_scale: f64) -> (f64, f64) {
    let device = |kind: NodeKind| {
        let (Settings::Master(files) | Settings::Slave(files)) = &scenario.graph.node_of(kind).unwrap().settings else { panic!() };
        let (mut model, mut fragment) = (files.model.clone().unwrap(), files.fragment.clone().unwrap());
        let axis = model.axes[0].clone();
        if kind == NodeKind::Master {
            grip::scale(&mut fragment, grip_scale);
            model.attach(&fragment, axis.user, "port");
            return (model, axis.feedback, axis.measured);
        }
        let attached = model.attach(&fragment, axis.user, "port");
        let force = model.add_port_force(&attached);
        assert_ne!(force, Default::default());
        let output = model.outputs.len() - 1;
        (model, axis.feedback, output)
    };
    let (master, slave) = (device(NodeKind::Master), device(NodeKind::Slave));
    let at = |(model, input, output): &(backdrive_plant::model::Model, usize, usize), hz: f64| {
        let linear = backdrive_plant::linear::LinearModel::new(model, &backdrive_plant::linear::Operating::small()).unwrap();
        linear.response(*input, *output, &[hz]).unwrap()[0]
    };
    // The port force is read against +x, so H_se < 0 is turned here; the phase is that of L.
    let response = |hz: f64| {
        let delay = nalgebra::Complex::from_polar(1.0, -std::f64::consts::TAU * hz * 1.5 * scenario.graph.period_s());
        -at(&master, hz) * at(&slave, hz) * delay
    };
    let (mut low, mut high) = (20.0, 110.0);
    assert!(response(low).im > 0.0 && response(high).im < 0.0, "{} {}", response(low), response(high));
    while high - low > 1e-4 {
        let middle = 0.5 * (low + high);
        if response(middle).im > 0.0 { low = middle } else { high = middle }
    }
    assert!(response(low).re > 0.0);
    (1.0 / response(low).norm(), low)
}

#[test]
fn an_exact_copy_has_no_edge() {
    let found = find(&linear(Some("plant/models/impulse-engine-linear.toml")), &coarse(0.05, 50.0));
    assert_eq!((found.critical_gain, found.at_least, found.outcome_beyond), (None, 50.0, None));
    assert!(found.reason.contains("stable at every gain up to 50"), "{}", found.reason);
}

#[test]
fn a_force_clamp_comes_before_any_oscillation() {
    // The full canceller: nothing oscillates, but the motor's 8.9 N are reached.
    let graph = graph("launch/contact.toml", Overrides { sensors: Some(Sensors::Ideal), ..Overrides::default() });
    let found = find(&Scenario::new(graph, None, None).unwrap(), &coarse(0.2, 20.0));
    assert_eq!(found.critical_gain, None, "{}", found.reason);
    let limited = found.limited_from.unwrap();
    assert!(matches!(found.outcome_beyond, Some(Outcome::Limited { .. })) && found.at_least < limited && limited < 1.01 * found.at_least);
    assert!(found.reason.contains("acts first"), "{}", found.reason);
}

#[test]
fn a_cancelled_sweep_keeps_what_is_done() {
    let (scenario, cancel, done) = (linear(None), AtomicBool::new(false), AtomicUsize::new(0));
    let gains = log_grid(0.05, 0.4, 40);
    let count = |n: usize| {
        done.store(n, Ordering::Relaxed);
        if n >= 5 {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let runs = sweep(&scenario, &gains, &RunOptions::default(), &count, &cancel).unwrap();
    let kept: Vec<&(f64, Run)> = runs.iter().flatten().collect();
    assert!(kept.len() >= 5 && kept.len() < 40, "{} kept", kept.len());
    assert!(runs.iter().zip(&gains).all(|(run, gain)| run.as_ref().is_none_or(|(g, _)| g == gain)));
    assert!(matches!(edge(&scenario, &Search::default(), &RunOptions::default(), &|_, _| {}, &cancel), Err(ResimulateError::Cancelled)));
}

#[test]
fn a_run_is_the_same_as_one_of_the_nodes_and_ignores_scheduled_gains() {
    let mut graph = graph("launch/contact.toml", Overrides { duration_s: Some(1.5), lambda: Some(0.5), ..Overrides::default() });
    let reference = Scenario::new(graph.clone(), None, None).unwrap();
    let options = RunOptions { keep_signals: true, ..RunOptions::default() };
    let once = reference.run(reference.own_gain(), &options, &NEVER).unwrap();
    let intent = once.signals.as_ref().unwrap().axes[0].intent.clone().unwrap();
    // The recorded hand, other gains in between, a guard and a dither: what was recorded does not matter to the answer.
    graph.gains.changes = vec![backdrive_control::scaling::GainChange { at_s: 0.7, mu: 1.0, lambda: 2.0 }];
    for node in &mut graph.nodes {
        if let Settings::Scaling { dither, guard } = &mut node.settings {
            (*dither, *guard) = (vec![vec![0.1, -0.1]], true);
        }
    }
    let rows = intent.iter().map(|x| [*x, 0.0]).collect();
    let shaken = Scenario::new(graph, Some(vec![Intent::Recorded(rows)]), None).unwrap();
    let again = shaken.run(shaken.own_gain(), &options, &NEVER).unwrap();
    let (a, b) = (&once.signals.unwrap(), &again.signals.unwrap());
    assert_eq!(a.len(), 7500);
    assert_eq!(a.axes[0].master, b.axes[0].master);
    assert_eq!(a.axes[0].contact, b.axes[0].contact);
    assert!(b.lambda.iter().all(|l| *l == 0.5) && b.axes[0].contact.iter().any(|f| *f < -1.0));
    // The dither is played where it is wanted.
    let kept = shaken.run(shaken.own_gain(), &RunOptions { keep_dither: true, ..options }, &NEVER).unwrap().signals.unwrap();
    assert_eq!(kept.axes[0].dither.as_ref().unwrap()[..2], [0.1, -0.1]);
    assert_ne!(kept.axes[0].master, b.axes[0].master);
}

#[test]
fn two_axes_run() {
    let graph = graph("launch/two-axis.toml", ideal(Overrides::default()));
    let scenario = Scenario::new(graph, None, None).unwrap();
    let run = scenario.run(scenario.own_gain(), &RunOptions { keep_signals: true, ..RunOptions::default() }, &NEVER).unwrap();
    let signals = run.signals.unwrap();
    assert_eq!((signals.axes.len(), run.outcome), (2, Outcome::Stable));
    assert!(signals.axes.iter().all(|a| a.contact.iter().any(|f| *f < -0.5)), "both walls are touched");
    assert!(run.judged_s > 0.3 && run.contact_s >= run.judged_s);
    let worse = scenario.without_canceller().run(scenario.gain(10.0), &RunOptions::default(), &NEVER).unwrap();
    assert!(worse.is_unstable(), "{:?}", worse.outcome);
}

#[test]
fn a_softer_grip_in_the_model_is_flagged_and_its_limit_exact() {
    // papers.md 13: k_u / 1.5 in the model makes it worse than no canceller.
    let scenario = assume_grip(&linear(Some("plant/models/impulse-engine-linear.toml")), 1.0 / 1.5);
    let told = over_cancelling(&scenario, &[0.7, 1.0, 1.3], None, &RunOptions::default(), &NEVER).unwrap();
    // Servo and wall in series, and 1/k_u_assumed - 1/k_u (papers.md 12), all from the model files.
    let stiffness = 1.0 / (1.0 / 71061.15 + 1.0 / 5000.0);
    assert!((told.environment_stiffness[0] / stiffness - 1.0).abs() < 1e-4, "{:?}", told.environment_stiffness);
    let limit = 1.0 / (stiffness * (1.5 / 400.0 - 1.0 / 400.0));
    let at = |scale: f64| told.balances.iter().find(|b| b.scale == scale).unwrap().dc_limit;
    assert!((at(1.0).unwrap() / limit - 1.0).abs() < 1e-3, "{:?} {limit}", at(1.0));
    // A grip 0.7 times as firm would be softer still than assumed: no limit at DC there... 1/(0.7*400) < 1.5/400.
    assert!(at(1.3).unwrap() < limit && at(0.7).unwrap() > limit);
    assert!(told.warning.as_ref().unwrap().contains("diverges without oscillating"), "{:?}", told.warning);

    let found = find(&scenario, &coarse(0.02, 5.0));
    let against = against_none(&scenario, &found, &coarse(0.02, 5.0), &RunOptions::default(), &|_, _| {}, &NEVER).unwrap().unwrap();
    assert!(against.warning.unwrap().contains("less stable with the canceller"));
    assert!(found.critical_gain.unwrap() < against.without.critical_gain.unwrap());
}

#[test]
fn beyond_the_dc_limit_it_runs_away_and_the_growth_is_told() {
    // 10 % too soft a spring only: the DC limit is all that is left.
    let mut scenario = linear(Some("plant/models/impulse-engine-linear.toml"));
    for node in &mut scenario.graph.nodes {
        if let Settings::Canceller(files, ..) = &mut node.settings {
            files.fragment.as_mut().unwrap().network.set_values_at("elements.spring.stiffness", &[400.0 / 1.1]).unwrap();
        }
    }
    let told = over_cancelling(&scenario, &[1.0], Some(1.3), &RunOptions::default(), &NEVER).unwrap();
    let limit = told.balances[0].dc_limit.unwrap();
    let found = find(&scenario, &coarse(0.05, 10.0));
    assert!((found.critical_gain.unwrap() / limit - 1.0).abs() < 0.03, "{:?} {limit}", found.critical_gain);
    assert!(matches!(told.at_asked[..], [(1.0, Outcome::Unstable { growth_per_s })] if growth_per_s > 0.2), "{:?}", told.at_asked);
    assert!(told.warning.unwrap().contains("per second"));
    // With the exact grip there is nothing to warn of but the firmer ones.
    let exact = linear(Some("plant/models/impulse-engine-linear.toml"));
    let told = over_cancelling(&exact, &grips::SCALES, None, &RunOptions::default(), &NEVER).unwrap();
    assert!(told.balances.iter().filter(|b| b.scale <= 1.0).all(|b| b.dc_limit.is_none()));
    assert!(told.warning.unwrap().contains("15 % stiffer would be"));
    assert!(over_cancelling(&exact, &[0.7, 1.0], None, &RunOptions::default(), &NEVER).unwrap().warning.is_none());
}

#[test]
fn firmer_hands_are_answered_for() {
    let search = coarse(0.1, 2.0);
    let answers = grips::grips(&linear(None), &[0.7, 1.3], Some(0.45), &search, &RunOptions::default(), &|_, _| {}, &NEVER).unwrap();
    for answer in &answers {
        let (law, _) = phase_crossover(&linear(None), answer.scale);
        let critical = answer.edge.critical_gain.unwrap();
        assert!((critical / law - 1.0).abs() < 0.02, "grip times {}: {critical} against {law}", answer.scale);
        assert_eq!(answer.at_asked == Some(Outcome::Stable), 0.45 < law);
    }
    let mut loose = linear(None);
    for node in &mut loose.graph.nodes {
        if let Settings::Master(files) = &mut node.settings {
            files.fragment = None;
        }
    }
    assert!(grips::grips(&loose, &grips::SCALES, None, &search, &RunOptions::default(), &|_, _| {}, &NEVER).unwrap().is_empty());
}

#[test]
fn the_recovered_hand_moves_the_master_as_recorded_and_gives_the_same_edge() {
    let graph =
        graph("launch/contact.toml", Overrides { canceller: Some("none".into()), limits: Some(Limits::Ignored), ..Overrides::default() });
    let scenario = Scenario::new(graph.clone(), None, None).unwrap();
    let run = scenario.run(scenario.own_gain(), &RunOptions { keep_signals: true, ..RunOptions::default() }, &NEVER).unwrap();
    let mut session = run.signals.unwrap();
    let truth = session.axes[0].intent.take().unwrap();
    let recovered = recover_intent(&session, &graph).unwrap();
    let Intent::Recorded(rows) = &recovered.intents[0] else { panic!() };
    let worst = rows.iter().zip(&truth).map(|(r, x)| (r[0] - x).abs()).fold(0.0, f64::max);
    println!("left of x_m {:.4} %, hand within {:.3} mm, still for {:.2} s", recovered.residual[0] * 100.0, worst * 1e3, recovered.still_s);
    assert!(recovered.residual[0] < 0.01, "{:?}", recovered.residual);
    assert!(recovered.still_s > 1.5);
    // 0.144 N of dry friction against the 400 N/m of the grip, and a little for linkage and cable.
    assert!(worst <= recovered.ambiguity[0] && (recovered.ambiguity[0] / (0.144 / 400.0) - 1.0).abs() < 0.15, "{:?}", recovered.ambiguity);
    let search = coarse(0.5, 8.0);
    let own = find(&scenario, &search).critical_gain.unwrap();
    let again = Scenario::new(graph, Some(recovered.intents), None).unwrap();
    let found = find(&again, &search);
    println!("edge with the hand as recorded {own:.3}, as recovered {:?}: {}", found.critical_gain, found.reason);
    assert!((found.critical_gain.unwrap() / own - 1.0).abs() < 0.1, "{own} {:?}", found.critical_gain);
}

#[test]
fn what_cannot_be_run_again_is_said() {
    let no_hand = graph("launch/contact.toml", Overrides { grip: Some("none".into()), duration_s: Some(0.6), ..Overrides::default() });
    let scenario = Scenario::new(no_hand.clone(), None, None).unwrap();
    let run = scenario.run(scenario.own_gain(), &RunOptions { keep_signals: true, ..RunOptions::default() }, &NEVER).unwrap();
    let error = recover_intent(&run.signals.unwrap(), &no_hand).unwrap_err().to_string();
    assert!(error.contains("--grip FILE"), "{error}");
    let identify = graph("launch/identify.toml", Overrides::default());
    assert!(Scenario::new(identify, None, None).unwrap_err().to_string().contains("no scaling node"));
    let own = graph("launch/own-master.toml", Overrides::default());
    assert!(Scenario::new(own, None, None).unwrap_err().to_string().contains("--master FILE"));
    let error = edge(&linear(None), &Search { lowest: -1.0, ..Search::default() }, &RunOptions::default(), &|_, _| {}, &NEVER).unwrap_err();
    assert!(error.to_string().contains("above 0"), "{error}");
    let infinite = Gain { mu: 0.0, lambda: f64::INFINITY };
    assert!(linear(None).run(infinite, &RunOptions::default(), &NEVER).is_err());
}

#[test]
fn another_graph_s_operator_is_a_script() {
    let script = Script::from_graph(&file("launch/own-master.toml")).unwrap();
    let scenario = linear(None).with_script(&script);
    assert_eq!((scenario.duration_s(), scenario.script()), (2.0, "Contact task with a master of one's own"));
    let run = scenario.run(scenario.gain(0.1), &RunOptions { keep_signals: true, ..RunOptions::default() }, &NEVER).unwrap();
    let intent = run.signals.unwrap().axes[0].intent.clone().unwrap();
    assert!(intent.contains(&0.007));
    assert!(Script::from_graph(&file("launch/identify.toml")).is_err());
}

/// The contact script with the exact model in the canceller, its hand as modelled or estimated, no limits.
fn with_hand(path: &str, hand: Hand, canceller: Option<&str>) -> Scenario {
    let (hand, limits) = (Some(hand), Some(Limits::Ignored));
    Scenario::new(graph(path, Overrides { hand, limits, canceller: canceller.map(Into::into), ..Overrides::default() }), None, None)
        .unwrap()
}

#[test]
fn with_the_hand_estimated_five_times_the_gain_without_a_canceller_is_stable_whoever_holds() {
    let outcome = |scenario: &Scenario, grip_scale: f64, gain: f64| {
        let options = RunOptions { grip_scale, ..RunOptions::default() };
        scenario.run(scenario.gain(gain), &options, &NEVER).unwrap().outcome
    };
    // The hand, the path and the gain that are nearest to a limit, or all of them.
    let long = std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1");
    let grips: &[f64] = if long { &[0.5, 1.1, 2.0] } else { &[1.1] };
    let gains: &[f64] = if long { &[0.1, 0.5, 1.5, 2.7, 5.0, 14.0] } else { &[0.5, 14.0] };
    for (path, grips) in [("launch/contact.toml", grips), ("launch/contact-regrip.toml", &[1.0])] {
        let [none, fixed, estimated] = [(Hand::AsModelled, Some("none")), (Hand::AsModelled, None), (Hand::Estimated, None)]
            .map(|(hand, model)| with_hand(path, hand, model));
        for grip in grips {
            // No canceller bears 2.72 at most, with the softest hand.
            assert!(outcome(&none, *grip, 2.9) != Outcome::Stable, "{path}, {grip}");
            assert!(outcome(&fixed, *grip, 2.9) != Outcome::Stable, "{path}, {grip}");
            // Never below no canceller, and far above it.
            for gain in gains {
                let done = outcome(&estimated, *grip, *gain);
                assert_eq!(done, Outcome::Stable, "{path}, grip {grip}, gain {gain}");
            }
        }
    }
}
