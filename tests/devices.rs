//! Devices on a graph, with emulators in place of hardware: a pair of arms, what its bag holds, and what happens where a cable is pulled.

mod system;

use backdrive_bags::Reader;
use backdrive_msgs::{Message, Sample, measured};
use std::path::Path;
use system::{Place, alone, assert_names, file};

/// The graph of the pair with its files where they are, and other changes.
fn pair(place: &Place, changes: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(file("launch/servo-pair.toml"))
        .unwrap()
        .replace("\"servo-pair/", &format!("\"{}/", file("launch/servo-pair")));
    for (from, to) in changes {
        assert!(text.contains(from), "the graph has no {from}");
        text = text.replace(from, to);
    }
    place.write("pair.toml", &text).display().to_string()
}

/// An emulator of the follower with faults.
fn follower_with(place: &Place, faults: &str) -> String {
    let folder = file("launch/servo-pair");
    let text = std::fs::read_to_string(format!("{folder}/emulated-follower.toml")).unwrap();
    let text = text.replace("model = \"", &format!("model = \"{folder}/")).replace("latency_s", &format!("faults = [{faults}]\nlatency_s"));
    place.write("emulated.toml", &text).display().to_string()
}

/// All samples of a topic.
fn samples(bag: &Path, topic: &str) -> Vec<Sample> {
    let reader = Reader::open(bag).unwrap();
    let mut found = Vec::new();
    for entry in reader.messages().unwrap() {
        let entry = entry.unwrap();
        if entry.topic.name == topic
            && let Some(Message::Sample(sample)) = entry.message(reader.path()).unwrap()
        {
            found.push(sample);
        }
    }
    found
}

#[test]
fn a_pair_of_emulated_arms_runs_with_one_command_and_its_bag_says_what_was_measured() {
    let (_alone, place) = (alone(), Place::new());
    let graph = pair(&place, &[("duration_s = 20.0", "duration_s = 4.0")]);
    let drawn = place.backdrive(&["graph", &graph]);
    drawn.answers(0, &["unilateral: gives no force", "device follower (feetech_sts, 3 joints, emulated)"]);
    let done = place.backdrive(&["run", &graph, "--bag", "pair.mcap"]);
    assert!(done.code == Some(0) || done.code == Some(4), "{done:?}");
    assert_names(&done.stderr, &["unilateral"]);
    let bag = place.path("pair.mcap");
    let (leader, command) = (samples(&bag, "/leader/measured_js"), samples(&bag, "/follower/servo_jp"));
    let follower = samples(&bag, "/follower/measured_js");
    assert!(leader.len() > 600 && command.len() > 600 && follower.len() > 600, "{} {} {}", leader.len(), command.len(), follower.len());
    // The hand moves the leader, and the follower goes where it is commanded.
    let range = |samples: &[Sample]| {
        let seen: Vec<f64> = samples.iter().filter_map(|s| measured(s.position[0])).collect();
        let (low, high) = seen.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        high - low
    };
    assert!(range(&leader) > 0.2 && (range(&follower) - range(&leader)).abs() < 0.15, "{} {}", range(&leader), range(&follower));
    // A current without a sign is no torque: absent, and not zero.
    assert!(leader.iter().chain(&follower).all(|s| s.effort[..3].iter().all(|e| measured(*e).is_none())));
    let (bus, current) = (samples(&bag, "/follower/bus"), samples(&bag, "/follower/current"));
    let last = bus.last().unwrap();
    assert!(bus.len() > 20 && last.position[0] > 1.0 && last.position[0] < 220.0, "{last:?}");
    assert!(current.iter().any(|s| measured(s.position[0]).is_some_and(|a| a > 0.0)));
    assert!(samples(&bag, "/leader/temperature").iter().filter_map(|s| measured(s.position[0])).all(|t| t == 32.0));
    // A bag that was cut off is diagnosed as far as it goes, and called so.
    let whole = std::fs::read(&bag).unwrap();
    std::fs::write(place.path("cut.mcap"), &whole[..whole.len() * 3 / 4]).unwrap();
    let cut = place.backdrive(&["diagnose", "cut.mcap", "--out", "cut", "--no-report"]);
    assert!(matches!(cut.code, Some(0 | 1)), "{cut:?}");
    assert_names(&cut.stderr, &["cut.mcap was not closed", "bag recover"]);
    // What is hidden is nowhere in the bag.
    let reader = Reader::open(&bag).unwrap();
    let held = reader.header().unwrap();
    let told = format!("{} {:?}", held.graph_toml, held.files);
    assert!(!told.contains("coulomb") && !told.contains("dead_band") && told.contains("feetech_sts"), "{told}");
}

#[test]
fn a_recording_of_devices_is_not_run_and_not_opened() {
    let (_alone, place) = (alone(), Place::new());
    let graph = pair(&place, &[("duration_s = 20.0", "duration_s = 0.5")]);
    place.backdrive(&["run", &graph, "--bag", "pair.mcap"]);
    let replayed = place.backdrive(&["replay", "pair.mcap"]);
    assert!(replayed.code == Some(3), "{replayed:?}");
    // Nobody's intent is in the bag of a pair that a hand moved, and no port is opened to find that out.
    assert_names(&replayed.stderr, &["no operator", "intent"]);
}

#[test]
fn a_pulled_cable_is_reported_and_what_was_not_measured_is_absent() {
    let (_alone, place) = (alone(), Place::new());
    let emulator = follower_with(&place, "\"closed@1.5\"");
    let original = format!("\"{}/emulated-follower.toml\"", file("launch/servo-pair"));
    let graph = pair(&place, &[("duration_s = 20.0", "duration_s = 4.0"), (&original, &format!("\"{emulator}\""))]);
    let done = place.backdrive(&["run", &graph, "--bag", "pulled.mcap"]);
    assert_eq!(done.code, Some(6), "a run that lost its device is no success: {done:?}");
    assert_names(&done.stderr, &["device_gone"]);
    let follower = samples(&place.path("pulled.mcap"), "/follower/measured_js");
    let last = follower.iter().rposition(|s| measured(s.position[0]).is_some()).unwrap();
    assert!(last > 20 && last + 200 < follower.len(), "{last} of {}", follower.len());
}

#[test]
fn devices_that_cannot_run_are_refused_at_the_line() {
    let place = Place::new();
    let lockstep = pair(&place, &[("clock = \"realtime\"", "clock = \"lockstep\"")]);
    place.backdrive(&["check", &lockstep]).ends(3, &["real time only"]);
    let nothing = format!("{}/leader.toml", file("launch/servo-pair"));
    let follower = format!("device = \"{}/follower.toml\"", file("launch/servo-pair"));
    let still = pair(&place, &[(&follower, &format!("device = \"{nothing}\""))]);
    place.backdrive(&["check", &still]).ends(3, &["takes nothing"]);
    let alone = pair(&place, &[(&follower, "model = \"none.toml\"")]);
    place.backdrive(&["check", &alone]).ends(3, &["emulator", "without a device"]);
}
