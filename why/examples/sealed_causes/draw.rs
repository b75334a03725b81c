//! Loops drawn with hidden faults.

use crate::NEVER;
use backdrive_nodes::graph::{Direction, Files, Graph, Limits, NodeKind, Overrides, Settings};
use backdrive_nodes::stage::Impairment;
use backdrive_plant::elements::{Backlash, Coulomb, Law};
use backdrive_plant::model::{Body, Element, Model};
use backdrive_stability::by_itself::recorded::Quantity;
use backdrive_stability::by_itself::shapes::{Filter, Renewal};
use backdrive_stability::resimulate::{Gain, RunOptions};
use backdrive_why::cause_kind::CauseKind;
use backdrive_why::change::firmer;
use backdrive_why::faulty::{Distortion, Side};
use backdrive_why::happening::Happening;
use backdrive_why::knob::Knob;
use backdrive_why::remedy::is_fine;
use backdrive_why::trial::{Hand, Trial};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, value};

const WHOLE: &str = "plant/models/impulse-engine.toml";
const NORMAL: &str = "plant/grips/normal.toml";

/// A hidden loop.
pub struct Case {
    pub kind: &'static str,
    pub declared: Graph,
    pub truth: Trial,
    /// For each hidden fault the causes that are right.
    pub right: Vec<&'static [CauseKind]>,
    pub how: String,
}

/// A loop with a hidden thing; `None` where this draw does not shake because of it.
pub fn drawn(kind: &'static str, seed: u64, index: u64, attempt: u64) -> Option<Case> {
    let parts: Vec<&'static str> = kind.split('+').collect();
    let has = |what: &str| parts.contains(&what);
    let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003) ^ (index << 16) ^ attempt);
    let mut between = |low: f64, high: f64| (random.random::<f64>() * (high / low).ln()).exp() * low;
    let depth = between(1e-3, 3e-3);
    let rate = if has("low rate") { between(60.0, 300.0) } else { [5000.0, 2500.0, 1000.0, 5000.0][index as usize % 4] };
    let wall = if index % 4 == 3 { "plant/environments/soft-tissue.toml" } else { "plant/environments/stiff-wall.toml" };
    let cancels = ["grip", "inertia"].into_iter().any(has) || (index.is_multiple_of(2));
    let high_pass_hz = if has("grip") { 0.0 } else { 1.0 };
    let path = |p: &str| Some(std::env::current_dir().expect("a folder").join(p));
    let changes = Overrides {
        master: path(WHOLE),
        canceller: if cancels { path(WHOLE) } else { Some(PathBuf::from("none")) },
        canceller_grip: path(NORMAL),
        environment: path(wall),
        high_pass_hz: Some(high_pass_hz),
        lambda: Some(1.0),
        limits: Some(if index % 5 == 4 { Limits::Enforced } else { Limits::Ignored }),
        rate_hz: Some(rate),
        seed: Some(1 + index),
        ..Overrides::default()
    };
    let text = script(&std::fs::read_to_string("launch/contact.toml").expect("the graph"), depth, between(0.08, 0.4));
    let graph = |text: &str, lambda: f64| {
        Graph::from_text(text, Path::new("launch/contact.toml"), &Overrides { lambda: Some(lambda), ..changes.clone() }, &Files::Disk)
            .expect("a graph")
    };
    let base = Trial::of(graph(&text, 1.0));
    let hand = hand_of(&base.graph);
    let edge = |trial: &Trial| trial.edge(&hand, 1.0, &NEVER).ok().and_then(|e| e.critical_gain.or(Some(20.0)));
    let base_edge = edge(&base)?;
    // Well below the critical gain that the loop has without the fault.
    let lambda = match kind {
        // As much as the same loop bears at a high rate.
        "low rate" => {
            let fast = Trial::of(fast_of(&base.graph));
            let bears = fast.edge(&hand_of(&fast.graph), 1.0, &NEVER).ok()?.critical_gain.unwrap_or(20.0);
            bears * between(0.3, 0.7)
        }
        // Play and low-passes of the follower matter near the limit only.
        _ if ["slave play", "slave friction", "low-pass"].into_iter().any(has) => base_edge * between(0.4, 0.9),
        _ => base_edge * between(0.15, 0.6),
    };
    let declared = graph(&text, lambda.min(8.0));
    let mut truth = Trial::of(declared.clone());
    let mut how = format!("mu*lambda {:.3}, edge without the fault {base_edge:.3}", declared.gains.lambda);
    let end = |trial: &Trial, kind: NodeKind, port: &str| {
        trial.graph.connections.iter().position(|c| trial.graph.nodes[c.to.0].kind == kind && c.to.1 == port).expect("a connection")
    };
    let impair = |trial: &mut Trial, way: usize, delay_s: f64, jitter_s: f64, loss: f64| {
        trial.graph.connections[way].impairment = Some(Impairment { delay_s, jitter_s, loss, seed: 11 + index });
    };
    let mut right: Vec<&'static [CauseKind]> = Vec::new();
    for part in parts.iter().copied().filter(|part| *part != "nothing") {
        let causes: &'static [CauseKind] = match part {
            "delay" | "jitter" | "loss" => {
                let ways = [
                    (NodeKind::Slave, "command"),
                    (NodeKind::Scaling, "contact"),
                    (NodeKind::Master, "force"),
                    (NodeKind::Scaling, "motion"),
                ];
                // Of a slave that moves on by itself lost commands do not show one by one.
                let (node, port) = ways[if part == "loss" { 1 + (index / 5) as usize % 3 } else { (index / 5) as usize % 4 }];
                let way = end(&truth, node, port);
                let (d, j, l) = match part {
                    "delay" => (between(1e-3, 40e-3), 0.0, 0.0),
                    "jitter" => (between(1e-3, 20e-3), between(2e-3, 30e-3), 0.0),
                    _ => (0.0, 0.0, between(0.9, 0.99)),
                };
                impair(&mut truth, way, d, j, l);
                how += &format!("; to {port}: {:.1} ms, jitter {:.1} ms, loss {l:.2}", 1e3 * d, 1e3 * j);
                &[CauseKind::Delay, CauseKind::Loss]
            }
            "grip" => {
                let factor = between(1.15, 2.5);
                firmer(&mut truth.graph, factor);
                how += &format!("; grip {factor:.2} times as firm");
                &[CauseKind::Grip, CauseKind::OverCancelling]
            }
            "inertia" => {
                let factor = between(1.3, 4.0);
                for node in truth.graph.nodes.iter_mut().filter(|n| n.kind == NodeKind::Master) {
                    if let backdrive_nodes::graph::Settings::Master(files) = &mut node.settings {
                        for body in files.model.iter_mut().flat_map(|m| m.bodies.iter_mut()) {
                            body.inertia *= factor;
                        }
                    }
                }
                how += &format!("; masses times {factor:.2}");
                &[CauseKind::Inertia]
            }
            "scale" | "sign" | "late sensor" | "coarse" => {
                let at_slave = index % 2 == 1 || part == "sign";
                let (node, quantity) = if at_slave { ("slave", Quantity::Effort) } else { ("master", Quantity::Position) };
                let mut wrong = Distortion::none(node, quantity, 0);
                match part {
                    "scale" => wrong.gain = if at_slave { between(1.5, 8.0) } else { between(1.3, 3.0) },
                    "sign" => wrong.gain = -1.0,
                    "late sensor" => wrong.late = (between(1e-3, 40e-3) * rate) as usize,
                    _ => {
                        wrong.node = "master".to_string();
                        wrong.quantity = Quantity::Position;
                        wrong.step = between(2e-5, 1e-3);
                    }
                }
                how += &format!("; {}: gain {:.2}, late {}, step {:.1e}", wrong.node, wrong.gain, wrong.late, wrong.step);
                truth.distortions.push(wrong);
                match part {
                    "scale" => &[CauseKind::ScaledSensor],
                    "sign" => &[CauseKind::WrongSign],
                    "late sensor" => &[CauseKind::LateSensor, CauseKind::Delay],
                    _ => &[CauseKind::CoarseSensor],
                }
            }
            "held" => {
                let hz = between(15.0, 60.0);
                let mut held = Distortion::none("scaling", Quantity::Position, 0);
                held.stage = NodeKind::Scaling.port("command", Direction::Output)?.0;
                held.hold = Some(Renewal { rows: rate / hz, phase: 0.0 });
                truth.distortions.push(held);
                how += &format!("; commands held at {hz:.1} Hz");
                &[CauseKind::Rate]
            }
            "low-pass" => {
                let (order, corner_hz) = (1 + index as usize % 2, between(8.0, 60.0));
                let filter = Some(Filter { order, corner_hz });
                if index % 4 < 2 {
                    truth.distortions.push(Distortion { filter, ..Distortion::none("slave", Quantity::Effort, 0) });
                } else {
                    let stage = NodeKind::Master.port("force", Direction::Input)?.0;
                    let side = Side::Input(1);
                    truth.distortions.push(Distortion { stage, side, filter, ..Distortion::none("master", Quantity::Effort, 0) });
                }
                how += &format!("; low-pass of order {order} at {corner_hz:.1} Hz");
                &[CauseKind::FilterLag]
            }
            "torque" => {
                let factor = between(1.3, 3.0);
                Knob::Motor.apply(&mut truth, "master", factor);
                how += &format!("; torque constant times {factor:.3}");
                &[CauseKind::TorqueConstant]
            }
            "motor lag" => {
                let corner_hz = between(8.0, 60.0);
                Knob::MotorLag.apply(&mut truth, "master", 1.0 / (std::f64::consts::TAU * corner_hz));
                how += &format!("; motor behind a low-pass of {corner_hz:.1} Hz");
                &[CauseKind::FilterLag]
            }
            "servo" => {
                let factor = between(0.02, 0.4);
                Knob::Servo.apply(&mut truth, "slave", factor);
                how += &format!("; servo times {factor:.3}");
                &[CauseKind::Servo]
            }
            "wall" => {
                let factor = between(1.5, 10.0);
                Knob::Wall.apply(&mut truth, "slave", factor);
                how += &format!("; wall times {factor:.3}");
                &[CauseKind::Environment]
            }
            "slave play" => {
                let gap = between(3e-4, 2e-3);
                slave_of(&mut truth, |model| play(model, gap));
                how += &format!("; {:.2} mm of play in the slave's drive", 1e3 * gap);
                &[CauseKind::Backlash]
            }
            "slave friction" => {
                let force = between(2.0, 20.0);
                slave_of(&mut truth, |model| rub(model, force));
                how += &format!("; {force:.1} N of dry friction at the slave's tip");
                &[CauseKind::DryFriction]
            }
            "encoder sign" => {
                truth.distortions.push(Distortion { gain: -1.0, ..Distortion::none("master", Quantity::Position, 0) });
                how += "; the sign of the master's encoder";
                &[CauseKind::WrongSign]
            }
            "low rate" => {
                how += &format!("; {rate:.0} Hz");
                &[CauseKind::Rate]
            }
            _ => &[],
        };
        right.push(causes);
    }
    let own = Gain { mu: declared.gains.mu, lambda: declared.gains.lambda };
    let run = truth.run(&hand, own, &RunOptions { keep_signals: true, ..RunOptions::default() }, &NEVER).ok()?;
    let shakes = Happening::of_run(&run).is_trouble() && !is_fine(&truth, &hand, own, &run, &NEVER).ok()?;
    let before = Trial::of(graph(&script(&text, depth, 0.15), declared.gains.lambda));
    let calm = has("low rate") || {
        let run = before.run(&hand, own, &RunOptions::default(), &NEVER).ok()?;
        is_fine(&before, &hand, own, &run, &NEVER).ok()?
    };
    // A loop whose encoder is turned round may leave the wall instead of shaking at it.
    let wanted = if has("nothing") { run.outcome.is_stable() } else { (shakes || has("encoder sign")) && calm };

    wanted.then_some(Case { kind, declared, truth, right, how })
}

/// The hand of a graph's own operator.
pub fn hand_of(graph: &Graph) -> Hand {
    Hand { intents: None, steps: graph.timing.steps.unwrap_or(1), rate_hz: graph.timing.rate_hz }
}

/// The contact script with another depth and speed of the push.
fn script(text: &str, depth: f64, quick: f64) -> String {
    let mut doc: DocumentMut = text.parse().expect("a graph");
    let nodes = doc["nodes"].as_array_of_tables_mut().expect("nodes");
    for node in nodes.iter_mut().filter(|n| n["kind"].as_str() == Some("operator")) {
        let points = [(0.2, 0.0), (0.6, 0.003), (0.8, 0.003), (0.8 + quick, 0.005 + depth), (3.0, 0.005 + depth), (3.4, 0.0)];
        let mut all = toml_edit::Array::new();
        for (t, x) in points {
            let mut point = toml_edit::InlineTable::new();
            point.insert("t", t.into());
            point.insert("x", x.into());
            all.push(point);
        }
        node["waypoints"] = value(all);
    }
    doc.to_string()
}

/// The same loop at 5 kHz.
fn fast_of(graph: &Graph) -> Graph {
    let mut fast = Trial::of(graph.clone());
    backdrive_why::change::Change::Rate { hz: 5000.0 }.apply(&mut fast);
    fast.graph
}

fn slave_of(truth: &mut Trial, change: impl Fn(&mut Model)) {
    for node in &mut truth.graph.nodes {
        if let Settings::Slave(files) = &mut node.settings {
            files.model.iter_mut().for_each(&change);
        }
    }
}

/// Play between a drive of three tenths of the mass and the rest of it at the tip.
fn play(model: &mut Model, gap: f64) {
    let Some(tip) = model.axes.first().map(|axis| axis.user) else { return };
    let motor = model.bodies.len();
    let mass = model.bodies[tip].inertia;
    model.bodies.push(Body { name: "motor".to_string(), inertia: 0.3 * mass });
    model.bodies[tip].inertia = 0.7 * mass;
    for element in &mut model.elements {
        element.between.iter_mut().filter(|end| **end == Some(tip)).for_each(|end| *end = Some(motor));
    }
    let law = Law::Backlash(Backlash { gap, stiffness: 2e5, damping: 40.0, rounding: 0.0 });
    model.elements.push(Element { name: "gear".to_string(), between: [Some(motor), Some(tip)], law });
}

/// Dry friction between the tip and the ground.
fn rub(model: &mut Model, force: f64) {
    let Some(tip) = model.axes.first().map(|axis| axis.user) else { return };
    let law = Law::Coulomb(Coulomb { force });
    model.elements.push(Element { name: "rail".to_string(), between: [Some(tip), None], law });
}
