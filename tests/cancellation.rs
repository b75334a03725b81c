//! The laws of cancellation on the running graph: checks 10, 11, 12, 14 and 16 of the paper notes.

mod common;

use backdrive_nodes::graph::{NodeKind, Overrides};
use common::{cancel_with, contact, edge, file, growth, linear, response, run};

const PERIOD: f64 = 1.0 / 5000.0;

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Critical gain of the uncancelled linear loop, and the frequency at which it then oscillates.
fn uncancelled() -> f64 {
    edge(0.05, 5.0, 2e-4, |lambda| growth(&run(&linear(lambda)).contact, PERIOD) > 0.0)
}

#[test]
fn check_10_an_exact_copy_makes_the_command_independent_of_the_force() {
    let mut free = linear(5.0);
    cancel_with(&mut free, |_| {});
    let mut walled = free.clone();
    // The same hand against a wall and in free space: the command must not know.
    let open = contact(Overrides { environment: Some("none".into()), ..Overrides::default() });
    let slave = open.nodes.iter().find(|n| n.kind == NodeKind::Slave).unwrap().clone();
    *free.nodes.iter_mut().find(|n| n.kind == NodeKind::Slave).unwrap() = slave;
    walled.gains.lambda = 5.0;
    let (free, walled) = (run(&free), run(&walled));
    assert!(rms(&walled.force) > 0.1, "the force must act: {}", rms(&walled.force));
    assert!(rms(&walled.induced) > 0.1 * rms(&walled.command), "and move the master: {}", rms(&walled.induced));
    let difference: Vec<f64> = walled.command.iter().zip(&free.command).map(|(a, b)| a - b).collect();
    let ratio = rms(&difference) / rms(&walled.command);
    println!("check 10: rms ratio {ratio:.1e}");
    assert!(ratio < 1e-9, "{ratio}");
}

#[test]
fn check_11_under_estimating_multiplies_the_critical_gain_by_one_over_epsilon() {
    let base = uncancelled();
    println!("check 11: uncancelled linear loop: critical mu*lambda {base:.4}");
    for epsilon in [1.0 / 3.0, 0.1, 0.05] {
        let critical = edge(0.8 * base / epsilon, 1.25 * base / epsilon, 1e-4, |lambda| {
            let mut graph = linear(lambda);
            cancel_with(&mut graph, |model| model.inputs[0].gain *= 1.0 - epsilon);
            growth(&run(&graph).contact, PERIOD) > 0.0
        });
        let factor = critical / base;
        println!("check 11: epsilon {epsilon:.4}: factor {factor:.4}, law {:.4}", 1.0 / epsilon);
        assert!((factor * epsilon - 1.0).abs() < 1e-3, "epsilon {epsilon}: {factor}");
    }
}

#[test]
fn check_12_over_estimating_runs_away_at_the_dc_limit() {
    let excess = 0.1;
    let graph = linear(1.0);
    let (g, h) = (response(&graph, NodeKind::Master, 1e-3).norm(), response(&graph, NodeKind::Slave, 1e-3).norm());
    let law = 1.0 / (h * excess * g);
    let critical = edge(0.8 * law, 1.25 * law, 1e-3, |lambda| {
        let mut graph = linear(lambda);
        graph.timing.steps = Some(30_000);
        cancel_with(&mut graph, |model| model.inputs[0].gain *= 1.0 + excess);
        growth(&run(&graph).contact, PERIOD) > 0.0
    });
    println!("check 12: critical {critical:.4}, law {law:.4}");
    assert!((critical / law - 1.0).abs() < 0.01, "{critical} against {law}");
}

#[test]
fn check_14_three_cancellers_in_the_linear_loop() {
    let base = uncancelled();
    let second = edge(base, 10.0 * base, 1e-3, |lambda| {
        let mut graph = linear(lambda);
        let reduced = contact(Overrides { canceller: Some(file("plant/models/impulse-engine-second-order.toml")), ..Overrides::default() });
        let settings = reduced.node_of(NodeKind::Canceller).unwrap().settings.clone();
        graph.nodes.iter_mut().find(|n| n.kind == NodeKind::Canceller).unwrap().settings = settings;
        growth(&run(&graph).contact, PERIOD) > 0.0
    });
    let mut exact = linear(50.0);
    cancel_with(&mut exact, |_| {});
    let sixth = growth(&run(&exact).contact, PERIOD);
    println!(
        "check 14, linear: none {base:.4}; second order {second:.4}, {:.2} times; sixth order at 50: growth {sixth:.2}/s",
        second / base
    );
    assert!(second > 1.4 * base);
    assert!(sixth < 0.0, "an exact copy has no finite limit");
}

#[test]
fn check_16_the_edge_oscillates_at_the_phase_crossover_of_the_loop() {
    let critical = uncancelled();
    let signals = run(&linear(critical));
    let found = backdrive_stability::oscillation::oscillation(&signals.contact[signals.contact.len() / 4..], PERIOD, 10.0).unwrap();
    let graph = linear(critical);
    // One step of delay on F_s, and half a step of the force's hold; L has no other sign change: H_se is negative real at DC.
    let phase = |hz: f64| {
        let delay = nalgebra::Complex::from_polar(1.0, -2.0 * std::f64::consts::PI * hz * 1.5 * PERIOD);
        response(&graph, NodeKind::Master, hz) * response(&graph, NodeKind::Slave, hz) * delay
    };
    // L crosses the positive real axis at |L| = 1/(mu lambda): positive feedback, for L = x_m -> F_f.
    let crossover = edge(20.0, 100.0, 1e-5, |hz| phase(hz).im < 0.0);
    let law = 1.0 / phase(crossover).norm();
    println!("check 16: oscillates at {:.2} Hz, crossover {crossover:.2} Hz; critical {critical:.4}, 1/|L| {law:.4}", found.frequency_hz);
    assert!((found.frequency_hz / crossover - 1.0).abs() < 0.02);
    assert!((critical / law - 1.0).abs() < 0.02, "{critical} against {law}");
}

#[test]
fn check_14_on_the_nonlinear_graph_a_better_model_is_stable_at_a_higher_gain() {
    // The friction of the device hides the stability limit: it is the limit of the contact script, by the product's own verdict.
    let beyond = |canceller: &str, lambda: f64| {
        let canceller = if canceller == "none" { "none".into() } else { file(canceller) };
        let graph = contact(Overrides { canceller: Some(canceller), lambda: Some(lambda), ..Overrides::default() });
        run(&graph).outcome(PERIOD) != backdrive_stability::outcome::Outcome::Stable
    };
    let critical = |canceller: &str| {
        let gains: Vec<f64> = (0..=24).map(|i| 0.1 * 500_f64.powf(i as f64 / 24.0)).collect();
        gains.into_iter().find(|lambda| beyond(canceller, *lambda)).unwrap_or(f64::INFINITY)
    };
    let none = critical("none");
    let linear = critical("plant/models/impulse-engine-linear.toml");
    let second = critical("plant/models/impulse-engine-second-order.toml");
    let full = critical("plant/models/impulse-engine.toml");
    println!("check 14, nonlinear: none {none:.3}, second order {second:.3}, sixth linear {linear:.3}, sixth nonlinear {full:.3}");
    assert!(full > none && full > linear && full > second);
}
