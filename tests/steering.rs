//! The steering compensator in the node set: on its rig, turned by a slave, and as a master.

use backdrive_bags::{Reader, Signal, signals};
use backdrive_plant::correlation::{Resolution, admittance, admittance_of, fundamental};
use backdrive_plant::linear::log_frequencies;
use backdrive_plant::model::Model;
use backdrive_plant::set::RecordingSet;
use std::path::Path;
use std::process::{Command, Output};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn backdrive(words: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_backdrive")).args(words).current_dir(folder).output().unwrap()
}

fn json(words: &[&str], folder: &Path) -> serde_json::Value {
    let output = backdrive(words, folder);
    // 7: a slave that is moved all the time never holds still, so its loop is not judged.
    assert!(matches!(output.status.code(), Some(0 | 7)), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn columns(bag: &Path, wanted: &[(&str, &str)]) -> Vec<Vec<f64>> {
    let wanted: Vec<Signal> = wanted.iter().map(|(topic, field)| Signal::new(&format!("{topic}.{field}"), topic, field)).collect();
    let reader = Reader::open(bag).unwrap();
    assert!(reader.ended_cleanly() && reader.completeness().unwrap().is_complete());
    signals(&reader, &wanted).unwrap().columns
}

/// The sine steps of the launch file, recorded; the admittance from the bags is that of the simulated device, and the device's model explains the
/// recordings.
#[test]
fn the_rig_records_the_admittance_of_its_specimen() {
    let temp = tempfile::tempdir().unwrap();
    let graph = format!("{ROOT}/launch/steering-rig.toml");
    assert!(backdrive(&["check", &graph], temp.path()).status.success());
    let output = backdrive(&["run", &graph, "--transport", "inproc", "--out", "rig"], temp.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let set = RecordingSet::open(&temp.path().join("rig")).unwrap();
    assert_eq!(set.fit.len(), 33);
    let model = Model::load(set.model.as_ref().unwrap()).unwrap();
    let period_s = 1.0 / 2000.0;
    let mut followed = Vec::new();
    for (name, f) in set.fit.iter().zip(log_frequencies(0.1, 35.0, 33)) {
        let wanted = [("/rig/setpoint_jp", "position[0]"), ("/rig/measured_js", "position[0]"), ("/rig/measured_js", "effort[0]")];
        let mut found = columns(&set.path_of(name), &wanted);
        let last = ((0.5 * f).ceil().max(2.0) / f / period_s) as usize;
        let phasors: Vec<_> = found.iter_mut().map(|c| fundamental(&c.split_off(c.len() - last), f, period_s).unwrap()).collect();
        let [demand, displacement, force] = phasors[..] else { unreachable!() };
        followed.push((displacement / demand).norm());
        let measured = admittance(force, displacement, f);
        let resolution = Resolution { steps_per_cycle: 1000, rate_hz: 2000.0, settle_s: 0.7, cycles: 1 };
        let expected = admittance_of(&model, [0, 0], f, displacement.norm(), &resolution).unwrap();
        let off = (measured / expected - 1.0).norm();
        println!("{f:7.3} Hz: {:9.1} N s/m {:6.1} deg, off {off:.4}", measured.norm(), measured.arg().to_degrees());
        assert!(off < 0.04, "{f} Hz: {measured} and {expected}");
    }
    // It follows slow demands and falls behind fast ones: the two estimates are needed.
    assert!((followed[0] - 1.0).abs() < 0.01 && followed[32] < 0.9, "{followed:?}");

    let result = json(&["simulate", "rig/model.toml", "rig", "--out", "predicted", "--json"], temp.path());
    let runs = result["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 33);
    for run in runs {
        let nrmse = run["nrmse"]["force"].as_f64().unwrap();
        assert!(nrmse < 0.15, "{run}");
    }
}

fn runs(graph: &str, folder: &Path) {
    let result = json(&["run", &format!("{ROOT}/launch/{graph}.toml"), "--json", "--bag", "run.mcap"], folder);
    assert_eq!(result["lost"].as_u64(), Some(0), "{result}");
    assert!(matches!(result["outcome"].as_str(), Some("stable" | "cannot_tell")), "{result}");
}

/// Six processes; the slave's servo turns the lever, whose force reaches the hand.
#[test]
fn a_slave_turns_it() {
    let temp = tempfile::tempdir().unwrap();
    runs("steering-slave", temp.path());
    let wanted = [("/slave/measured_js", "position[0]"), ("/slave/measured_js", "effort[0]"), ("/master/measured_js", "effort[0]")];
    let mut found = columns(&temp.path().join("run.mcap"), &wanted);
    let [position, lever, hand] = [0, 1, 2].map(|i| fundamental(&found[i].split_off(10_000), 1.0, 2e-4).unwrap());
    // The lever returns the device's admittance at this stroke; the servo yields to friction, so the motion is no pure sine.
    let device = Model::load(Path::new(&format!("{ROOT}/plant/models/steering-compensator-sae-10.toml"))).unwrap();
    let resolution = Resolution { steps_per_cycle: 2000, rate_hz: 2000.0, settle_s: 1.0, cycles: 1 };
    let expected = admittance_of(&device, [0, 0], 1.0, position.norm(), &resolution).unwrap();
    let measured = -admittance(lever, position, 1.0);
    assert!((measured / expected - 1.0).norm() < 0.1, "{measured} {expected}");
    assert!((hand.norm() / lever.norm() / 0.02 - 1.0).abs() < 0.05, "{hand} {lever}");
}

/// A firm hand moves it against its friction and its inertance until the slave meets the wall.
#[test]
fn it_is_a_master() {
    let temp = tempfile::tempdir().unwrap();
    runs("steering-master", temp.path());
    let wanted = [("/master/measured_js", "position[0]"), ("/slave/measured_js", "effort[0]"), ("/master/measured_js", "effort[0]")];
    let found = columns(&temp.path().join("run.mcap"), &wanted);
    let farthest = found[0].iter().copied().fold(0.0, f64::max);
    let contact = found[1].iter().copied().fold(0.0, f64::min);
    assert!(farthest > 5e-3 && contact < -5.0, "{farthest} m, {contact} N");
    let felt = found[2].iter().copied().fold(0.0, f64::min);
    assert!((felt / contact - 1.0).abs() < 0.1, "{felt} N of {contact} N");
}
