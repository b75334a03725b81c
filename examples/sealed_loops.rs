//! Loops with a hidden fault: drawn, recorded, asked why they shake, and run again with the first remedy.
//!
//!     cargo run --release --example sealed_loops -- --seed 1 --count 100
//!
//! A case is a loop that is stable, and one fault that makes it oscillate and that its graph does not contain. The fault is more gain, a delay, another
//! hand, a wrong sensor, or an effect in the master. That effect is in the hidden plant of `backdrive-sealed`, not in the plant of this program. The bag
//! holds the graph without the fault, and the analysis sees the bag alone. Every fifth case hides nothing.

use backdrive_bags::{Reader, Recorder};
use backdrive_launch::join::{recorder_options, recording};
use backdrive_nodes::build::{plan, plan_with};
use backdrive_nodes::graph::{Files, Graph, Limits, NodeKind, Overrides};
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::stage::Impairment;
use backdrive_prove::hidden::{Hidden, Opened};
use backdrive_sealed::draw::{DrawOptions, draw};
use backdrive_sealed::network::{Grip, Network};
use backdrive_stability::by_itself::recorded::{Quantity, Recorded};
use backdrive_stability::resimulate::recover::recorded_intents;
use backdrive_stability::resimulate::{Gain, OwnCores, RunOptions};
use backdrive_stability::session::Session;
use backdrive_why::answer::{Answer, Question, why};
use backdrive_why::cause_kind::CauseKind;
use backdrive_why::change::{Change, firmer};
use backdrive_why::faulty::Distortion;
use backdrive_why::happening::Happening;
use backdrive_why::remedy::is_fine;
use backdrive_why::trial::{Hand, Trial};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use toml_edit::{DocumentMut, value};

/// What is hidden, in the order in which cases have it.
const KINDS: [&str; 15] = [
    "gain",
    "delay",
    "grip",
    "nothing",
    "friction",
    "scale",
    "jitter",
    "canceller",
    "inertia",
    "nothing",
    "late sensor",
    "stated delay",
    "sign",
    "backlash",
    "nothing",
];
const MORE: [&str; 5] = ["hysteresis", "coarse", "loss", "over-cancelling", "nothing"];

const LINEAR: &str = "plant/models/impulse-engine-linear.toml";
const WHOLE: &str = "plant/models/impulse-engine.toml";
const NORMAL: &str = "plant/grips/normal.toml";
/// The clock does not decide where several loops are asked about at once.
const PATIENCE: Duration = Duration::from_secs(120);
static NEVER: AtomicBool = AtomicBool::new(false);

/// A hidden loop.
struct Case {
    kind: &'static str,
    declared: Graph,
    truth: Trial,
    right: &'static [CauseKind],
    how: String,
}

fn number(arguments: &[String], key: &str, otherwise: u64) -> u64 {
    arguments.iter().position(|a| a == key).and_then(|i| arguments.get(i + 1)).and_then(|v| v.parse().ok()).unwrap_or(otherwise)
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let (seed, count) = (number(&arguments, "--seed", 1), number(&arguments, "--count", 20) as usize);
    let only = arguments.iter().position(|a| a == "--only").and_then(|i| arguments.get(i + 1)).cloned();
    let folder = std::env::temp_dir().join(format!("sealed-loops-{seed}"));
    std::fs::create_dir_all(&folder).expect("a folder for the bags");
    let kinds: Vec<&'static str> = KINDS.iter().chain(&MORE).copied().collect();
    let mut scores = Scores::default();
    for index in 0..count {
        let kind = kinds[index % kinds.len()];
        if only.as_ref().is_some_and(|o| o != kind) {
            continue;
        }
        let Some(case) = (0..40).find_map(|attempt| drawn(kind, seed, index as u64, attempt)) else {
            println!("{index:3} {kind:<16} could not be drawn");
            continue;
        };
        let bag = folder.join(format!("{index:03}.mcap"));
        record(&case, &bag);
        let began = Instant::now();
        let answer = asked(&bag);
        scores.add(index, &case, &answer, began.elapsed().as_secs_f64());
    }
    scores.tell();
}

/// A loop with a hidden thing; `None` where this draw does not shake because of it.
fn drawn(kind: &'static str, seed: u64, index: u64, attempt: u64) -> Option<Case> {
    let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003) ^ (index << 16) ^ attempt);
    let mut between = |low: f64, high: f64| (random.random::<f64>() * (high / low).ln()).exp() * low;
    let depth = between(1e-3, 3e-3);
    let rate = [5000.0, 5000.0, 2500.0][index as usize % 3];
    let physics = matches!(kind, "friction" | "backlash" | "hysteresis");
    let wall = if index % 4 == 3 { "plant/environments/soft-tissue.toml" } else { "plant/environments/stiff-wall.toml" };
    let cancels =
        physics || matches!(kind, "grip" | "inertia" | "canceller" | "over-cancelling") || (index.is_multiple_of(2) && kind != "gain");
    let (master, model) = match kind {
        "canceller" => (WHOLE, LINEAR),
        _ if physics => (LINEAR, LINEAR),
        _ => (WHOLE, WHOLE),
    };
    let high_pass_hz = if matches!(kind, "over-cancelling" | "grip") { 0.0 } else { 1.0 };
    let path = |p: &str| Some(std::env::current_dir().expect("a folder").join(p));
    let changes = Overrides {
        master: path(master),
        canceller: if cancels { path(model) } else { Some(PathBuf::from("none")) },
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
        "gain" | "canceller" => base_edge * between(1.3, 4.0),
        _ => base_edge * between(0.15, 0.6),
    };
    if lambda > 15.0 && kind == "gain" {
        return None;
    }
    let mut text = text;
    if kind == "stated delay" {
        text = with_delay(&text, between(2e-3, 40e-3));
    }
    let declared = graph(&text, lambda.min(8.0));
    let mut truth = Trial::of(declared.clone());
    let mut how = format!("mu*lambda {:.3}, edge without the fault {base_edge:.3}", declared.gains.lambda);
    let end = |trial: &Trial, kind: NodeKind, port: &str| {
        trial.graph.connections.iter().position(|c| trial.graph.nodes[c.to.0].kind == kind && c.to.1 == port).expect("a connection")
    };
    let impair = |trial: &mut Trial, way: usize, delay_s: f64, jitter_s: f64, loss: f64| {
        trial.graph.connections[way].impairment = Some(Impairment { delay_s, jitter_s, loss, seed: 11 + index });
    };
    let right: &'static [CauseKind] = match kind {
        "gain" => &[CauseKind::GainTooHigh],
        "stated delay" => &[CauseKind::Delay],
        "delay" | "jitter" | "loss" => {
            let ways =
                [(NodeKind::Slave, "command"), (NodeKind::Scaling, "contact"), (NodeKind::Master, "force"), (NodeKind::Scaling, "motion")];
            // Of a slave that moves on by itself lost commands do not show one by one.
            let (node, port) = ways[if kind == "loss" { 1 + (index / 20) as usize % 3 } else { (index / 20) as usize % 4 }];
            let way = end(&truth, node, port);
            let (d, j, l) = match kind {
                "delay" => (between(1e-3, 40e-3), 0.0, 0.0),
                "jitter" => (between(1e-3, 20e-3), between(2e-3, 30e-3), 0.0),
                _ => (0.0, 0.0, between(0.9, 0.99)),
            };
            impair(&mut truth, way, d, j, l);
            how += &format!("; to {port}: {:.1} ms, jitter {:.1} ms, loss {l:.2}", 1e3 * d, 1e3 * j);
            &[CauseKind::Delay, CauseKind::Loss]
        }
        "grip" | "over-cancelling" => {
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
        "canceller" => &[CauseKind::Hysteresis, CauseKind::DryFriction, CauseKind::OtherPhysics],
        "scale" | "sign" | "late sensor" | "coarse" => {
            let at_slave = index % 2 == 1 || kind == "sign";
            let (node, quantity) = if at_slave { ("slave", Quantity::Effort) } else { ("master", Quantity::Position) };
            let mut wrong = Distortion::none(node, quantity, 0);
            match kind {
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
            match kind {
                "scale" => &[CauseKind::ScaledSensor],
                "sign" => &[CauseKind::WrongSign],
                "late sensor" => &[CauseKind::LateSensor, CauseKind::Delay],
                _ => &[CauseKind::CoarseSensor],
            }
        }
        "friction" | "backlash" | "hysteresis" => {
            let (own, said) = sealed(kind, seed.wrapping_add(index * 131 + attempt), rate)?;
            truth.own = Some(own);
            how += &format!("; {said}");
            match kind {
                "friction" => &[CauseKind::DryFriction],
                "backlash" => &[CauseKind::Backlash],
                // A spring with dry friction that slides early is hysteresis by another name.
                _ => &[CauseKind::Hysteresis, CauseKind::DryFriction],
            }
        }
        _ => &[],
    };
    let own = Gain { mu: declared.gains.mu, lambda: declared.gains.lambda };
    let run = truth.run(&hand, own, &RunOptions { keep_signals: true, ..RunOptions::default() }, &NEVER).ok()?;
    let shakes = Happening::of_run(&run).is_trouble() && !is_fine(&truth, &hand, own, &run, &NEVER).ok()?;
    let before = Trial::of(graph(&script(&text, depth, 0.15), declared.gains.lambda));
    let calm = kind == "gain" || kind == "stated delay" || kind == "canceller" || {
        let run = before.run(&hand, own, &RunOptions::default(), &NEVER).ok()?;
        is_fine(&before, &hand, own, &run, &NEVER).ok()?
    };
    let wanted = if kind == "nothing" { run.outcome.is_stable() } else { shakes && calm };
    wanted.then_some(Case { kind, declared, truth, right, how })
}

/// The hand of a graph's own operator.
fn hand_of(graph: &Graph) -> Hand {
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

/// The graph with a delay on the way of the contact force that it states.
fn with_delay(text: &str, delay_s: f64) -> String {
    let mut doc: DocumentMut = text.parse().expect("a graph");
    let ways = doc["connections"].as_array_of_tables_mut().expect("connections");
    for way in ways.iter_mut().filter(|w| w["to"].as_str() == Some("scaling.contact")) {
        let mut impair = toml_edit::InlineTable::new();
        impair.insert("delay_s", delay_s.into());
        way["impair"] = value(impair);
    }
    doc.to_string()
}

/// A hidden plant with one effect of a kind.
fn sealed(kind: &str, seed: u64, rate_hz: f64) -> Option<(OwnCores, String)> {
    let text = |p: &str| std::fs::read_to_string(p).expect("a file");
    let held = Network::from_toml(&text(LINEAR), LINEAR).ok()?.held(&Grip::from_toml(&text(NORMAL), NORMAL).ok()?);
    let options = DrawOptions {
        nonlinear_only: true,
        masked_percent: 0.0,
        grip_percent: 0.0,
        encoder_share: 0.0,
        noise_share: 0.0,
        period_s: 1.0 / rate_hz,
        ..DrawOptions::default()
    };
    let family = |name: &str| match name {
        "backlash" | "rounded_gap" | "contact" => "backlash",
        "hysteretic_spring" | "bouc_wen" | "creep" => "hysteresis",
        "coulomb" | "stribeck" | "dahl" | "lugre" | "asymmetric_coulomb" | "maxwell_slip" | "friction_deficit" | "bristle" => "friction",
        _ => "other",
    };
    for try_seed in 0..60 {
        let Ok(truth) = draw(&held, seed.wrapping_mul(61).wrapping_add(try_seed), &options) else { continue };
        let Some(effect) = truth.effects.first() else { continue };
        if family(effect.physics.name()) != kind {
            continue;
        }
        let hidden = Hidden {
            program: PathBuf::new(),
            model: PathBuf::from(LINEAR),
            grip: Some(PathBuf::from(NORMAL)),
            truth: PathBuf::new(),
            rate_hz,
        };
        let opened = Arc::new(Opened::new(&hidden, &truth).ok()?);
        let own: OwnCores =
            Arc::new(move |graph, node, firmness| (node.kind == NodeKind::Master).then(|| opened.core(graph, node, 1, firmness)));
        return Some((own, format!("{} {:?}", effect.physics.name(), effect.site)));
    }
    None
}

/// Records the hidden loop; the bag holds the graph that was declared.
fn record(case: &Case, bag: &Path) {
    let mut declared = case.declared.clone();
    declared.overwrite = true;
    let graph = &case.truth.graph;
    let own = case.truth.cores();
    let nodes = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder);
    let plans = nodes.map(|n| match own.as_ref().and_then(|own| own(graph, n, 1.0)) {
        Some(cores) => plan_with(graph, &n.name, cores.expect("cores")).expect("a node"),
        None => plan(graph, &n.name).expect("a node"),
    });
    let mut sequence = Sequence::new(plans.collect(), &graph.timing).expect("a loop");
    let (record, header) = recording(&declared, "recorder", None);
    let place: Vec<Option<usize>> = sequence.topics().iter().map(|t| record.topics.iter().position(|r| r.name == t.name)).collect();
    let mut recorder = Recorder::create(bag, &header, &recorder_options(&declared)).expect("a bag");
    sequence.run(
        graph.timing.steps.unwrap_or(1),
        Some(&mut |topic, message| {
            if let Some(place) = place[topic] {
                recorder.push(place, *message, 0).expect("a message");
            }
        }),
    );
    recorder.finish().expect("the end of a bag");
}

/// What is said of a bag by who has nothing else.
fn asked(bag: &Path) -> Answer {
    let reader = Reader::open(bag).expect("a bag");
    let header = reader.header().expect("a graph");
    let graph = Graph::from_text(&header.graph_toml, bag, &Overrides::default(), &Files::Bag(&header.files)).expect("a graph");
    let session = Session::from_bag(&reader, &graph).expect("a session");
    let recorded = Recorded::read(&reader).expect("samples");
    let intents = recorded_intents(&session);
    let gain = Gain { mu: graph.gains.mu, lambda: graph.gains.lambda };
    why(&Question { session: &session, graph: &graph, recorded: &recorded, intents, gain, patience: PATIENCE }, &|_| {}, &NEVER)
        .expect("an answer")
}

#[derive(Default)]
struct Scores {
    asked: usize,
    named: usize,
    stopped: usize,
    edges: usize,
    near: usize,
    nulls: usize,
    alarms: usize,
    boldly: usize,
    seconds: Vec<f64>,
}

impl Scores {
    fn add(&mut self, index: usize, case: &Case, answer: &Answer, seconds: f64) {
        self.seconds.push(seconds);
        let kind = case.kind;
        let first = answer.causes.first();
        if kind == "nothing" {
            self.nulls += 1;
            let alarm = answer.happening.is_trouble() || !answer.differs.is_empty();
            self.alarms += usize::from(alarm);
            println!(
                "{index:3} {kind:<16} {} {seconds:.1} s: {}; {:?}",
                if alarm { "ALARM" } else { "ok   " },
                answer.happens,
                answer.differs
            );
            return;
        }
        self.asked += 1;
        let named = first.is_some_and(|c| case.right.contains(&c.kind));
        self.named += usize::from(named);
        self.boldly += usize::from(!named && first.is_some_and(|c| c.confidence >= 0.8 && c.kind != CauseKind::Unknown));
        let hand = hand_of(&case.truth.graph);
        let own = Gain { mu: case.truth.graph.gains.mu, lambda: case.truth.graph.gains.lambda };
        // What can be done to the real loop: a hidden plant takes no damper, and its friction is not this program's.
        let doable = |c: &Change| !matches!(c, Change::Damping { .. } | Change::FrictionCompensated { .. }) || case.truth.own.is_none();
        let remedy = answer.remedies.iter().find(|r| r.stops && r.changes.iter().all(doable));
        let stopped = remedy.is_some_and(|remedy| {
            let mut again = case.truth.clone();
            remedy.changes.iter().for_each(|c| c.apply(&mut again));
            let lambda = again.graph.gains.lambda;
            again
                .run(&hand, Gain { lambda, ..own }, &RunOptions::default(), &NEVER)
                .is_ok_and(|run| is_fine(&again, &hand, Gain { lambda, ..own }, &run, &NEVER).unwrap_or(false))
        });
        self.stopped += usize::from(stopped);
        let mut unlimited = case.truth.clone();
        if answer.beneath.is_some() {
            Change::NoLimits.apply(&mut unlimited);
        }
        let edge = unlimited.edge(&hand, own.product(), &NEVER).ok().and_then(|e| e.critical_gain);
        let near = match (edge, answer.edge) {
            (Some(a), Some(b)) => (a / b - 1.0).abs() < 0.1,
            (None, None) => true,
            _ => false,
        };
        self.edges += 1;
        self.near += usize::from(near);
        let mark = |good: bool| if good { "ok " } else { "NOT" };
        println!(
            "{index:3} {kind:<16} cause {} remedy {} edge {} {seconds:.1} s: {} | {} | said {:?} {:.2} {} | remedy {} | edge {:?} said {:?} | again {} {:?}",
            mark(named),
            mark(stopped),
            mark(near),
            case.how,
            answer.happens,
            first.map(|c| c.kind),
            first.map_or(0.0, |c| c.confidence),
            first.map_or("", |c| c.evidence.as_str()),
            remedy.map_or("none", |r| r.text.as_str()),
            edge,
            answer.edge,
            answer.reproduced,
            answer.differs,
        );
    }

    fn tell(&mut self) {
        let share =
            |a: usize, b: usize| if b == 0 { String::from("-") } else { format!("{a} of {b} ({:.0} %)", 100.0 * a as f64 / b as f64) };
        self.seconds.sort_by(f64::total_cmp);
        println!("cause named            {}", share(self.named, self.asked));
        println!("first remedy stops it  {}", share(self.stopped, self.asked));
        println!("edge within 10 %       {}", share(self.near, self.edges));
        println!("false alarms           {}", share(self.alarms, self.nulls));
        println!("boldly wrong           {}", share(self.boldly, self.asked));
        println!(
            "seconds, median, most  {:.1} {:.1}",
            self.seconds.get(self.seconds.len() / 2).unwrap_or(&0.0),
            self.seconds.last().unwrap_or(&0.0)
        );
    }
}
