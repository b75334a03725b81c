//! Sessions: from a bag of ours, and the same run in the dress of other people's recordings.

#[path = "common/naming.rs"]
mod naming;

mod common;
#[path = "common/python.rs"]
mod python;

use backdrive_bags::{BagHeader, Clock, Reader, Recorder, RecorderOptions, TopicInfo};
use backdrive_msgs::{Message, Sample, flag};
use backdrive_nodes::build::{plan, topics};
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use backdrive_nodes::sequence::Sequence;
use backdrive_stability::energy::{EnergyVerdict, energy, loop_delay_s};
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::transparency::transparency;
use mcap::records::MessageHeader;
use naming::assert_names;
use python::python;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// What the Python must have.
const NEEDS: &str = "that has tests/python/requirements.txt";

/// Noise on the force channel, N.
fn dither(size: f64) -> Vec<f64> {
    let mut seed = 5_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    };
    // Slower than the rate, so that most of it moves the master.
    let mut now = 0.0;
    (0..16_384)
        .map(|_| {
            now += 0.2 * (noise() - now);
            3.0 * size * now
        })
        .collect()
}

/// The contact task with a dither, on the linear master with nothing cancelled or on the full one with its exact copy.
fn graph(linear: bool, lambda: f64, size: f64) -> Graph {
    let mut graph = common::contact(Overrides {
        master: linear.then(|| common::file("plant/models/impulse-engine-linear.toml")),
        canceller: linear.then(|| "none".into()),
        lambda: Some(lambda),
        duration_s: Some(2.4),
        ..Overrides::default()
    });
    for node in &mut graph.nodes {
        if let Settings::Scaling { dither: played, .. } = &mut node.settings {
            *played = if size > 0.0 { vec![dither(size)] } else { Vec::new() };
        }
    }
    graph
}

/// Every sample of a run: topic and sample.
fn run(graph: &Graph) -> Vec<(String, Message)> {
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name).unwrap()).collect();
    let mut sequence = Sequence::new(plans, &graph.timing).unwrap();
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let mut heard = Vec::new();
    sequence.run(graph.timing.steps.unwrap(), Some(&mut |topic: usize, message: &Message| heard.push((names[topic].clone(), *message))));
    heard
}

/// Records what `keep` lets through into a bag of ours.
fn record(graph: &Graph, heard: &[(String, Message)], path: &Path, keep: impl Fn(&str, &Message) -> bool) {
    let info = |t: backdrive_nodes::build::GraphTopic| TopicInfo { topic: t.topic, axes: t.axes, publisher: t.publisher };
    let header = BagHeader {
        graph_toml: graph.text.clone(),
        clock: Clock::Lockstep,
        rate_hz: graph.timing.rate_hz,
        topics: topics(graph).into_iter().map(info).collect(),
        ..BagHeader::default()
    };
    let mut recorder = Recorder::create(path, &header, &RecorderOptions::lockstep()).unwrap();
    for (topic, message) in heard.iter().filter(|(t, m)| keep(t, m)) {
        if let Some(place) = header.topic(topic) {
            recorder.push(place, *message, 0).unwrap();
        }
    }
    recorder.finish().unwrap();
}

fn ours(graph: &Graph, heard: &[(String, Message)], dir: &Path) -> Session {
    let path = dir.join("ours.mcap");
    record(graph, heard, &path, |_, _| true);
    Session::from_bag(&Reader::open(&path).unwrap(), graph).unwrap()
}

#[test]
fn a_bag_of_ours_becomes_a_session() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(false, 0.3, 0.02);
    let heard = run(&graph);
    let session = ours(&graph, &heard, dir.path());
    let signals = common::run(&graph);
    assert_eq!((session.len(), session.axes.len()), (12_000, 1));
    let axis = &session.axes[0];
    assert_eq!(
        (&axis.master, &axis.force, &axis.command, &axis.contact),
        (&signals.measured, &signals.force, &signals.command, &signals.contact)
    );
    assert_eq!((axis.intent.as_ref().unwrap(), axis.induced.as_ref().unwrap()), (&signals.intent, &signals.induced));
    assert_eq!(axis.dither.as_ref().unwrap()[..], dither(0.02)[..12_000]);
    assert_eq!((axis.resolution, axis.travel), (2e-6, None), "limits are ignored in this graph");
    assert!(session.gain(0) == 0.3 && session.gain(11_999) == 0.3 && session.notes.is_empty(), "{:?}", session.notes);
}

#[test]
fn what_a_bag_lacks_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(false, 0.3, 0.02);
    let heard = run(&graph);
    let without = |name: &str| {
        let path = dir.path().join("less.mcap");
        let _ = std::fs::remove_file(&path);
        record(&graph, &heard, &path, |topic, _| topic != name);
        Session::from_bag(&Reader::open(&path).unwrap(), &graph)
    };
    let error = without("/slave/measured_js").unwrap_err().to_string();
    assert_names(&error, &["F_s", "/slave/measured_js"]);
    let error = without("/slave/servo_jp").unwrap_err().to_string();
    assert_names(&error, &["x_c"]);
    for (topic, says) in [("/scaling/dither_jf", "the dither is missing"), ("/operator/setpoint_js", "intent is missing")] {
        let session = without(topic).unwrap();
        assert!(
            session.axes[0].dither.is_none() == topic.contains("dither") && session.notes.iter().any(|n| n.contains(says)),
            "{:?}",
            session.notes
        );
    }
    let session = without("/scaling/gains").unwrap();
    assert!(session.gain(5000) == 0.3 && session.notes.iter().any(|n| n.contains("planned in the graph")), "{:?}", session.notes);

    // Two hundred lost samples, and a hundred with a clamp.
    let path = dir.path().join("holes.mcap");
    let mut holed = heard.clone();
    for (topic, message) in &mut holed {
        if let (Message::Sample(sample), "/master/measured_js") = (message, topic.as_str())
            && (7000..7100).contains(&sample.step)
        {
            sample.flags |= flag::LIMITED;
        }
    }
    let lost = |topic: &str, m: &Message| topic == "/slave/measured_js" && (3000..3200).contains(&m.step());
    record(&graph, &holed, &path, |topic, m| !lost(topic, m));
    let session = Session::from_bag(&Reader::open(&path).unwrap(), &graph).unwrap();
    let axis = &session.axes[0];
    assert!(session.notes.iter().any(|n| n.contains("/slave/measured_js: 200 of 12000 rows")), "{:?}", session.notes);
    assert_eq!((axis.contact.iter().filter(|f| f.is_nan()).count(), session.len()), (200, 12_000));
    assert_eq!(axis.clamped.iter().filter(|c| **c).count(), 100);
    assert!(axis.contact[2999].is_finite() && axis.contact[3000].is_nan() && axis.contact[3200].is_finite());
}

#[test]
fn gains_follow_what_was_in_force() {
    let dir = tempfile::tempdir().unwrap();
    let mut graph = graph(false, 0.3, 0.0);
    graph.gains.changes.push(backdrive_control::scaling::GainChange { at_s: 1.5, mu: 1.0, lambda: 0.2 });
    let heard = run(&graph);
    let told = ours(&graph, &heard, dir.path());
    assert!(told.gain(7499) == 0.3 && told.gain(12_000 - 1) == 0.2 && (told.gain(7624) - 0.25).abs() < 1e-3, "{}", told.gain(7624));
    let path = dir.path().join("untold.mcap");
    record(&graph, &heard, &path, |topic, _| topic != "/scaling/gains");
    let planned = Session::from_bag(&Reader::open(&path).unwrap(), &graph).unwrap();
    assert_eq!((planned.mu, planned.lambda), (told.mu, told.lambda), "the plan ramps as the scaling does");
    assert!(told.axes[0].dither.is_none() && told.notes.iter().any(|n| n.contains("changes from")), "{:?}", told.notes);
}

#[test]
fn energy_of_a_calm_and_of_a_humming_loop() {
    let dir = tempfile::tempdir().unwrap();
    let none = |lambda: f64| {
        let mut graph = graph(false, lambda, 0.0);
        let canceller = graph.nodes.iter_mut().find(|n| n.kind == NodeKind::Canceller).unwrap();
        if let Settings::Canceller(files, ..) = &mut canceller.settings {
            files.model = None;
        }
        graph
    };
    let calm = none(0.3);
    let session = ours(&calm, &run(&calm), dir.path());
    let found = energy(&session, Some(&calm), None);
    let axis = &found.axes[0];
    assert_eq!(found.verdict, EnergyVerdict::Passive, "{}", found.reason);
    // The model that made the bag is the model in the bag: but for the encoder it does the same.
    assert!(axis.model_misfit.unwrap() < 1e-3, "{:?}", axis.model_misfit);
    let taken = |name: &str| axis.elements.iter().find(|e| e.name == name).unwrap().final_j;
    assert!(taken("motor_friction") > 0.0 && taken("drum_friction") > 0.0 && taken("normal.damper") > 0.0);
    // Coulomb friction takes its force times the path: here the drum's, which the motor follows closely.
    let path: f64 = axis_path(&session.axes[0].master);
    assert!((taken("motor_friction") / (0.044 * path) - 1.0).abs() < 0.2, "{} {}", taken("motor_friction"), 0.044 * path);
    let bounds = axis.bounds.as_ref().unwrap();
    // Servo 71061 N/m in series with the wall's 5000 N/m.
    let series = 1.0 / (1.0 / 71_061.15 + 1.0 / 5000.0);
    assert!((bounds.environment_n_per_m / series - 1.0).abs() < 1e-6, "{}", bounds.environment_n_per_m);
    assert!(
        (bounds.damping_ns_per_m - 0.2).abs() < 1e-12 && (bounds.coulomb_n - 0.144).abs() < 1e-12 && bounds.grip_damping_ns_per_m == 23.0
    );
    assert!((loop_delay_s(&calm) - 2e-4).abs() < 1e-15 && bounds.delay_s == loop_delay_s(&calm));
    assert!((bounds.colgate_n_per_m - 0.2 / 3e-4).abs() < 1e-9 && (bounds.colgate_gain - 0.2 / 3e-4 / series).abs() < 1e-9);
    assert!((bounds.abbott_friction_n_per_m.unwrap() - 2.0 * 0.144 / 2e-6).abs() < 1e-6);

    let humming = none(3.0);
    let session = ours(&humming, &run(&humming), tempfile::tempdir().unwrap().path());
    let found = energy(&session, Some(&humming), None);
    let hold = found.axes[0].master.hold.unwrap();
    assert_eq!(found.verdict, EnergyVerdict::Active, "{}", found.reason);
    // What the port gives in a steady cycle is what the master takes.
    let taken: f64 = found.axes[0].elements.iter().filter_map(|e| e.hold_w).sum();
    assert!((taken / -hold.mean_w - 1.0).abs() < 0.02, "{taken} {}", hold.mean_w);
}

fn axis_path(x: &[f64]) -> f64 {
    x.windows(2).map(|p| (p[1] - p[0]).abs()).sum()
}

#[test]
fn an_exact_copy_cancels_all_of_the_induced_motion() {
    let dir = tempfile::tempdir().unwrap();
    let mut graph = graph(true, 0.4, 0.0);
    common::cancel_with(&mut graph, |_| ());
    let session = ours(&graph, &run(&graph), dir.path());
    let found = transparency(&session, Some(&graph)).remove(0);
    let cancelled = found.cancellation.expect("it was touched");
    assert!((cancelled.quality - 1.0).abs() < 1e-9, "{cancelled:?}");
    assert!((cancelled.correlation.unwrap() - 1.0).abs() < 1e-9 && (cancelled.window_s - 0.05).abs() < 1e-9);
    assert!(found.induced_ratio.unwrap() > 0.01, "{:?}", found.induced_ratio);
    // The wall stands at 5 mm, and the hand is there within 0.95 s.
    assert!((0.8..0.95).contains(&cancelled.contact_s), "{cancelled:?}");
}

// ---------------------------------------------------------------------------------------------------------------------------------

const HEADER: &str = "================================================================================\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const VECTOR: &str = "================================================================================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const WRENCH: &str = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n\
    ================================================================================\nMSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\n";
const JOINTS: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";
const POSE: &str = "std_msgs/Header header\nPose pose\n\
    ================================================================================\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n\
    ================================================================================\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ================================================================================\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const MULTI: &str = "MultiArrayLayout layout\nfloat64[] data\n\
    ================================================================================\nMSG: std_msgs/MultiArrayLayout\nMultiArrayDimension[] dim\nuint32 data_offset\n\
    ================================================================================\nMSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n";
const OWN: &str = "# a maker's own sensor\nuint8 UNITS_N=1\nstd_msgs/Header header\nuint8 units\nbool[2] saturated\nfloat64[6] wrench\n";

/// Little-endian CDR, counted from behind the encapsulation header.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Cdr {
        Cdr(vec![0, 1, 0, 0])
    }

    fn header(ns: u64) -> Cdr {
        let mut cdr = Cdr::new();
        cdr.0.extend(((ns / 1_000_000_000) as i32).to_le_bytes());
        cdr.0.extend(((ns % 1_000_000_000) as u32).to_le_bytes());
        cdr.text("base");
        cdr
    }

    fn align(&mut self, to: usize) {
        while !(self.0.len() - 4).is_multiple_of(to) {
            self.0.push(0);
        }
    }

    fn count(&mut self, count: usize) {
        self.align(4);
        self.0.extend((count as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn numbers(&mut self, values: &[f64]) {
        for value in values {
            self.align(8);
            self.0.extend(value.to_le_bytes());
        }
    }
}

/// The signals of a run, by step.
struct Truth {
    x_m: Vec<f64>,
    f_f: Vec<f64>,
    x_c: Vec<f64>,
    f_s: Vec<f64>,
    x_s: Vec<f64>,
    dither: Vec<f64>,
    hand: Vec<f64>,
}

impl Truth {
    fn of(heard: &[(String, Message)]) -> Truth {
        let pick = |name: &str, value: fn(&Sample) -> f64| -> Vec<f64> {
            let samples = heard.iter().filter(|(t, _)| t == name);
            samples.filter_map(|(_, m)| if let Message::Sample(s) = m { Some(value(s)) } else { None }).collect()
        };
        Truth {
            x_m: pick("/master/measured_js", |s| s.position[0]),
            f_f: pick("/master/measured_js", |s| s.effort[0]),
            x_c: pick("/slave/servo_jp", |s| s.position[0]),
            f_s: pick("/slave/measured_js", |s| s.effort[0]),
            x_s: pick("/slave/measured_js", |s| s.position[0]),
            dither: pick("/scaling/dither_jf", |s| s.effort[0]),
            hand: pick("/operator/setpoint_js", |s| s.position[0]),
        }
    }
}

/// How the other people's recording differs from an even one.
#[derive(Clone, Copy)]
struct Dress {
    /// Added to the sensor's stamps only: another clock, ns.
    sensor_clock: i64,
    /// Number of steps between messages of the sensor.
    sensor_every: usize,
    /// Deviation of stamps, ns.
    jitter: i64,
    /// Steps that the sensor loses.
    lost: (usize, usize),
    /// Sign with which the sensor counts.
    sensor_sign: f64,
    /// Every third message has its joints in the other order.
    swaps: bool,
}

const EVEN: Dress = Dress { sensor_clock: 0, sensor_every: 1, jitter: 0, lost: (0, 0), sensor_sign: 1.0, swaps: false };

/// Writes steps `rows` of a run under other people's names and types.
fn write(path: &Path, truth: &Truth, rows: std::ops::Range<usize>, dress: Dress, options: mcap::WriteOptions) {
    let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
    let mut out = options.profile("ros2").library("somebody").create(file).unwrap();
    let mut channel = |topic: &str, kind: &str, text: &str| {
        let schema = out.add_schema(kind, "ros2msg", text.as_bytes()).unwrap();
        out.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
    };
    let joints = channel("/omega/joint_states", "sensor_msgs/msg/JointState", &format!("{JOINTS}{HEADER}"));
    let wrench = channel("/omega/wrench_cmd", "geometry_msgs/msg/WrenchStamped", &format!("{WRENCH}{VECTOR}{HEADER}"));
    let target = channel("/arm/target_pose", "geometry_msgs/msg/PoseStamped", &format!("{POSE}{HEADER}"));
    let sensor = channel("/ft_sensor/raw", "acme_msgs/msg/Wrench6", &format!("{OWN}{HEADER}"));
    let excitation = channel("/excitation", "std_msgs/msg/Float64", "float64 data\n");
    let hand = channel("/hand", "std_msgs/msg/Float64MultiArray", MULTI);
    let begin = 1_700_000_000_000_000_000_u64;
    for k in rows {
        let wobble = (k as i64 * 7919 % 401 - 200) * dress.jitter / 200;
        let stamp = begin + k as u64 * 200_000;
        let jittery = stamp.saturating_add_signed(wobble);
        let mut send = |channel_id, logged: u64, data: &[u8]| {
            let header = MessageHeader { channel_id, sequence: k as u32, log_time: logged, publish_time: logged };
            out.write_to_known_channel(&header, data).unwrap();
        };
        let mut cdr = Cdr::header(jittery);
        cdr.count(2);
        let swapped = dress.swaps && k % 3 == 2;
        let (names, values) = (["other", "forward"], [99.0, truth.x_m[k]]);
        [0, 1].iter().for_each(|place| cdr.text(names[place ^ usize::from(swapped)]));
        cdr.count(2);
        cdr.numbers(&[0, 1].map(|place| values[place ^ usize::from(swapped)]));
        cdr.count(0);
        cdr.count(0);
        send(joints, stamp, &cdr.0);
        let mut cdr = Cdr::header(jittery);
        cdr.numbers(&[-truth.f_f[k], 0.0, 0.0, 0.0, 0.0, 0.0]);
        send(wrench, stamp, &cdr.0);
        let mut cdr = Cdr::header(jittery);
        cdr.numbers(&[0.0, truth.x_c[k] * 1e3, truth.x_s[k] * 1e3, 0.0, 0.0, 0.0, 1.0]);
        send(target, stamp, &cdr.0);
        if k.is_multiple_of(dress.sensor_every) && !(dress.lost.0..dress.lost.1).contains(&k) {
            let mut cdr = Cdr::header(jittery.saturating_add_signed(dress.sensor_clock));
            cdr.0.extend([1, 0, 1]);
            cdr.numbers(&[0.0, 0.0, dress.sensor_sign * truth.f_s[k] + 0.12, 0.0, 0.0, 0.0]);
            send(sensor, stamp, &cdr.0);
        }
        let mut cdr = Cdr::new();
        cdr.numbers(&[truth.dither[k]]);
        send(excitation, stamp, &cdr.0);
        let mut cdr = Cdr::new();
        cdr.count(0);
        cdr.count(0);
        cdr.count(2);
        cdr.numbers(&[0.5, truth.hand[k]]);
        send(hand, stamp, &cdr.0);
    }
    out.finish().unwrap();
}

const ROLES: &str = r#"
axes = ["forward"]
[signals]
x_m = "/omega/joint_states.position[1]"
F_f = { topic = "/omega/wrench_cmd", field = "wrench.force.x", scale = -1.0 }
x_c = { topic = "/arm/target_pose", field = "pose.position.y", scale = 1e-3 }
F_s = { topic = "/ft_sensor/raw", field = "wrench[2]", offset = -0.12 }
x_s = { topic = "/arm/target_pose", field = "pose.position.z", scale = 1e-3 }
dither = "/excitation.data"
operator = "/hand.data[1]"
"#;

fn near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn the_same_run_in_other_peoples_dress_gives_the_same_session() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(true, 0.3, 0.05);
    let heard = run(&graph);
    let (own, truth) = (ours(&graph, &heard, dir.path()), Truth::of(&heard));
    let roles = Roles::from_toml(ROLES, "roles.toml").unwrap();
    let makings = [
        ("zstd.mcap", mcap::WriteOptions::new().compression(Some(mcap::Compression::Zstd))),
        ("lz4.mcap", mcap::WriteOptions::new().compression(Some(mcap::Compression::Lz4))),
    ];
    for (name, options) in makings {
        let path = dir.path().join(name);
        write(&path, &truth, 0..12_000, EVEN, options);
        let found = Session::from_roles(&path, &roles).unwrap();
        let (axis, expected) = (&found.axes[0], &own.axes[0]);
        assert_eq!((found.len(), axis.name.as_str()), (12_000, "forward"), "{:?}", found.notes);
        assert!((found.period_s / 2e-4 - 1.0).abs() < 1e-9);
        assert_eq!((&axis.master, &axis.force), (&expected.master, &expected.force));
        assert!(near(&axis.command, &expected.command, 1e-17) && near(&axis.contact, &expected.contact, 1e-14));
        assert_eq!((axis.dither.as_ref(), axis.intent.as_ref()), (expected.dither.as_ref(), expected.intent.as_ref()));
        // The canceller's command is mu (x_m - x^_mf): in free motion mu can be identified, and lambda with its step of delay.
        assert!(
            (found.mu[0] - 1.0).abs() < 0.02 && (found.lambda[0] - 0.3).abs() < 1e-3,
            "{} {}: {:?}",
            found.mu[0],
            found.lambda[0],
            found.notes
        );
        assert!(found.notes.iter().any(|n| n.contains("lambda") && n.contains("0.20 ms late")), "{:?}", found.notes);
        assert!(!found.notes.iter().any(|n| n.contains("is the sign") || n.contains("opposite")), "{:?}", found.notes);

        let given = Roles::from_toml(&format!("{ROLES}[gains]\nmu = 1.0\nlambda = 0.3\n"), "roles.toml").unwrap();
        let found = Session::from_roles(&path, &given).unwrap();
        let (theirs, ours) = (energy(&found, None, None), energy(&own, None, None));
        assert!((theirs.axes[0].master.final_j - ours.axes[0].master.final_j).abs() < 1e-12);
        assert_eq!(theirs.verdict, ours.verdict);
        let error = |s: &Session| transparency(s, None).remove(0).impedance.unwrap();
        let (theirs, ours) = (error(&found), error(&own));
        assert!((theirs.error - ours.error).abs() < 1e-9 && theirs.against == "dither", "{} {}", theirs.error, ours.error);
    }
}

#[test]
fn a_joint_that_changes_its_place_is_refused_by_its_place_and_found_by_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let truth = Truth::of(&run(&graph(true, 0.3, 0.05)));
    let (even, swapped) = (dir.path().join("even.mcap"), dir.path().join("swapped.mcap"));
    write(&even, &truth, 0..12_000, EVEN, mcap::WriteOptions::new());
    write(&swapped, &truth, 0..12_000, Dress { swaps: true, ..EVEN }, mcap::WriteOptions::new());
    let roles = Roles::from_toml(ROLES, "roles.toml").unwrap();
    let error = Session::from_roles(&swapped, &roles).unwrap_err().to_string();
    assert_names(&error, &["forward, other", "other, forward", "roles.toml"]);
    let named = Roles::from_toml(&ROLES.replace("position[1]", "position[forward]"), "roles.toml").unwrap();
    let (by_place, by_name) = (Session::from_roles(&even, &roles).unwrap(), Session::from_roles(&swapped, &named).unwrap());
    assert_eq!((by_place.axes, by_place.mu), (by_name.axes, by_name.mu));
}

#[test]
fn a_rosbag2_folder_of_several_files_is_one_session() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(true, 0.3, 0.05);
    let truth = Truth::of(&run(&graph));
    let roles = Roles::from_toml(ROLES, "roles.toml").unwrap();
    write(&dir.path().join("whole.mcap"), &truth, 0..12_000, EVEN, mcap::WriteOptions::new());
    let folder = dir.path().join("session");
    std::fs::create_dir(&folder).unwrap();
    for (index, rows) in [0..5000, 5000..9000, 9000..12_000].into_iter().enumerate() {
        write(&folder.join(format!("session_{index}.mcap")), &truth, rows, EVEN, mcap::WriteOptions::new());
    }
    let metadata = "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  relative_file_paths:\n    - session_0.mcap\n    \
        - session_1.mcap\n    - session_2.mcap\n  compression_format: \"\"\n  compression_mode: \"\"\n";
    std::fs::write(folder.join("metadata.yaml"), metadata).unwrap();
    let (whole, split) =
        (Session::from_roles(&dir.path().join("whole.mcap"), &roles).unwrap(), Session::from_roles(&folder, &roles).unwrap());
    assert_eq!((whole.axes, whole.mu, whole.lambda), (split.axes, split.mu, split.lambda));
}

#[test]
fn a_slow_jittery_sensor_on_another_clock_is_aligned_and_told() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(true, 0.3, 0.05);
    let truth = Truth::of(&run(&graph));
    let roles = Roles::from_toml(&format!("{ROLES}[gains]\nmu = 1.0\nlambda = 0.3\n[resample]\nrate_hz = 5000\n"), "roles.toml").unwrap();
    let path = dir.path().join("worn.mcap");
    let dress = Dress { sensor_clock: -37_000_000_000, sensor_every: 5, jitter: 30_000, lost: (9000, 9300), ..EVEN };
    write(&path, &truth, 0..12_000, dress, mcap::WriteOptions::new());
    let found = Session::from_roles(&path, &roles).unwrap();
    let says = |what: &str| assert!(found.notes.iter().any(|n| n.contains(what)), "{what}: {:?}", found.notes);
    says("different clocks");
    says("37.000 s apart");
    says("/ft_sensor/raw.wrench[2]: holding it between its samples delays it by 0.3");
    says("rows have no value");
    let axis = &found.axes[0];
    let missing = axis.contact.iter().filter(|f| f.is_nan()).count();
    assert!((270..300).contains(&missing), "{missing}");
    // A held force of 1 kHz is at most a millisecond old, and the jitter does not add to that; into the gap it is held for 4 ms.
    let late =
        |row: usize| axis.contact[row].is_nan() || (0..7).any(|lag| (axis.contact[row] - truth.f_s[row.saturating_sub(lag)]).abs() < 1e-9);
    assert!((10..8990).chain(9310..axis.contact.len()).all(late));
    let worst = axis.master.iter().zip(&truth.x_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 6e-6, "positions are interpolated across the jitter: {worst}");
}

#[test]
fn turned_signs_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(true, 0.3, 0.02);
    let truth = Truth::of(&run(&graph));
    let path = dir.path().join("turned.mcap");
    write(&path, &truth, 0..12_000, Dress { sensor_sign: -1.0, ..EVEN }, mcap::WriteOptions::new());
    let found = Session::from_roles(&path, &Roles::from_toml(ROLES, "roles.toml").unwrap()).unwrap();
    assert!(found.notes.iter().any(|n| n.contains("as if the contact pulled")), "{:?}", found.notes);
    assert!(found.notes.iter().any(|n| n.contains("F_f has the opposite sign")), "{:?}", found.notes);
}

#[test]
fn a_wrong_role_is_told_at_its_line() {
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(true, 0.3, 0.02);
    let truth = Truth::of(&run(&graph));
    let path = dir.path().join("theirs.mcap");
    write(&path, &truth, 0..400, EVEN, mcap::WriteOptions::new());
    let says = |from: &str, to: &str, what: &[&str]| {
        let roles = Roles::from_toml(&ROLES.replace(from, to), "roles.toml").unwrap();
        let error = Session::from_roles(&path, &roles).unwrap_err().to_string();
        assert!(what.iter().all(|w| error.contains(w)), "{error}");
    };
    says("/omega/joint_states", "/omega/joint_state", &["roles.toml:4", "x_m", "did you mean \"/omega/joint_states\""]);
    says("wrench[2]", "wrench[6]", &["roles.toml:7", "F_s", "has 6 entries"]);
    says("pose.position.y", "pose.position.q", &["roles.toml:6", "x_c", "there is x, y, z"]);
    says("position[1]", "position[7]", &["x_m", "never measured"]);
    let error = Session::from_roles(Path::new("nothing/here.mcap"), &Roles::from_toml(ROLES, "r").unwrap()).unwrap_err().to_string();
    assert_names(&error, &["nothing/here.mcap"]);
    let garbage = dir.path().join("garbage.mcap");
    std::fs::write(&garbage, vec![7_u8; 5000]).unwrap();
    assert!(Session::from_roles(&garbage, &Roles::from_toml(ROLES, "r").unwrap()).is_err());
    // Cut anywhere, it is read or refused, and never panics.
    let bytes = std::fs::read(&path).unwrap();
    for cut in (0..bytes.len()).step_by(bytes.len() / 23) {
        std::fs::write(&garbage, &bytes[..cut]).unwrap();
        let _ = Session::from_roles(&garbage, &Roles::from_toml(ROLES, "r").unwrap());
    }
}

#[test]
fn the_example_of_the_documentation_is_a_roles_file() {
    Roles::load(&common::file("docs/roles-example.toml")).unwrap();
}

/// A session that the Python package rosbags wrote: a rosbag2 folder with its own metadata, schemas and serialisation.
#[test]
fn a_session_written_by_rosbags_is_read() {
    let Some(python) = python(NEEDS) else { return };
    let dir = tempfile::tempdir().unwrap();
    let graph = graph(true, 0.3, 0.05);
    let truth = Truth::of(&run(&graph));
    let table: String = (0..truth.x_m.len())
        .map(|k| format!("{:?},{:?},{:?},{:?},{:?}\n", truth.x_m[k], truth.f_f[k], truth.x_c[k], truth.f_s[k], truth.dither[k]))
        .collect();
    let csv = dir.path().join("run.csv");
    std::fs::write(&csv, table).unwrap();
    let script = common::file("tests/python/write_session.py");
    for storage in ["mcap", "sqlite3"] {
        let folder = dir.path().join(storage);
        let output =
            Command::new(&python).arg(&script).arg(&csv).arg(&folder).arg(storage).env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let roles = "[signals]\nx_m = \"/touch/joint_states.position[0]\"\n\
        F_f = { topic = \"/touch/force\", field = \"wrench.force.x\", scale = -1 }\n\
        x_c = \"/arm/goal.pose.position.x\"\nF_s = \"/arm/ft.data[2]\"\ndither = \"/excite.data\"\n";
    let roles = Roles::from_toml(roles, "roles.toml").unwrap();
    let found = Session::from_roles(&dir.path().join("mcap"), &roles).unwrap();
    let axis = &found.axes[0];
    assert_eq!((&axis.master, &axis.force, &axis.command, &axis.contact), (&truth.x_m, &truth.f_f, &truth.x_c, &truth.f_s));
    assert_eq!(axis.dither.as_ref(), Some(&truth.dither));
    assert!((found.lambda[0] - 0.3).abs() < 1e-3, "{:?}", found.notes);
    let error = Session::from_roles(&dir.path().join("sqlite3"), &roles).unwrap_err().to_string();
    assert_names(&error, &["sqlite3", "rosbags-convert"]);
}
