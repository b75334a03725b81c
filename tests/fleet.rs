//! `backdrive fleet` and `backdrive gate` as processes: shards and threads give the same bytes, a kill loses nothing, a change is named, and a change of
//! the device fails the gate.

mod changed;
mod system;

use backdrive_fleet::simulated::{Arm, JOINTS, RATE, Truth, random, unit};
use std::path::Path;
use std::time::Duration;
use system::{Place, file};

const MODEL: &str = "plant/robots/seven-joint-leader.toml";

/// Writes logs of units, `change` from unit, recording and joint to what differs.
fn logs(place: &Place, folder: &str, units: usize, recordings: usize, change: impl Fn(usize, usize, usize, &mut Truth)) {
    let arm = Arm::open(Path::new(&file(MODEL))).unwrap();
    for u in 0..units {
        let own = unit(&mut random(7, u, 0));
        let below = place.path(&format!("{folder}/unit-{u}"));
        std::fs::create_dir_all(&below).unwrap();
        for r in 0..recordings {
            let mut truth: [Truth; JOINTS] = own;
            truth.iter_mut().enumerate().for_each(|(j, joint)| change(u, r, j, joint));
            let name = format!("2026-{:02}-{:02}.csv", 3 + r / 28, 1 + r % 28);
            std::fs::write(below.join(name), arm.log(&truth, RATE, &mut random(7, u, r + 1))).unwrap();
        }
    }
}

fn table(place: &Place, out: &str) -> Vec<u8> {
    std::fs::read(place.path(out).join("triage.parquet")).unwrap()
}

fn fleet<'a>(out: &'a str, model: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["fleet", "logs", "--model", model, "--out", out], more].concat()
}

#[test]
fn threads_shards_and_kills_give_the_same_table() {
    let place = Place::new();
    let model = file(MODEL);
    logs(&place, "logs", 3, 4, |_, _, _, _| {});
    place.write("logs/unit-0/broken.csv", "t,joint1.position\n0,1\n");
    let done = place.run_for(&fleet("one", &model, &["--jobs", "1"]), Duration::from_secs(200));
    assert_eq!(done.code, Some(0), "{done:?}");
    assert!(done.stdout.contains("no answer unit-0/broken.csv"), "{done:?}");
    let expected = table(&place, "one");
    place.run_for(&fleet("two", &model, &["--jobs", "2"]), Duration::from_secs(200));
    assert!(table(&place, "two") == expected, "two threads give another table");
    for shard in ["1/4", "2/4", "3/4", "4/4"] {
        assert!(!place.path("four/triage.parquet").exists());
        let done = place.run_for(&fleet("four", &model, &["--shard", shard]), Duration::from_secs(200));
        assert_eq!(done.code, Some(0), "{done:?}");
    }
    assert!(table(&place, "four") == expected, "four shards give another table");
    // Killed after more and more time, each continues where the one before was.
    let kills = if std::env::var("BACKDRIVE_FULL").as_deref() == Ok("1") { 30 } else { 4 };
    for kill in 0..kills {
        let mut child = place.command(env!("CARGO_BIN_EXE_backdrive")).args(fleet("killed", &model, &["--jobs", "2"])).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(20 + 37 * kill % 400));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let done = place.run_for(&fleet("killed", &model, &["--json"]), Duration::from_secs(200));
    assert_eq!(done.json()["recordings"]["done"], 13, "{done:?}");
    assert!(table(&place, "killed") == expected, "kills give another table");
    // What was answered is not computed again, and what changed is.
    let done = place.run_for(&fleet("one", &model, &["--json"]), Duration::from_secs(200));
    assert_eq!(done.json()["recordings"]["kept"], 13, "{done:?}");
    std::fs::copy(place.path("logs/unit-1/2026-03-01.csv"), place.path("logs/unit-0/2026-03-01.csv")).unwrap();
    place.run_for(&fleet("one", &model, &[]), Duration::from_secs(200));
    assert!(table(&place, "one") != expected, "a recording that changed keeps its answer");
}

#[test]
fn a_change_of_one_unit_is_named_and_one_of_all_is_not_laid_on_it() {
    let place = Place::new();
    let model = file(MODEL);
    logs(&place, "logs", 7, 12, |u, r, j, joint| {
        joint.gain *= if r >= 8 { 1.05 } else { 1.0 };
        joint.dry *= if (u, j) == (3, 3) && r >= 5 { 1.5 } else { 1.0 };
    });
    let done = place.run_for(&fleet("out", &model, &["--html", "page.html"]), Duration::from_secs(300));
    assert_eq!(done.code, Some(1), "{done:?}");
    let changed: Vec<&str> = done.stdout.lines().filter(|line| line.starts_with("changed")).collect();
    assert!(changed.len() == 1 && changed[0].contains("unit-3, joint4: dry friction +"), "{done:?}");
    assert!(changed[0].contains("since 6 March 2026 (95 %: "), "{done:?}");
    assert!(std::fs::read_to_string(place.path("page.html")).unwrap().contains("unit-3"));
    // The table alone gives the same.
    let again = place.backdrive(&["fleet", "out/triage.parquet", "--html", "again.html"]);
    assert_eq!((again.code, again.stdout.lines().find(|line| line.starts_with("changed"))), (Some(1), Some(changed[0])));
}

#[test]
fn the_gate_fails_where_a_joint_changed_and_writes_junit() {
    let place = Place::new();
    let model = file(MODEL);
    logs(&place, "old", 1, 2, |_, _, _, _| {});
    logs(&place, "same", 1, 4, |_, _, _, _| {});
    logs(&place, "new", 1, 2, |_, _, j, joint| joint.dry *= if j == 2 { 1.4 } else { 1.0 });
    for recording in ["2026-03-01.csv", "2026-03-02.csv"] {
        std::fs::remove_file(place.path("same/unit-0").join(recording)).unwrap();
    }
    let done = place.run_for(&["gate", "old", "same", "--model", &model], Duration::from_secs(100));
    assert_eq!(done.code, Some(0), "{done:?}");
    let done = place.run_for(&["gate", "old", "new", "--model", &model, "--junit", "gate.xml"], Duration::from_secs(100));
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stdout.contains("changed   joint3: dry friction") && done.stdout.contains("answer    1 of "), "{done:?}");
    let junit = std::fs::read_to_string(place.path("gate.xml")).unwrap();
    assert!(junit.contains("failures=\"1\"") && junit.contains("<testcase classname=\"joint3\" name=\"dry\"><failure"), "{junit}");
    // The bound of one joint.
    place.write("bounds.toml", "[joints.joint3]\ndry = 0.6\n");
    let done = place.run_for(&["gate", "old", "new", "--model", &model, "--bounds", "bounds.toml"], Duration::from_secs(100));
    assert_eq!(done.code, Some(0), "{done:?}");
    place.write("wrong.toml", "dri = 0.6\n");
    let done = place.backdrive(&["gate", "old", "new", "--model", &model, "--bounds", "wrong.toml"]);
    assert!(done.code == Some(3) && done.stderr.contains("wrong.toml") && done.stderr.contains("dri"), "{done:?}");
}

#[test]
fn the_gate_names_what_changed_in_a_loop_and_what_that_does_to_its_limit() {
    let place = Place::new();
    let graph = |name: &str, changes: &[(&str, &str)]| {
        let mut text = system::graph_text("launch/contact.toml");
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, 1);
        }
        place.write(&format!("{name}.toml"), &text);
        let bag = format!("{name}.mcap");
        let done = place.backdrive(&["run", &format!("{name}.toml"), "--transport", "inproc", "--canceller", "none", "--bag", &bag]);
        assert!([Some(0), Some(1)].contains(&done.code), "{done:?}");
        bag
    };
    let old = graph("old", &[]);
    let gated = |new: &str| place.run_for(&["gate", &old, new, "--json"], Duration::from_secs(100));
    let check = |done: &system::Ended, quantity: &str| {
        let all = done.json();
        let found = all["checks"].as_array().unwrap().iter().find(|check| check["quantity"] == quantity);
        found.unwrap_or_else(|| panic!("no {quantity}: {done:?}")).clone()
    };
    let same = gated(&graph("same", &[("seed = 1", "seed = 2")]));
    assert_eq!(same.code, Some(0), "{same:?}");
    // Twice the gain: the limit stays, and half of the margin is gone.
    let gain = gated(&graph("gain", &[("lambda = 0.3", "lambda = 0.6")]));
    assert_eq!((gain.code, check(&gain, "gains.lambda")["kind"].as_str()), (Some(1), Some("gain")), "{gain:?}");
    assert!(check(&gain, "gain_margin")["sentence"].as_str().unwrap().contains("changed: gains.lambda 0.3 -> 0.6"), "{gain:?}");
    assert_eq!(check(&gain, "critical_gain")["outcome"], "passed", "{gain:?}");
    // Five milliseconds more on the way back: a rate or a delay, and the limit falls.
    let delay = gated(&graph("delay", &[("delay = 1 ", "delay = 26 ")]));
    let key = "slave.measured to scaling.contact.delay";
    assert_eq!((delay.code, check(&delay, key)["kind"].as_str()), (Some(1), Some("rate")), "{delay:?}");
    let limit = check(&delay, "critical_gain");
    assert!(limit["outcome"] == "failed" && limit["sentence"].as_str().unwrap().contains(&format!("changed: {key} 1 -> 26")), "{delay:?}");
    // A softer wall is a parameter of the slave's environment.
    let wall = std::fs::read_to_string(file("plant/environments/stiff-wall.toml")).unwrap();
    let number = wall.lines().find_map(|line| line.trim().strip_prefix("stiffness = ")).unwrap().split('#').next().unwrap().trim();
    place.write("softer-wall.toml", &wall.replacen(&format!("stiffness = {number}"), "stiffness = 3000.0", 1));
    let stated = format!("\"{}\"", file("plant/environments/stiff-wall.toml"));
    let softer = gated(&graph("wall", &[(&stated, "\"softer-wall.toml\"")]));
    let found: Vec<String> = softer.json()["checks"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|c| c["kind"] == "parameter")
        .map(|c| c["quantity"].to_string())
        .collect();
    assert!(found.iter().any(|key| key.contains("slave.environment") && key.contains("stiffness")), "{softer:?}");
    // What nobody stated, because the bag's graph has the old delay: found by running each node alone.
    let mut bag = changed::Bag::load(&place.path("delay.mcap"));
    bag.graph(|text| text.replacen("delay = 26", "delay = 1", 1));
    bag.save(&place.path("hidden.mcap"));
    let hidden = gated("hidden.mcap");
    assert_eq!(hidden.code, Some(1), "{hidden:?}");
    let of = hidden.json()["checks"]
        .as_array()
        .unwrap()
        .iter()
        .any(|c| c["kind"] == "rate" && c["outcome"] == "failed" && c["sentence"].to_string().contains("later than the graph states"));
    assert!(of, "{hidden:?}");
}

#[test]
fn a_manifest_that_is_wrong_is_refused_with_file_and_key() {
    let place = Place::new();
    std::fs::create_dir(place.path("empty")).unwrap();
    place.write("date.toml", "[[recordings]]\nfile = \"a.csv\"\nunit = \"1\"\ndate = \"3 November\"\n");
    place.write("twice.toml", "[[recordings]]\nfile = \"a.csv\"\nunit = \"1\"\n[[recordings]]\nfile = \"a.csv\"\nunit = \"2\"\n");
    place.write("key.toml", "[[recordings]]\nfile = \"a.csv\"\nunit = \"1\"\ntemprature = 3.0\n");
    place.write("a.csv.parquet", "no parquet");
    for (manifest, words) in [
        ("empty", vec!["empty", "lists no recordings"]),
        ("date.toml", vec!["date.toml", "date", "is no date"]),
        ("twice.toml", vec!["twice.toml", "listed twice"]),
        ("key.toml", vec!["key.toml", "temprature"]),
        ("none.toml", vec!["none.toml", "there is no such file"]),
        ("a.csv.parquet", vec!["a.csv.parquet", "parquet"]),
    ] {
        let done = place.backdrive(&["fleet", manifest, "--out", "out"]);
        assert_eq!(done.code, Some(3), "{manifest}: {done:?}");
        for word in words {
            assert!(done.stderr.contains(word), "{manifest}: {word}: {done:?}");
        }
    }
}
