//! The device in a process of its own, and the device as a graph sees it.

#[path = "../../tests/common/naming.rs"]
mod naming;

mod common;

use backdrive_sealed::draw::{DrawOptions, draw};
use backdrive_sealed::master::{MasterOptions, Reading, Regrip, SealedMaster};
use backdrive_sealed::plant::SealedPlant;
use backdrive_sealed::process::{RemoteError, RemoteMaster};
use backdrive_sealed::seal::hash;
use backdrive_sealed::truth::Truth;
use common::*;
use naming::assert_names;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const MODEL: &str = "plant/models/impulse-engine-linear.toml";

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_backdrive-sealed"));
    command.current_dir(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".."));
    command
}

fn draw_file(folder: &Path, model: &str) -> (PathBuf, Output) {
    let path = folder.join("truth.json");
    let mut command = program();
    command.args(["draw", "--model", model, "--grip", "plant/grips/normal.toml", "--seed", "8", "--effects", "2", "--out"]).arg(&path);
    (path, command.output().unwrap())
}

fn device_process(truth: &Path, model: &str, more: &[&str]) -> Command {
    let mut command = program();
    command.args(["run", "--model", model, "--grip", "plant/grips/normal.toml", "--truth"]).arg(truth).args(more);
    command
}

fn play(axes: usize, mut step: impl FnMut(&[f64], &[f64]) -> Vec<Reading>) -> Vec<Reading> {
    (0..2000)
        .flat_map(|k| {
            let t = k as f64 * 2e-4;
            let force: Vec<f64> = (0..axes).map(|axis| 2.0 * (90.0 * t + axis as f64).sin()).collect();
            let hand: Vec<f64> = (0..axes).map(|axis| 3e-3 * (9.0 * t + axis as f64).sin()).collect();
            step(&force, &hand)
        })
        .collect()
}

#[test]
fn a_pipe_or_a_device_as_a_file_ends_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [pipe.to_str().unwrap(), "/dev/zero"] {
        let (made, drawn) = draw_file(folder.path(), path);
        let told = String::from_utf8(drawn.stderr).unwrap();
        assert!(drawn.status.code() == Some(3) && told.contains("is no regular file") && !made.exists(), "{path}: {told}");
        let run = device_process(Path::new(path), MODEL, &[]).stdin(Stdio::null()).output().unwrap();
        assert_eq!(run.status.code(), Some(3), "{path}: {run:?}");
    }
}

#[test]
fn the_process_is_the_device() {
    let folder = tempfile::tempdir().unwrap();
    for (model, axes) in [(MODEL, 1), ("plant/models/two-axis.toml", 2)] {
        let (path, drawn) = draw_file(folder.path(), model);
        let bytes = std::fs::read(&path).unwrap();
        let printed = String::from_utf8(drawn.stdout).unwrap();
        assert_eq!(printed, format!("{}  {}\n", hash(&bytes), path.display()));
        let truth = Truth::from_json(&bytes).unwrap();
        assert_eq!(truth, draw(&held(model), 8, &DrawOptions { effects: 2, ..DrawOptions::default() }).unwrap());

        let regrips = vec![Regrip { at_s: 0.02, scale: 1.5 }, Regrip { at_s: 0.05, scale: 0.5 }];
        let options = MasterOptions { period_s: 2e-4, run: 3, firmness: 1.1, regrips, coarse: false };
        let mut here = SealedMaster::new(&held(model), &truth, &options).unwrap();
        let mut is_started = false;
        let expected = play(axes, |force, hand| {
            if is_started {
                here.step(force, hand).unwrap()
            } else {
                here.start(hand).unwrap()
            }
            is_started = true;
            (0..axes).map(|axis| here.reading(axis).unwrap()).collect()
        });
        let mut there = RemoteMaster::start_process(device_process(
            &path,
            model,
            &["--number", "3", "--firmness", "1.1", "--regrips", "0.02:1.5,0.05:0.5"],
        ))
        .unwrap();
        assert_eq!(there.axes(), axes);
        assert_eq!(play(axes, |force, hand| there.step(force, hand).unwrap().to_vec()), expected);
        let mut other = RemoteMaster::start_process(device_process(
            &path,
            model,
            &["--number", "4", "--firmness", "1.1", "--regrips", "0.02:1.5,0.05:0.5"],
        ))
        .unwrap();
        let again = play(axes, |force, hand| other.step(force, hand).unwrap().to_vec());
        assert!(again.iter().zip(&expected).any(|(a, b)| a.measured != b.measured), "its noise is another");
        assert!(again.iter().zip(&expected).all(|(a, b)| a.position == b.position), "and nothing else");
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn a_sealed_truth_is_not_replaced_and_bad_files_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let (path, first) = draw_file(folder.path(), MODEL);
    assert!(first.status.success());
    let before = std::fs::read(&path).unwrap();
    let (_, second) = draw_file(folder.path(), MODEL);
    assert_eq!(second.status.code(), Some(5));
    assert_names(String::from_utf8(second.stderr).unwrap(), &["truth.json"]);
    assert_eq!(std::fs::read(&path).unwrap(), before);
    let mut wrong = device_process(&path, "plant/models/impulse-engine.toml", &[]);
    let told = wrong.output().unwrap();
    assert_eq!(told.status.code(), Some(3));
    assert_names(String::from_utf8(told.stderr).unwrap(), &["impulse-engine-linear"]);
    let refused = RemoteMaster::start_process({
        wrong.stderr(Stdio::null());
        wrong
    });
    assert!(matches!(refused.map(|_| ()), Err(RemoteError::Greeting(said)) if said.is_empty()));
    let nowhere = RemoteMaster::start_process(Command::new("/nowhere/at-all")).map(|_| ());
    assert_names(nowhere.unwrap_err().to_string(), &["/nowhere/at-all"]);
}

#[test]
fn it_ends_when_what_it_is_told_is_no_number() {
    let folder = tempfile::tempdir().unwrap();
    let (path, _) = draw_file(folder.path(), MODEL);
    let mut command = device_process(&path, MODEL, &[]);
    command.stderr(Stdio::null());
    let mut there = RemoteMaster::start_process(command).unwrap();
    there.step(&[0.0], &[0.0]).unwrap();
    assert!(matches!(there.step(&[f64::NAN], &[0.0]), Err(RemoteError::Pipe(_))));
}

#[test]
fn a_reading_is_what_the_plant_does() {
    let network = held("plant/models/two-axis.toml");
    let truth = Truth::nothing(&network);
    let mut master =
        SealedMaster::new(&network, &truth, &MasterOptions { period_s: 2e-4, run: 0, firmness: 1.0, regrips: Vec::new(), coarse: false })
            .unwrap();
    let mut plant = SealedPlant::new(&network, &truth, 2e-4).unwrap();
    master.start(&[1e-3, -1e-3]).unwrap();
    let at = |name: &str| network.input(name).unwrap();
    let mut inputs = vec![0.0; network.inputs.len()];
    (inputs[at("intent")], inputs[at("side_intent")]) = (1e-3, -1e-3);
    plant.start(&inputs).unwrap();
    for k in 0..3000 {
        let (force, hand) = ([(0.02 * k as f64).sin(), 0.5], [1e-3 + 1e-6 * k as f64, -1e-3]);
        master.step(&force, &hand).unwrap();
        (inputs[at("forward_force")], inputs[at("side_force")]) = (force[0], force[1]);
        (inputs[at("intent")], inputs[at("side_intent")]) = (hand[0], hand[1]);
        plant.step(&inputs).unwrap();
    }
    for (axis, user, hand) in [(0, "forward_handle", "hand"), (1, "side_handle", "side_hand")] {
        let reading = master.reading(axis).unwrap();
        let [user, hand] = [user, hand].map(|name| network.body(name).unwrap());
        assert_eq!(reading.measured, plant.outputs()[axis]);
        assert_eq!((reading.position, reading.velocity), (plant.position(user), plant.speed(user)));
        // The hand pulls at the handle with its spring and damper.
        let pull = 400.0 * (plant.position(hand) - plant.position(user)) + 23.0 * (plant.speed(hand) - plant.speed(user));
        near(reading.force, pull, 1e-9);
    }
    assert!(master.reading(2).is_none());
}

#[test]
fn what_is_no_master_is_refused() {
    let options = MasterOptions { period_s: 2e-4, run: 0, firmness: 1.0, regrips: Vec::new(), coarse: false };
    let refused = |network: &backdrive_sealed::network::Network| {
        SealedMaster::new(network, &Truth::nothing(network), &options).map(|_| ()).unwrap_err().to_string()
    };
    assert_names(refused(&device(MASS)), &["[[axes]]"]);
    assert!(refused(&device(&file("plant/models/steering-compensator.toml"))).contains("must be a force input"));
}

#[test]
fn a_hand_that_tightens_holds_where_it_is_and_gives_way_less_from_then_on() {
    let network = held(MODEL);
    let regrips = vec![Regrip { at_s: 1.5, scale: 2.0 }];
    let options = MasterOptions { period_s: 2e-4, run: 0, firmness: 1.0, regrips, coarse: true };
    let mut master = SealedMaster::new(&network, &Truth::nothing(&network), &options).unwrap();
    master.start(&[1e-3]).unwrap();
    let mut rest = |force: f64, seconds: f64| {
        (0..(seconds / 2e-4) as usize).for_each(|_| master.step(&[force], &[1e-3]).unwrap());
        let reading = master.reading(0).unwrap();
        (reading.position, reading.force)
    };
    let before = rest(2.0, 1.4);
    near(before.0, 1e-3 + 2.0 / 400.0, 1e-6);
    let after = rest(2.0, 0.5);
    // The handle stays, and so does the force of the hand.
    near(after.0, before.0, 1e-6);
    near(after.1, -2.0, 1e-4);
    let more = rest(3.0, 1.5);
    near(more.0 - after.0, 1.0 / 800.0, 1e-6);
}
