//! The identification graphs: what they record, that the device's own model explains it, and the paper's results.
//!
//! Expected numbers are computed from the model files, of whose readings of the paper they are as sure as those.

#[path = "common/naming.rs"]
mod naming;

use backdrive_bags::{Reader, Signal, signals};
use backdrive_plant::linear::{LinearModel, Operating};
use backdrive_plant::model::Model;
use backdrive_plant::set::{Condition, RecordingSet};
use naming::assert_names;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn file(path: &str) -> String {
    format!("{ROOT}/{path}")
}

fn backdrive(words: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_backdrive")).args(words).current_dir(folder).output().unwrap()
}

fn succeeds(words: &[&str], folder: &Path) -> String {
    let output = backdrive(words, folder);
    assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn fails(words: &[&str], folder: &Path) -> String {
    let output = backdrive(words, folder);
    assert_eq!(output.status.code(), Some(3), "{words:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Runs every experiment of a graph in one process into `folder/out`.
fn record(graph: &str, folder: &Path) -> PathBuf {
    succeeds(&["run", graph, "--transport", "inproc", "--out", "out"], folder);
    folder.join("out")
}

/// nrmse of the one output for every recording, by the recording's file stem.
fn nrmse(words: &[&str], folder: &Path) -> Vec<(String, f64)> {
    let words = [&["simulate"], words, &["--out", "predicted", "--overwrite", "--json"]].concat();
    let result: serde_json::Value = serde_json::from_str(&succeeds(&words, folder)).unwrap();
    let run = |run: &serde_json::Value| {
        let name = Path::new(run["recording"].as_str().unwrap()).file_stem().unwrap().to_str().unwrap().to_string();
        (name, run["nrmse"]["motor_position"].as_f64().unwrap())
    };
    result["runs"].as_array().unwrap().iter().map(run).collect()
}

/// Force on the motor and position of it, per step.
fn recorded(bag: &Path) -> (Vec<f64>, Vec<f64>) {
    let wanted = [Signal::new("force", "/master/measured_js", "effort[0]"), Signal::new("position", "/master/measured_js", "position[0]")];
    let mut found = signals(&Reader::open(bag).unwrap(), &wanted).unwrap().columns;
    let position = found.pop().unwrap();
    (found.pop().unwrap(), position)
}

/// Largest root mean square error that a rounding to 2 um leaves, with something for friction that sticks one step later.
const ROUNDING: f64 = 0.4 * 2e-6;

/// Asserts that a model explains recordings to the last step of the encoder.
fn is_explained(set: &RecordingSet, found: &[(String, f64)]) {
    assert!(!found.is_empty());
    for (name, nrmse) in found {
        let (_, y) = recorded(&set.path_of(&format!("{name}.mcap")));
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let deviation = (y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / y.len() as f64).sqrt();
        assert!(nrmse * deviation < ROUNDING, "{name}: {nrmse} of {deviation} m");
    }
}

#[test]
fn the_held_device_is_recorded_and_its_own_model_explains_it() {
    let temp = tempfile::tempdir().unwrap();
    let out = record(&file("launch/identify.toml"), temp.path());
    let set = RecordingSet::open(&out).unwrap();
    assert_eq!(set.held_out, ["impacts.mcap", "multisine-other.mcap"]);
    assert_eq!(set.fit.len(), 8);
    assert!(set.files.is_empty());
    let model = Model::load(set.model.as_ref().unwrap()).unwrap();
    assert!(model.axes[0].holds_user && model.elements.iter().any(|e| e.name == "normal.spring"));

    let truth = nrmse(&["out/model.toml", "out"], temp.path());
    assert_eq!(truth.len(), 10);
    is_explained(&set, &truth);
    // Without hysteresis and friction it is another device.
    let linear = nrmse(&[&file("plant/models/impulse-engine-linear.toml"), "out", "--grip", &file("plant/grips/normal.toml")], temp.path());
    for ((name, with), (_, without)) in truth.iter().zip(&linear) {
        assert!(*without > 0.03 && *without > 10.0 * with, "{name}: {with} and {without}");
    }
}

#[test]
fn successive_isolation_shows_what_the_paper_saw() {
    let temp = tempfile::tempdir().unwrap();
    let out = record(&file("launch/successive-isolation.toml"), temp.path());
    let steps = ["B-amplifier", "C-motor", "D-cables", "E-drum", "F-linkage", "G-user", "H-verification"];
    for step in steps {
        let set = RecordingSet::open(&out.join(step)).unwrap();
        let model = Model::load(set.model.as_ref().unwrap()).unwrap();
        set.check_conditions(&model).unwrap();
        assert!(!set.held_out.is_empty(), "{step}");
        // File by file, so that each has its own numbers in the model.
        for name in set.fit.iter().chain(&set.held_out) {
            let mut model = model.clone();
            for (path, condition) in set.rules_of(name).condition {
                let Condition::Value(value) = condition else { panic!("{path} is free") };
                model.set_values_at(&path, &[value]).unwrap();
            }
            std::fs::write(temp.path().join("model.toml"), model.to_toml()).unwrap();
            let (bag, columns) = (format!("out/{step}/{name}"), format!("out/{step}/set.toml"));
            is_explained(&set, &nrmse(&["model.toml", &bag, "--columns", &columns], temp.path()));
        }
    }
    let gains = RecordingSet::open(&out.join("E-drum")).unwrap();
    assert_eq!(
        gains.rules_of("drum-steps-high-gain.mcap").condition[0],
        ("elements.virtual-spring.spring.stiffness".into(), Condition::Value(1600.0))
    );

    friction_of_the_motor(&out.join("C-motor"));
    resonance_of_the_cables(&out.join("D-cables"));
    let locked = resonance_of_the_linkage(&out.join("F-linkage"));
    resonance_in_the_hand(&out.join("G-user"), locked);
}

fn value(model: &Model, path: &str) -> f64 {
    model.values_at(path).unwrap()[0]
}

/// Step C: the deflection of the position controller is c_m/k either way, and the same at every speed.
fn friction_of_the_motor(step: &Path) {
    let model = Model::load(&step.join("model.toml")).unwrap();
    let expected = value(&model, "elements.motor_friction.force");
    for name in ["slow", "medium", "fast"] {
        let bag = Reader::open(&step.join(format!("motor-{name}.mcap"))).unwrap();
        let wanted = [
            Signal::new("hand", "/operator/setpoint_js", "position[0]"),
            Signal::new("speed", "/operator/setpoint_js", "velocity[0]"),
            Signal::new("position", "/master/measured_js", "position[0]"),
        ];
        let found = signals(&bag, &wanted).unwrap();
        let [hand, speed, position] = found.columns.as_slice() else { panic!("{:?}", found.names) };
        let top = speed.iter().copied().fold(0.0, f64::max);
        for side in [1.0, -1.0] {
            // At the top of its speed the motor does not accelerate.
            let there: Vec<usize> = (0..hand.len()).filter(|i| side * speed[*i] > 0.97 * top).collect();
            let deflection = there.iter().map(|i| hand[*i] - position[*i]).sum::<f64>() / there.len() as f64;
            let friction = side * deflection * value(&model, "elements.virtual-spring.spring.stiffness");
            println!("C {name}: {friction:.4} N at {:.3} m/s", side * top);
            assert!((friction / expected - 1.0).abs() < 0.05, "{name}: {friction} N for {expected} N");
        }
    }
}

/// Step D, check 7: the peak lies at f0 sqrt(1 - 2 zeta^2).
fn resonance_of_the_cables(step: &Path) {
    let model = Model::load(&step.join("model.toml")).unwrap();
    let (k, m, b) =
        (value(&model, "elements.cable.stiffness"), value(&model, "bodies.motor"), value(&model, "elements.cable_damping.damping"));
    let (f0, zeta) = ((k / m).sqrt() / TAU, b / (2.0 * (k * m).sqrt()));
    let expected = f0 * (1.0 - 2.0 * zeta * zeta).sqrt();
    let peak = Response::of(&step.join("drum-locked-sweep.mcap"), [250.0, 350.0]).peak([260.0, 340.0]);
    println!("D: peak at {:.2} Hz, {expected:.2} Hz from k_c, m_m and b_c", peak.0);
    assert!((peak.0 / expected - 1.0).abs() < 0.01, "{} Hz for {expected} Hz", peak.0);
}

/// Step F, check 8: the larger the motion the lower the resonance, from the small-signal stiffness of the linkage to its
/// asymptote. Returns how far the largest peak stands out of the response at 30 Hz.
fn resonance_of_the_linkage(step: &Path) -> f64 {
    let model = Model::load(&step.join("model.toml")).unwrap();
    let mode = |at: &Operating| LinearModel::new(&model, at).unwrap().modes().unwrap()[0].frequency_hz();
    let limits = [mode(&Operating::amplitude(3e-3)), mode(&Operating::small())];
    let mut peaks: Vec<f64> = Vec::new();
    let mut height = 0.0;
    for number in 1..=5 {
        let response = Response::of(&step.join(format!("handle-locked-sweep-{number}.mcap")), [15.0, 130.0]);
        let peak = response.peak([40.0, 110.0]);
        // What bends the linkage is the drum's motion: the motor's less the little that the cable gives.
        let expected = mode(&Operating::amplitude(0.95 * response.motion));
        println!("F {number}: peak at {:.1} Hz with {:.0} um; {expected:.1} Hz at such an amplitude", peak.0, 1e6 * response.motion);
        assert!((peak.0 / expected - 1.0).abs() < 0.05, "{} Hz for {expected} Hz", peak.0);
        assert!(peak.0 > 0.97 * limits[0] && peak.0 < limits[1], "{} Hz in {limits:?}", peak.0);
        peaks.push(peak.0);
        height = peak.1 / response.at(30.0);
    }
    println!(
        "F: from {:.1} Hz to {:.1} Hz; the model's limits are {:.1} and {:.1} Hz; peak {height:.1} times the response at 30 Hz",
        peaks[0], peaks[4], limits[1], limits[0]
    );
    assert!(peaks.windows(2).all(|p| p[1] < p[0] + 0.3), "{peaks:?}");
    assert!(peaks[4] < 0.95 * peaks[0], "{peaks:?}");
    height
}

/// Step G, check 9: in the hand there is a peak between 60 and 80 Hz, and it is low.
fn resonance_in_the_hand(step: &Path, locked: f64) {
    let mut seen = 0;
    for number in 1..=4 {
        let response = Response::of(&step.join(format!("held-sweep-{number}.mcap")), [15.0, 130.0]);
        let peak = response.peak([52.0, 110.0]);
        let height = peak.1 / response.at(30.0);
        println!("G {number}: peak at {:.1} Hz, {height:.2} times the response at 30 Hz", peak.0);
        // Against the locked handle it is subdued.
        assert!(height < 0.4 * locked, "{height} and {locked}");
        seen += usize::from((60.0..80.0).contains(&peak.0) && peak.1 > 1.03 * response.least([35.0, 52.0]));
    }
    assert!(seen > 0);
}

/// Magnitude of a frequency response from force to position, m/N: the cross-spectrum over the force's, both averaged over
/// 5 Hz, so that the harmonics which a sweep left behind at another time average out.
struct Response {
    lines: Vec<(f64, f64)>,
    /// Largest magnitude of the position, m.
    motion: f64,
}

const SPACING: f64 = 0.25;

impl Response {
    fn of(bag: &Path, band: [f64; 2]) -> Response {
        let (force, mut position) = recorded(bag);
        let mean = position.iter().sum::<f64>() / position.len() as f64;
        position.iter_mut().for_each(|x| *x -= mean);
        let count = ((band[1] - band[0]) / SPACING) as usize;
        let frequencies: Vec<f64> = (0..=count).map(|i| band[0] + i as f64 * SPACING).collect();
        let spectrum = |signal: &[f64]| frequencies.iter().map(|f| line(signal, f / 5000.0)).collect::<Vec<_>>();
        let (u, y) = (spectrum(&force), spectrum(&position));
        let half = (2.5 / SPACING) as usize;
        let smooth = |i: usize| {
            let (mut re, mut im, mut power) = (0.0, 0.0, 0.0);
            for j in i - half..=i + half {
                let weight = 1.0 + (0.5 * TAU * (j as f64 - i as f64) / (half + 1) as f64).cos();
                re += weight * (y[j].0 * u[j].0 + y[j].1 * u[j].1);
                im += weight * (y[j].1 * u[j].0 - y[j].0 * u[j].1);
                power += weight * (u[j].0 * u[j].0 + u[j].1 * u[j].1);
            }
            (frequencies[i], re.hypot(im) / power)
        };
        let lines = (half..=count - half).map(smooth).collect();
        Response { lines, motion: position.iter().fold(0.0, |m, x| x.abs().max(m)) }
    }

    fn within(&self, band: [f64; 2]) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.lines.iter().copied().filter(move |(f, _)| (band[0]..=band[1]).contains(f))
    }

    /// Frequency and magnitude.
    fn peak(&self, band: [f64; 2]) -> (f64, f64) {
        self.within(band).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
    }

    fn least(&self, band: [f64; 2]) -> f64 {
        self.within(band).map(|(_, magnitude)| magnitude).fold(f64::INFINITY, f64::min)
    }

    fn at(&self, frequency: f64) -> f64 {
        self.within([frequency - 0.5 * SPACING, frequency + 0.5 * SPACING]).next().unwrap().1
    }
}

/// One line of a Fourier transform, at a frequency over the sampling rate.
fn line(signal: &[f64], frequency: f64) -> (f64, f64) {
    let (sin, cos) = (-TAU * frequency).sin_cos();
    let horner = |(re, im): (f64, f64), x: &f64| (re * cos - im * sin + x, re * sin + im * cos);
    signal.iter().rev().fold((0.0, 0.0), horner)
}

#[test]
fn the_recorded_impacts_are_what_their_graph_makes() {
    let temp = tempfile::tempdir().unwrap();
    // A hand that never rests gives no information on the loop's stability, and is not asked to here.
    let run = backdrive(&["run", &file("launch/identify/knocks.toml"), "--transport", "inproc", "--bag", "knocks.mcap"], temp.path());
    assert_eq!(run.status.code(), Some(7), "{run:?}");
    succeeds(&["bag", "export", "knocks.mcap", "--csv", "impacts.csv", "--topic", "/master/servo_jf"], temp.path());
    let rows = |path: &Path| -> Vec<String> { std::fs::read_to_string(path).unwrap().lines().map(str::to_string).collect() };
    let (made, shipped) = (rows(&temp.path().join("impacts.csv")), rows(Path::new(&file("launch/identify/impacts.csv"))));
    assert_eq!((made[0].as_str(), made.len()), (shipped[0].as_str(), shipped.len()));
    let force = |row: &String| row.rsplit(',').next().unwrap().parse::<f64>().unwrap();
    // The second row is step 0, before any force.
    let apart = made.iter().zip(&shipped).skip(2).map(|(a, b)| (force(a) - force(b)).abs()).fold(0.0, f64::max);
    assert!(apart < 0.05, "{apart} N");
    let hardest = shipped.iter().skip(2).map(force).fold(0.0, f64::min);
    assert!((-8.9..-4.0).contains(&hardest), "{hardest} N");
}

/// A graph of one experiment that is changed as given.
fn one(folder: &Path, experiment: &str) -> String {
    let text = std::fs::read_to_string(file("launch/identify.toml")).unwrap();
    let nodes = &text[..text.find("# Slow ramps").unwrap()];
    let graph = folder.join("one.toml");
    let text = format!("{nodes}{experiment}").replace("\"../plant", &format!("\"{ROOT}/plant"));
    std::fs::write(&graph, text).unwrap();
    graph.display().to_string()
}

/// `one.toml:LINE:`, the line on which the text stands.
fn place(graph: &str, text: &str) -> String {
    let all = std::fs::read_to_string(graph).unwrap();
    format!("one.toml:{}: ", 1 + all.lines().position(|line| line.contains(text)).unwrap())
}

#[test]
fn what_the_device_cannot_do_is_told_at_its_line() {
    let temp = tempfile::tempdir().unwrap();
    let graph = one(temp.path(), "[[experiments]]\nname = \"hard\"\n\nexciter = { force = \"steps:amplitude=9,hold=0.1\" }\n");
    for words in [vec!["check", &graph], vec!["run", &graph, "--transport", "inproc"]] {
        let told = fails(&words, temp.path());
        assert!(told.contains(&place(&graph, "amplitude=9")) && told.contains("reaches 9.000") && told.contains("8.9"), "{told}");
    }
    assert!(!temp.path().join("one").exists());

    let graph = one(temp.path(), "[[experiments]]\nname = \"far\"\nduration_s = 1.0\n[experiments.master]\ngrip = \"none\"\n");
    let told = fails(&["run", &graph, "--transport", "inproc"], temp.path());
    assert!(told.contains(&place(&graph, "[[experiments]]")), "{told}");
    assert_names(&told, &["beyond its travel"]);

    let graph = one(temp.path(), "[[experiments]]\nname = \"absent\"\nexciter = { force = \"recorded:file=a.csv,column=f\" }\n");
    let told = fails(&["check", &graph], temp.path());
    assert!(told.contains(&temp.path().join("a.csv").display().to_string()), "{told}");
    std::fs::write(temp.path().join("a.csv"), "t,g\n0,1\n").unwrap();
    let told = fails(&["check", &graph], temp.path());
    assert!(told.contains(&place(&graph, "a.csv")), "{told}");
    assert_names(&told, &["unknown column \"f\""]);
}

#[test]
fn experiments_of_different_devices_make_no_common_set() {
    let temp = tempfile::tempdir().unwrap();
    let quick = "duration_s = 0.01\n";
    let text = format!(
        "[[experiments]]\nname = \"a\"\n{quick}\n[[experiments]]\nname = \"b\"\n{quick}master = {{ lock = [\"handle\"], grip = \"none\" }}\n"
    );
    let graph = one(temp.path(), &text);
    let told = fails(&["run", &graph, "--transport", "inproc"], temp.path());
    assert_names(&told, &["experiment \"b\""]);
}
