//! The criterion against the eigenvalues of closed loops in state space, and against coupled arms that are run.

use super::eigenloci::{Matrix, alone, encirclements};
use super::{Limit, coupled_loops, limit};
use crate::resimulate::{Gain, RunOptions, Scenario};
use backdrive_nodes::graph::{Graph, Limits, Overrides, Sensors};
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Two held masters whose forces come back rotated. It has mass, damping, stiffness of each axis, a wall, a servo of second order, and the angle
/// between the frame of the positions and that of the returning forces.
struct Turned {
    mass: [f64; 2],
    damping: [f64; 2],
    stiffness: [f64; 2],
    wall: f64,
    servo_hz: f64,
    angle: f64,
}

const TURNED: Turned =
    Turned { mass: [0.3, 0.5], damping: [9.0, 14.0], stiffness: [400.0, 500.0], wall: 3000.0, servo_hz: 25.0, angle: 1.25 };

impl Turned {
    /// The force that comes back per position of the slave.
    fn back(&self) -> DMatrix<f64> {
        let (sin, cos) = self.angle.sin_cos();
        -self.wall * DMatrix::from_row_slice(2, 2, &[cos, -sin, sin, cos])
    }

    /// The largest real part of the poles at `k`.
    fn growth(&self, k: f64) -> f64 {
        self.poles(k).max()
    }

    fn unstable_poles(&self, k: f64) -> i64 {
        self.poles(k).iter().filter(|re| **re > 0.0).count() as i64
    }

    /// Real parts of the poles of x'' = -(b x' + c x)/m + k R y/m, y'' = w² (x - y) - 1.4 w y'; the states are x, x', y, y' of both axes.
    fn poles(&self, k: f64) -> DVector<f64> {
        let w = TAU * self.servo_hz;
        let back = self.back();
        let a = DMatrix::from_fn(8, 8, |row, column| match (row, column) {
            (0 | 1, c) if c == row + 2 => 1.0,
            (4 | 5, c) if c == row + 2 => 1.0,
            (2 | 3, c) if c + 2 == row => -self.stiffness[c] / self.mass[c],
            (2 | 3, c) if c == row => -self.damping[row - 2] / self.mass[row - 2],
            (2 | 3, 4 | 5) => k * back[(row - 2, column - 4)] / self.mass[row - 2],
            (6 | 7, c) if c + 6 == row => w * w,
            (6 | 7, c) if c + 2 == row => -w * w,
            (6 | 7, c) if c == row => -1.4 * w,
            _ => 0.0,
        });
        DVector::from_iterator(8, a.complex_eigenvalues().iter().map(|pole| pole.re))
    }

    fn loops(&self, hz: &[f64]) -> Vec<Matrix> {
        let back = self.back().map(|x| Complex::new(x, 0.0));
        let at = |hz: &f64| {
            let (s, w) = (Complex::new(0.0, TAU * hz), TAU * self.servo_hz);
            let servo = w * w / (s * s + s * (1.4 * w) + w * w);
            let master = |i: usize| servo / (s * s * self.mass[i] + s * self.damping[i] + self.stiffness[i]);
            &back * Matrix::from_diagonal(&DVector::from_vec(vec![master(0), master(1)]))
        };
        hz.iter().map(at).collect()
    }
}

/// The gain between `low` and `high` at which `grows` turns.
fn turns(mut low: f64, mut high: f64, grows: impl Fn(f64) -> bool) -> f64 {
    assert!(!grows(low) && grows(high), "{low} to {high} has no edge");
    while high - low > 1e-9 * low {
        let middle = (low * high).sqrt();
        if grows(middle) { high = middle } else { low = middle }
    }
    low
}

fn grid(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..=count).map(|i| from * (to / from).powf(i as f64 / count as f64)).collect()
}

#[test]
fn the_edge_is_where_the_closed_loops_poles_cross() {
    let hz = grid(0.02, 2000.0, 6000);
    for angle in [0.0, 0.4, 0.9, TURNED.angle] {
        let turned = Turned { angle, ..TURNED };
        let l = turned.loops(&hz);
        let exact = turns(1e-4, 1e3, |k| turned.growth(k) > 0.0);
        let found = limit(&hz, &l).critical_gain.unwrap();
        assert!((found / exact - 1.0).abs() < 1e-4, "angle {angle}: {found} {exact}");
        for k in [0.5 * exact, 0.97 * exact, 1.03 * exact, 3.0 * exact, 50.0 * exact] {
            assert_eq!(encirclements(&l, k), turned.unstable_poles(k), "angle {angle}, {} of the edge", k / exact);
        }
    }
}

#[test]
fn axes_that_are_stable_alone_are_not_together() {
    let hz = grid(0.02, 2000.0, 6000);
    let l = TURNED.loops(&hz);
    let together = limit(&hz, &l).critical_gain.unwrap();
    let each: Vec<f64> = (0..2).map(|axis| limit(&hz, &alone(&l, axis)).critical_gain.unwrap()).collect();
    println!("together {together:.4}, alone {each:.4?}");
    assert!(each.iter().all(|alone| *alone > 3.0 * together), "{together} {each:?}");
    let between = 2.0 * together;
    for axis in 0..2 {
        assert_eq!(encirclements(&alone(&l, axis), between), 0, "axis {axis}");
    }
    assert!(TURNED.growth(between) > 0.0 && encirclements(&l, between) == 2);
}

fn file(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The three-joint graph without a canceller. Its slave has a force sensor that is rotated by `degrees` about the vertical, in something soft that it is
/// always in; the hand gives a small knock. Without dry friction, clamps and noise: the linear loop and the arms' geometry remain.
fn sensor_turned(degrees: f64) -> Graph {
    let folder = tempfile::tempdir().unwrap();
    let robots = file("plant/robots");
    let read = |name: &str| std::fs::read_to_string(robots.join(name)).unwrap();
    for (arm, mounted) in [("three-joint-haptic", false), ("three-joint-slave", true)] {
        let xml: String = read(&format!("{arm}.urdf"))
            .lines()
            .map(|line| {
                line.split(" friction=")
                    .next()
                    .map_or(String::new(), |l| if l.len() < line.len() { format!("{l}/>\n") } else { format!("{l}\n") })
            })
            .collect();
        std::fs::write(folder.path().join(format!("{arm}.urdf")), xml).unwrap();
        let mut model = read(&format!("{arm}.toml"));
        if mounted {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let sensor = format!(
                "[point.sensor_x]\nlink = \"tip\"\naxis = [{cos:?}, {sin:?}, 0.0]\n[point.sensor_y]\nlink = \"tip\"\naxis = [{:?}, {cos:?}, 0.0]\n\n[bodies]",
                -sin
            );
            model = model.replace("[bodies]", &sensor).replace("user     = \"tip.x\"", "user     = \"sensor_x\"");
            model = model.replace("user     = \"tip.y\"", "user     = \"sensor_y\"");
        }
        std::fs::write(folder.path().join(format!("{arm}.toml")), model).unwrap();
    }
    let soft = "name = \"soft\"\nkind = \"fragment\"\nmotion = \"translation\"\n[[elements]]\nname = \"spring\"\nkind = \"spring\"\n\
                between = [\"port\", \"ground\"]\nstiffness = 2000.0\n";
    std::fs::write(folder.path().join("soft.toml"), soft).unwrap();
    let text = std::fs::read_to_string(file("launch/three-joint.toml")).unwrap();
    let text = text
        .replace("environment_on = \"tip.x\"", "")
        .replace("\"../plant/environments/stiff-wall.toml\"", "\"soft.toml\"")
        .replace("\"../plant/robots/", "\"")
        .replace("\"../plant/", &format!("\"{}/", file("plant").display()));
    let path = folder.path().join("turned.toml");
    std::fs::write(&path, text).unwrap();
    let changes = Overrides {
        canceller: Some("none".into()),
        sensors: Some(Sensors::Ideal),
        limits: Some(Limits::Ignored),
        duration_s: Some(1.5),
        ..Overrides::default()
    };
    let mut graph = Graph::load(&path, &changes).unwrap();
    for node in &mut graph.nodes {
        if let backdrive_nodes::graph::Settings::Operator(intents) = &mut node.settings {
            let knock = |size: f64| backdrive_control::operator::Intent::Waypoints(vec![[0.0, 0.0], [0.05, size], [0.1, 0.0]]);
            *intents = vec![knock(2e-4), knock(1e-4), knock(1e-4)];
        }
    }
    graph
}

/// Growth of the motion of the master over the second half of a run at `gain`, as a factor from its first to its last quarter there.
fn grew(graph: &Graph, gain: f64) -> f64 {
    let scenario = Scenario::new(graph.clone(), None, None).unwrap();
    let options = RunOptions { keep_signals: true, ..RunOptions::default() };
    let run = scenario.run(Gain { mu: 1.0, lambda: gain }, &options, &AtomicBool::new(false)).unwrap();
    let signals = run.signals.unwrap();
    let rows = signals.len();
    let rms = |from: usize, to: usize| {
        let square: f64 = signals.axes.iter().map(|a| a.master[from..to].iter().map(|x| x * x).sum::<f64>()).sum();
        (square / (to - from) as f64).sqrt()
    };
    rms(7 * rows / 8, rows) / rms(rows / 2, 5 * rows / 8)
}

#[test]
fn coupled_arms_run_stable_below_the_edge_and_not_above() {
    let graph = sensor_turned(70.0);
    let scenario = Scenario::new(graph.clone(), None, None).unwrap();
    let options = RunOptions { keep_signals: true, ..RunOptions::default() };
    let recorded = scenario.run(Gain { mu: 1.0, lambda: 0.02 }, &options, &AtomicBool::new(false)).unwrap().signals.unwrap();
    let found = coupled_loops(&graph, &recorded, 0.02).unwrap().unwrap();
    let Limit { critical_gain: Some(edge), frequency_hz: Some(hz) } = found.together else { panic!("no edge: {found:?}") };
    println!("arms, sensor turned by 70 degrees: together {edge:.4} at {hz:.2} Hz, alone {:?}", found.alone);
    let (below, above) = (grew(&graph, 0.96 * edge), grew(&graph, 1.04 * edge));
    println!("motion grows by {below:.3} at 0.96 of the edge and by {above:.3} at 1.04");
    assert!(below < 0.9 && above > 1.1, "{below} {above}");
    // Each axis alone would allow many times that.
    assert!(found.lowest_alone() > 5.0 * edge && found.alone_misleads(), "{found:?}");
    assert_eq!(found.encirclements, 0);
    let beyond = coupled_loops(&graph, &recorded, 1.5 * edge).unwrap().unwrap();
    assert!(beyond.encirclements > 0, "{beyond:?}");
}
