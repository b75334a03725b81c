//! `backdrive init`: what it writes is read, checked and diagnosed, by options alone, and nothing that is there is lost.

mod system;

use backdrive_plant::model::{Model, OutputKind};
use backdrive_plant::set::{Initial, RecordingSet};
use std::path::Path;
use system::assert_names;
use system::{Ended, Place};

/// A motor whose log is in ampere and counts.
const MOTOR: &str = r#"
motion   = "rotation"
bodies   = { rotor = 1.2e-4 }
elements = [ { name = "bearing", kind = "damper", between = ["rotor", "ground"], damping = 8e-4 } ]
inputs   = [ { name = "current", kind = "force", on = "rotor", gain = 0.035 } ]
outputs  = [ { name = "encoder", kind = "position", of = "rotor", gain = 636.62, resolution = 1.0 } ]
"#;

/// A rig whose log is in millimetres and newton.
const RIG: &str = r#"
bodies   = { rod = 0.4 }
elements = [ { name = "oil", kind = "damper", between = ["rod", "ground"], damping = 60.0 }, { name = "coil", kind = "spring", between = ["rod", "ground"], stiffness = 900.0 } ]
inputs   = [ { name = "x", kind = "motion", on = "rod" } ]
outputs  = [ { name = "load", kind = "reaction", of = "rod", noise = 0.01 } ]
"#;

const TWO: [(&str, &str); 2] =
    [("weak", "multisine:rms=0.4,from=1,to=30,period=1,periods=2,seed=1"), ("strong", "sweep:amplitude=1,from=1,to=30,duration=2")];

/// Recordings of a device in `mine/`, with these headings.
fn recorded(place: &Place, device: &str, drives: &[(&str, &str)], headings: &str) {
    place.write("device.toml", device);
    std::fs::create_dir_all(place.path("mine")).unwrap();
    for (name, drive) in drives {
        let out = format!("mine/{name}.csv");
        let done = place.backdrive(&["simulate", "device.toml", drive, "--rate", "1000", "--noise", "1", "--out", &out]);
        assert_eq!(done.code, Some(0), "{done:?}");
        let text = std::fs::read_to_string(place.path(&out)).unwrap();
        place.write(&out, &text.replacen(text.lines().next().unwrap(), headings, 1));
    }
}

fn init(place: &Place, more: &[&str]) -> Ended {
    place.backdrive(&[&["init", "mine"], more].concat())
}

fn written(place: &Place) -> (Model, RecordingSet) {
    (Model::load(&place.path("mine/model.toml")).unwrap(), RecordingSet::open(&place.path("mine")).unwrap())
}

const OF_A_MOTOR: [&str; 12] =
    ["--motion", "rotation", "--driven", "current", "--drive", "i", "--constant", "0.035", "--position", "enc", "--per-count", "1.5708e-3"];

#[test]
fn a_motor_with_a_current_log_is_written_checked_and_found_to_lack_nothing() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "t [s],i [A],enc [counts]");
    let done = init(&place, &[&OF_A_MOTOR[..], &["--yes", "--json"]].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    let told = done.json();
    assert_eq!((&told["held_out"][0], &told["fit"][0]), (&"weak.csv".into(), &"strong.csv".into()), "{told}");
    let (model, set) = written(&place);
    assert!((model.bodies[0].inertia / 1.2e-4 - 1.0).abs() < 0.05, "{}", model.bodies[0].inertia);
    assert_eq!((model.inputs[0].name.as_str(), model.outputs[0].resolution), ("motor_torque", 1.5708e-3));
    assert!(matches!(model.outputs[0].kind, OutputKind::Position(0)) && model.outputs[0].name == "enc");
    assert_eq!((set.initial, set.held_out.as_slice()), (Initial::Rest, ["weak.csv".to_string()].as_slice()));
    // The next command is as it stands there, and finds nothing missing in a motor that hides nothing.
    assert_eq!(told["next"], "backdrive diagnose mine --out mine/diagnosis");
    let next = told["next"].as_str().unwrap().to_string();
    let diagnosed = place.backdrive(&next.split(' ').skip(1).collect::<Vec<_>>());
    assert_eq!(diagnosed.code, Some(0), "{diagnosed:?}");
}

#[test]
fn a_prescribed_motion_has_a_reaction_and_its_spring_is_estimated() {
    let place = Place::new();
    let drives =
        [("a", "multisine:rms=0.002,from=0.5,to=8,period=2,periods=2,seed=1"), ("b", "sweep:amplitude=0.003,from=0.5,to=8,duration=3")];
    recorded(&place, RIG, &drives, "t,way,load [N]");
    let done = init(&place, &["--motion", "translation", "--driven", "motion", "--drive", "way", "--yes"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let (model, _) = written(&place);
    assert!(matches!(model.outputs[0].kind, OutputKind::Reaction(0)), "{model:?}");
    let near = |path: &str, meant: f64| assert!((model.values_at(path).unwrap()[0] / meant - 1.0).abs() < 0.05, "{path}: {model:?}");
    near("bodies.body", 0.4);
    near("elements.bearing.damping", 60.0);
    near("elements.spring.stiffness", 900.0);
}

#[test]
fn a_load_a_hand_and_both_sensors_have_their_places() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "time_s,i [A],enc [counts]");
    for name in ["weak", "strong"] {
        let text = std::fs::read_to_string(place.path("mine").join(format!("{name}.csv"))).unwrap();
        let wider: Vec<String> =
            text.lines().enumerate().map(|(n, l)| if n == 0 { format!("{l},rpm [rpm],say") } else { format!("{l},{n}.0,RUN") }).collect();
        place.write(&format!("mine/{name}.csv"), &wider.join("\n"));
    }
    let more = [
        "--attached",
        "load",
        "--resonance",
        "20",
        "--hand",
        "--velocity",
        "rpm",
        "--start",
        "free",
        "--held-out",
        "mine/strong.csv",
        "--yes",
    ];
    let done = init(&place, &[&OF_A_MOTOR[..], &more].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(done.stdout.contains("say"), "what is not used is told: {done:?}");
    let (model, set) = written(&place);
    assert_eq!(model.bodies.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), ["motor", "load", "hand"]);
    assert_eq!(model.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(), ["enc", "rpm"]);
    // Two halves on the joint ring, as in the answers.
    let of = |path: &str| model.values_at(path).unwrap()[0];
    let ring = (of("elements.joint.stiffness") * (1.0 / of("bodies.motor") + 1.0 / of("bodies.load"))).sqrt() / std::f64::consts::TAU;
    assert!((ring - 20.0).abs() < 0.2, "{ring}");
    assert_eq!((set.unknown[0].0.as_str(), set.initial, set.held_out[0].as_str()), ("hand", Initial::Free, "strong.csv"));
}

#[test]
fn bags_are_asked_for_by_topic_and_field() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "t,i,enc");
    for name in ["weak", "strong"] {
        let (table, bag) = (format!("mine/{name}.csv"), format!("bags/{name}.mcap"));
        let map = ["--map", "i=/motor/js.effort[0]", "--map", "enc=/motor/js.position[0]"];
        std::fs::create_dir_all(place.path("bags")).unwrap();
        let done = place.backdrive(&[&["bag", "import", table.as_str(), "--bag", bag.as_str()][..], &map].concat());
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    let options = [
        "--motion",
        "rotation",
        "--driven",
        "current",
        "--drive",
        "/motor/js.effort[0]",
        "--drive-unit",
        "A",
        "--constant",
        "0.035",
        "--position",
        "position",
        "--position-unit",
        "counts",
        "--per-count",
        "1.5708e-3",
        "--yes",
    ];
    let done = place.backdrive(&[&["init", "bags"][..], &options].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    let set = std::fs::read_to_string(place.path("bags/set.toml")).unwrap();
    assert!(set.contains(r#"{ topic = "/motor/js", field = "effort[0]", unit = "A", scale = 0.035 }"#), "{set}");
}

#[test]
fn what_is_missing_or_cannot_be_is_told_with_its_option_and_nothing_is_written() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "t [s],i [A],enc [counts]");
    std::fs::create_dir_all(place.path("empty")).unwrap();
    let with = |from: &'static str, to: &'static [&'static str]| -> Vec<&'static str> {
        let at = OF_A_MOTOR.iter().position(|o| *o == from).unwrap();
        [&OF_A_MOTOR[..at], to, &OF_A_MOTOR[at + 2..], &["--yes"]].concat()
    };
    let cases: Vec<(Vec<&str>, i32, &str)> = vec![
        (vec![], 2, "give --motion: "),
        (vec!["--yes"], 2, "give --drive: "),
        (with("--constant", &[]), 2, "give --constant: "),
        (with("--per-count", &[]), 2, "give --per-count: "),
        (with("--drive", &["--drive", "j"]), 2, "--drive \"j\": unknown column \"j\""),
        (with("--drive", &["--drive", "enc"]), 2, "a current (A) is needed"),
        (with("--position", &["--position", "none"]), 2, "without a measured signal"),
        (with("--position", &["--position", "enc", "--force", "i"]), 2, "--attached load"),
        (with("--position", &["--position", "enc", "--held-out", "other.csv"]), 2, "is not one of the recordings"),
        (with("--constant", &["--constant", "0"]), 2, "above 0"),
    ];
    let none = |place: &Place| !place.path("mine/model.toml").exists() && !place.path("mine/set.toml").exists();
    for (options, code, says) in cases {
        let done = init(&place, &options);
        assert_eq!(done.code, Some(code), "{options:?}: {done:?}");
        assert!(done.stderr.contains(says) && done.stdout.is_empty() && none(&place), "{options:?}: {done:?}");
    }
    for (folder, says) in [("empty", "has no recordings"), ("nowhere", "there is no such folder")] {
        let done = place.backdrive(&["init", folder, "--yes"]);
        assert!(done.code == Some(3) && done.stderr.contains(says), "{done:?}");
    }
}

#[test]
fn what_is_there_is_replaced_only_when_told_to() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "t [s],i [A],enc [counts]");
    place.write("mine/set.toml", "# mine\n");
    let all = [&OF_A_MOTOR[..], &["--yes"]].concat();
    let done = init(&place, &all);
    done.ends(3, &["set.toml", "--overwrite"]);
    assert!(
        std::fs::read_to_string(place.path("mine/set.toml")).unwrap() == "# mine\n" && !Path::new(&place.path("mine/model.toml")).exists()
    );
    assert_eq!(init(&place, &[&all[..], &["--overwrite"]].concat()).code, Some(0));
    assert_eq!(written(&place).1.fit, ["strong.csv"]);
}

#[test]
fn what_diagnose_would_refuse_and_an_inertia_that_cannot_be_are_told() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "t [s],i [A],enc [counts]");
    let all = [&OF_A_MOTOR[..], &["--yes"]].concat();
    // In g cm^2, as data sheets have it.
    let done = init(&place, &[&all[..], &["--inertia", "1200"]].concat());
    assert!(done.code == Some(0) && done.stdout.contains("times the estimate from the recordings"), "{done:?}");
    let done = init(&place, &[&all[..], &["--inertia", "1.1e-4", "--overwrite"]].concat());
    assert!(done.code == Some(0) && !done.stdout.contains("times the estimate from the recordings"), "{done:?}");
    // Recordings of two rates do not belong together.
    let slow: Vec<String> = std::fs::read_to_string(place.path("mine/weak.csv"))
        .unwrap()
        .lines()
        .enumerate()
        .filter(|(n, _)| *n == 0 || n % 10 == 1)
        .map(|l| l.1.to_string())
        .collect();
    place.write("mine/weak.csv", &slow.join("\n"));
    let done = init(&place, &[&all[..], &["--overwrite"]].concat());
    assert_eq!(done.code, Some(3), "{done:?}");
    assert_names(&done.stderr, &["mixed_rates"]);
}

#[test]
fn a_number_that_nothing_measures_is_an_error_with_its_line_and_column() {
    let place = Place::new();
    recorded(&place, MOTOR, &TWO, "t [s],i [A],enc [counts]");
    let text = std::fs::read_to_string(place.path("mine/weak.csv")).unwrap();
    for number in ["-1e308", "3.4028235e38", "1e34"] {
        let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
        let row = lines[45].rsplit_once(',').unwrap().0.to_string();
        lines[45] = format!("{row},{number}");
        place.write("mine/weak.csv", &(lines.join("\n") + "\n"));
        let done = init(&place, &[&OF_A_MOTOR[..], &["--yes"]].concat());
        assert_eq!(done.code, Some(3), "{done:?}");
        assert_names(&done.stderr, &["weak.csv:46", "enc", number]);
    }
}
