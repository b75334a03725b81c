//! Work whose instructions are counted: `.ci/counts` runs each of these under callgrind and compares with benches/counts.toml.
//!
//!     cargo run --release --example counted -- step 20000
//!
//! Takes the name of a counter, and how often its unit is done. A new one is a line in `COUNTERS` and a table in benches/counts.toml.

use backdrive_bags::{BagHeader, Recorder, RecorderOptions, TopicInfo, WhenFull};
use backdrive_diagnosis::output_error::effort::Effort;
use backdrive_diagnosis::output_error::evaluator::Evaluator;
use backdrive_diagnosis::output_error::structure::Structure;
use backdrive_diagnosis::recordings::problem::{Problem, Record};
use backdrive_msgs::topic::{Kind, Topic};
use backdrive_msgs::{Message, Sample};
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Sensors};
use backdrive_nodes::sequence::Sequence;
use backdrive_nodes::transport::iceoryx2::Iceoryx2;
use backdrive_nodes::transport::{Location, Transport};
use backdrive_plant::model::Model;
use backdrive_plant::recording::Recording;
use backdrive_plant::set::Initial;
use backdrive_plant::stepper::{Options, Plant, Segment, simulate};
use std::fmt::Write;
use std::io::Cursor;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

type Work = fn(usize) -> f64;

/// By name; each gives a number that depends on all of its work.
const COUNTERS: &[(&str, Work)] =
    &[("step", step), ("chain", chain), ("simulate", simulated), ("fit", fit), ("record", record), ("hop", hop)];

fn at(path: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A step of the nonlinear loop of the contact task, in one thread with ideal sensors.
fn step(count: usize) -> f64 {
    let ideal = Overrides { sensors: Some(Sensors::Ideal), ..Overrides::default() };
    let graph = Graph::load(&at("launch/contact.toml"), &ideal).expect("the contact graph is part of the workspace");
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(&graph, &n.name).expect("builds")).collect();
    let mut sequence = Sequence::new(plans, &graph.timing).expect("has no loop");
    sequence.run(count as u64, None);
    (0..sequence.topics().len()).filter_map(|t| sequence.sample(t)).map(|s| s.position[0]).filter(|x| x.is_finite()).sum()
}

/// A step of a chain of 64 bodies with 16 friction contacts.
fn chain(count: usize) -> f64 {
    let mut text = String::from("name = 'chain'\n[bodies]\n");
    (0..64).for_each(|i| writeln!(text, "b{i} = 0.05").expect("a string"));
    for i in 1..64 {
        let ends = format!("between = ['b{}', 'b{i}']", i - 1);
        writeln!(text, "[[elements]]\nkind = 'spring'\n{ends}\nstiffness = 2000\n[[elements]]\nkind = 'damper'\n{ends}\ndamping = 0.3")
            .expect("a string");
    }
    (0..16).for_each(|c| {
        writeln!(text, "[[elements]]\nkind = 'coulomb'\nbetween = ['b{}', 'ground']\nforce = 0.05", 4 * c).expect("a string")
    });
    text += "[[inputs]]\nname = 'push'\nkind = 'force'\non = 'b63'\nhold = 'linear'\n[[outputs]]\nname = 'end'\nkind = 'position'\nof = 'b63'\n";
    let model = Model::from_toml(&text, "chain").expect("a model");
    let mut plant = Plant::new(&model, 5e-4, &Options { substeps: Some(1), ..Options::default() }).expect("compiles");
    let force = |i: usize| 2.0 * (7.5e-3 * i as f64).sin();
    for i in 0..count {
        plant.step(&[Segment::line(force(i), force(i + 1), 5e-4)]);
    }
    plant.position(63)
}

/// A sample of a simulation as diagnosis and fit make them: the ball screw at 1 kHz.
fn simulated(count: usize) -> f64 {
    let model = Model::load(&at("plant/models/ball-screw.toml")).expect("part of the workspace");
    let column: Vec<f64> = (0..count + 1).map(|i| 1e-4 * (0.01 * i as f64).sin()).collect();
    let outputs = simulate(&model, &vec![column; model.inputs.len()], 1e-3, &Options::default()).expect("runs");
    outputs.iter().flatten().filter(|y| y.is_finite()).sum()
}

/// A fit of all parameters of the ball screw to one second of it with a third more viscous friction: its Gauss-Newton steps, to the end.
fn fit(count: usize) -> f64 {
    let text = std::fs::read_to_string(at("plant/models/ball-screw.toml")).expect("part of the workspace");
    let model = Model::from_toml(&text, "ball-screw").expect("a model");
    let other = text.replacen("damping = 0.01 ", "damping = 0.0133 ", 1);
    assert_ne!(text, other, "the file has another viscous friction");
    let truth = Model::from_toml(&other, "truth").expect("a model");
    let t: Vec<f64> = (0..1000).map(|i| 1e-3 * i as f64).collect();
    let push: Vec<f64> = t.iter().map(|t| (12.0 * t).sin() + 0.5 * (71.0 * t).sin()).collect();
    let outputs = simulate(&truth, std::slice::from_ref(&push), 1e-3, &Options::default()).expect("runs");
    let signals = std::iter::once((model.inputs[0].name.clone(), push));
    let signals = signals.chain(model.outputs.iter().zip(outputs).map(|(output, samples)| (output.name.clone(), samples))).collect();
    let recording = Recording::new("counted", t, signals).expect("a recording");
    let record = Record::new(&recording, &model, Vec::new()).expect("enough samples");
    let problem = Problem::new(text, "ball-screw.toml".into(), model, vec![record], Vec::new(), Initial::Rest).expect("a problem");
    let structure = Structure::new(&problem, &problem.fit, Vec::new());
    let given: Vec<f64> = problem.stated.iter().map(|s| s.given).collect();
    let start = structure.values(&problem, &given, &[], &[]);
    let effort = Effort { steps: 30, tolerance: 1e-4 };
    (0..count).filter_map(|_| Evaluator::new(&problem).fit(&structure, &start, effort)).map(|fit| fit.cost + fit.steps as f64).sum()
}

/// Messages of one axis on five topics, recorded to memory; chunks end by size alone, so that their number does not depend on the clock.
fn record(count: usize) -> f64 {
    let info = |index| TopicInfo {
        topic: Topic { name: format!("/topic{index}"), kind: Kind::Sample },
        axes: vec!["forward".to_owned()],
        publisher: "counted".to_owned(),
    };
    let header = BagHeader { rate_hz: 10_000.0, topics: (0..5).map(info).collect(), ..BagHeader::default() };
    let options = RecorderOptions { when_full: WhenFull::Wait, flush: Duration::from_secs(3600), ..RecorderOptions::default() };
    let mut recorder = Recorder::with_sink(Cursor::new(Vec::new()), "memory", &header, &options).expect("begins");
    for message in 0..count {
        let (step, mut sample) = ((message / 5) as u64, Sample::new(1));
        (sample.step, sample.sequence, sample.stamp_ns) = (step, step, step as i64 * 100_000);
        let phase = step as f64 * 1e-3;
        (sample.position[0], sample.velocity[0], sample.effort[0]) = (phase.sin(), phase.cos(), (2.0 * phase).sin());
        recorder.push(message % 5, Message::Sample(sample), step as i64 * 100_000).expect("writes");
    }
    let verdict = recorder.finish().expect("ends");
    verdict.written() as f64 - verdict.lost() as f64
}

/// A sample over shared memory from its publisher to two subscribers, one of which would be woken if it slept.
fn hop(count: usize) -> f64 {
    let root = tempfile::tempdir().expect("a folder");
    let location = Location { prefix: format!("counted{}_", std::process::id()), root: root.path().join("run") };
    let mut transport = Iceoryx2::open(&location, "counted").expect("shared memory");
    let topic = Topic { name: "/counted".to_owned(), kind: Kind::Sample };
    let mut publisher = transport.publisher(&topic, 2).expect("publishes");
    let mut subscribers = [true, false].map(|wakes| transport.subscriber(&topic, usize::MAX, wakes).expect("subscribes"));
    let (mut sample, mut sum) = (Sample::new(1), 0.0);
    publisher.listeners();
    for step in 0..count {
        (sample.step, sample.sequence, sample.position[0]) = (step as u64, step as u64, step as f64);
        publisher.send(&Message::Sample(sample)).expect("sends");
        for subscriber in &mut subscribers {
            if let Some(Message::Sample(heard)) = subscriber.receive().expect("receives") {
                sum += heard.position[0];
            }
        }
    }
    drop((publisher, subscribers, transport));
    location.remove().expect("removes what it left");
    sum
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let wanted = COUNTERS.iter().find(|(name, _)| Some(*name) == arguments.first().map(String::as_str));
    match (wanted, arguments.get(1).and_then(|n| n.parse().ok())) {
        (Some((_, work)), Some(count)) => {
            println!("{:e}", work(count));
            ExitCode::SUCCESS
        }
        _ => {
            eprintln!("usage: counted {} COUNT", COUNTERS.iter().map(|c| c.0).collect::<Vec<_>>().join("|"));
            ExitCode::from(2)
        }
    }
}
