//! `backdrive prove`: the seal, what the bags do not contain, and that the diagnosis does not need the truth.

#[path = "common/skipped.rs"]
mod skipped;
mod system;

use backdrive_bags::Reader;
use backdrive_plant::model::Model;
use sha2::{Digest, Sha256};
use skipped::skipped;
use std::path::{Path, PathBuf};
use system::assert_names;
use system::{Place, file};

/// The hidden plant's program, which a build of the workspace puts beside ours; a message and nothing else where it is not built.
fn hidden_plant() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_BIN_EXE_backdrive")).with_file_name("backdrive-sealed");
    if !path.is_file() {
        skipped(format_args!("there is no {}; cargo build -p backdrive-sealed makes it", path.display()));
    }
    Some(path).filter(|p| p.is_file())
}

fn prove(place: &Place, more: &[&str]) -> system::Ended {
    prove_with(place, &[], more)
}

/// With other files than the project's for some options.
fn prove_with(place: &Place, others: &[(&str, &str)], more: &[&str]) -> system::Ended {
    let inputs = [
        ("--model", "plant/models/impulse-engine-linear.toml"),
        ("--grip", "plant/grips/normal.toml"),
        ("--second-order", "plant/models/impulse-engine-second-order.toml"),
        ("--session", "launch/prove.toml"),
        ("--contact", "launch/contact.toml"),
        ("--regrip", "launch/contact-regrip.toml"),
    ];
    let other = |option: &str| others.iter().find(|(name, _)| *name == option).map(|(_, path)| path.to_string());
    let files: Vec<(&str, String)> = inputs.iter().map(|(option, path)| (*option, other(option).unwrap_or_else(|| file(path)))).collect();
    let mut arguments = vec!["prove", "--same-grip", "--nonlinear"];
    arguments.extend(files.iter().flat_map(|(option, path)| [*option, path.as_str()]));
    arguments.extend(more);
    place.run_for(&arguments, std::time::Duration::from_secs(600))
}

#[test]
fn a_sealed_effect_is_diagnosed_without_its_truth() {
    if std::env::var("BACKDRIVE_LONG").as_deref() != Ok("1") {
        return skipped("two searches of a minute; BACKDRIVE_LONG=1 runs them");
    }
    if hidden_plant().is_none() {
        return;
    }
    let place = Place::new();
    let ended = prove(&place, &["--seed", "13", "--operator", "hidden", "--nominal", "refitted", "--effort", "0.4", "--out", "proof"]);
    assert!([Some(0), Some(1)].contains(&ended.code), "{ended:?}");
    let case = place.path("proof/case-001");

    // The digest was printed first, and is the truth's.
    let truth = std::fs::read(case.join("sealed/truth.json")).unwrap();
    let digest: String = Sha256::digest(&truth).iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(ended.stdout.lines().next().unwrap().contains(&digest), "{}", ended.stdout);

    // The bags hold the digest and the nominal model, and neither the truth, nor how the hidden plant was run, nor the hand.
    for name in ["sweep", "touch", "touch-again"] {
        let reader = Reader::open(&case.join(format!("session/{name}.mcap"))).unwrap();
        let header = reader.header().unwrap();
        assert!(header.title.contains(&digest), "{}", header.title);
        assert!(header.files.iter().any(|(name, _)| name.ends_with("nominal.toml")));
        let text = format!("{}{}", header.graph_toml, header.files.iter().map(|f| f.1.as_str()).collect::<String>());
        assert!(!text.contains("truth") && !text.contains("sealed-master") && !text.contains("waypoints"), "{text}");
        let topics: Vec<&str> = header.topics.iter().map(|t| t.topic.name.as_str()).collect();
        assert!(!topics.iter().any(|t| t.starts_with("/operator") || t.ends_with("/user_js")), "{topics:?}");
        assert!(reader.completeness().is_some_and(|c| c.topics.iter().all(|t| t.lost == 0)));
    }

    // The nominal numbers are those of a refit to the session before.
    let nominal = Model::load(&case.join("nominal.toml")).unwrap();
    let given = Model::load(Path::new(&file("plant/models/impulse-engine-linear.toml"))).unwrap();
    let handed = Model::load(&case.join("session/model.toml")).unwrap();
    let at = |model: &Model, path: &str| model.values_at(path).unwrap()[0];
    assert_eq!(at(&handed, "bodies.handle"), at(&nominal, "bodies.handle"));
    assert_ne!(at(&handed, "bodies.handle"), at(&given, "bodies.handle"));

    let proof: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(place.path("proof/proof.json")).unwrap()).unwrap();
    let found = &proof["cases"][0];
    assert_eq!(found["sealed"], digest.as_str());
    assert_eq!(found["shows_hand"], false);
    let read = |path: PathBuf| serde_json::from_str::<serde_json::Value>(&std::fs::read_to_string(path).unwrap()).unwrap();
    let said = read(case.join("diagnosis/verdict.json"));
    assert!(said["sentence"].as_str().is_some_and(|sentence| !sentence.is_empty()), "{said}");
    assert_eq!((&found["verdict"], &found["sentence"]), (&said["verdict"], &said["sentence"]));
    assert_eq!(found["nominal_refitted"], true);
    let gain = |canceller: &str| {
        let all = found["stable_gain"].as_array().unwrap();
        all.iter().find(|g| g["canceller"] == canceller).and_then(|g| g["stable_to"].as_f64()).unwrap()
    };
    assert!(gain("none") > 0.05 && gain("diagnosed") > 0.0 && gain("chosen") >= 0.94 * gain("none").min(gain("diagnosed")));
    assert!(place.path("proof/proof.html").is_file());

    // All effects count once, and again where the refitted nominal model differs from held-out data.
    let floors = found["refit_floors"].as_f64().unwrap();
    assert!(floors > 0.5, "{floors}");
    let summary = &proof["summary"];
    assert_eq!((&summary["place"]["of"], &summary["showing"]["place"]["of"]), (&1.into(), &usize::from(floors >= 3.0).into()), "{summary}");

    // The graph itself was run below and above the critical gain without canceller; its bags are there.
    let live = found["live"].as_array().unwrap();
    let of_none = |below: bool| live.iter().find(|run| run["canceller"] == "none" && run["below_edge"] == below).unwrap();
    assert_eq!(of_none(true)["outcome"], "stable");
    assert_ne!(of_none(false)["outcome"], "stable");
    assert!(case.join("live/none-below.mcap").is_file());

    // Once more where no process could look: the truth is gone, and the diagnosis does as before.
    std::fs::rename(case.join("sealed"), place.path("elsewhere")).unwrap();
    let (session, out) = (case.join("session"), place.path("again"));
    let (session, out) = (session.display().to_string(), out.display().to_string());
    let again =
        place.run_for(&["diagnose", &session, "--out", &out, "--effort", "0.4", "--no-report"], std::time::Duration::from_secs(300));
    assert!([Some(0), Some(1), Some(7)].contains(&again.code), "{again:?}");
    let verdict = read(place.path("again/verdict.json"));
    assert_eq!(verdict["unknown_inputs"][0]["input"], "normal.hand");
    let error = |v: &serde_json::Value| v["held_out"]["nrmse_before"].as_f64().unwrap();
    assert!((error(&verdict) / error(&said) - 1.0).abs() < 1e-6);
}

#[test]
fn what_cannot_be_proven_is_told_in_one_line() {
    let place = Place::new();
    let of = |arguments: &[&str]| place.run_for(arguments, std::time::Duration::from_secs(60));
    let ended = prove(&place, &["--plant", "no-such-program"]);
    assert_eq!(ended.code, Some(5), "{ended:?}");
    assert_names(&ended.stderr, &["no-such-program", "cargo build"]);
    let ended = of(&["prove", "--effects", "7"]);
    ended.ends(2, &["0 to 3"]);
    let ended = prove_with(&place, &[("--session", "nothing.toml")], &["--out", "other"]);
    ended.ends(3, &["nothing.toml"]);
    // An error in what is needed last is reported first, and nothing is sealed that would prevent the next try.
    let ended = prove_with(&place, &[("--contact", "no-task.toml")], &["--out", "third"]);
    assert_eq!(ended.code, Some(3), "{ended:?}");
    assert_names(&ended.stderr, &["no-task.toml", "--contact"]);
    assert!(!place.path("third").exists());
    // A pipe without a writer, and a device that never ends, are no files, whichever of them it is.
    let pipe = place.path("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for option in ["--model", "--grip", "--second-order", "--session", "--contact", "--regrip"] {
        for path in [pipe.to_str().unwrap(), "/dev/zero"] {
            let ended = prove_with(&place, &[(option, path)], &["--out", "fourth"]);
            ended.ends(3, &[path]);
        }
    }
    assert!(!place.path("fourth").exists());
}
