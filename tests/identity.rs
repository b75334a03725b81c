//! One graph, one answer: in one process, over shared memory, and replayed from its bag.

mod system;

use backdrive_bags::{Reader, Recorder, RecorderOptions};
use backdrive_msgs::Message;
use std::path::Path;
use system::{Ended, Place, file, graph_text, messages};

/// Steps are few: bits that part do so at once, and the two-axis graph touches its first wall at 0.4 s.
const SHORT: &str = "1.0";

fn run(place: &Place, graph: &str, transport: &str, bag: &str, changes: &[&str]) {
    let mut arguments = vec!["run", graph, "--transport", transport, "--bag", bag, "--duration", SHORT, "--json"];
    arguments.extend(changes);
    let done = place.backdrive(&arguments);
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    assert_eq!(done.json()["lost"], 0, "{done:?}");
}

fn diff(place: &Place, a: &str, b: &str) -> Ended {
    place.backdrive(&["bag", "diff", a, b, "--json"])
}

fn assert_same(place: &Place, a: &str, b: &str, least: u64) {
    let found = diff(place, a, b);
    let report = found.json();
    assert_eq!((found.code, &report["same"]), (Some(0), &true.into()), "{found:?}");
    let topics = report["topics"].as_array().unwrap();
    let compared: u64 = topics.iter().map(|t| t["compared"].as_u64().unwrap()).sum();
    assert!(compared >= least, "only {compared} messages were compared");
}

/// The same over both transports, and replayed from either bag.
fn one_answer(place: &Place, graph: &str, changes: &[&str]) {
    run(place, graph, "inproc", "here.mcap", changes);
    run(place, graph, "iceoryx2", "apart.mcap", changes);
    assert_same(place, "here.mcap", "apart.mcap", 9 * 5000);
    let contact = system::samples(&place.path("apart.mcap"), "/slave/measured_js");
    assert!(contact.iter().any(|s| s.effort[0] < -0.1), "nothing was touched: the comparison says little");
    for bag in ["here.mcap", "apart.mcap"] {
        let replayed = place.backdrive(&["replay", bag, "--bag", "again.mcap", "--overwrite"]);
        assert!(matches!(replayed.code, Some(0 | 1 | 7)), "{replayed:?}");
        assert_same(place, bag, "again.mcap", 9 * 5000);
    }
}

#[test]
fn plain() {
    let master = file("plant/models/rigid-mass.toml");
    one_answer(&Place::new(), &file("launch/contact.toml"), &["--master", &master, "--canceller", "none", "--lambda", "0.1"]);
}

#[test]
fn with_the_canceller() {
    one_answer(&Place::new(), &file("launch/contact.toml"), &[]);
}

#[test]
fn with_dither_guard_and_a_gain_that_makes_it_ring() {
    let changes = ["--canceller", "none", "--lambda", "5", "--guard", "--dither"];
    one_answer(&Place::new(), &file("launch/contact.toml"), &changes);
}

#[test]
fn on_two_axes() {
    let place = Place::new();
    one_answer(&place, &file("launch/two-axis.toml"), &[]);
    let measured = system::samples(&place.path("apart.mcap"), "/master/measured_js");
    assert!(measured.iter().all(|s| s.axes == 2));
    assert!(measured.iter().any(|s| (s.position[0] - s.position[1]).abs() > 1e-3), "both axes did the same");
}

#[test]
fn over_a_bad_connection() {
    let place = Place::new();
    let impaired = "to = \"slave.command\"\nimpair = { delay_s = 0.003, jitter_s = 0.002, loss = 0.05 }\n";
    let text = graph_text("launch/contact.toml").replace("to = \"slave.command\"\n", impaired);
    let graph = place.write("impaired.toml", &text).display().to_string();
    one_answer(&place, &graph, &["--lambda", "0.1"]);
    run(&place, &file("launch/contact.toml"), "inproc", "fine.mcap", &["--lambda", "0.1"]);
    assert_eq!(diff(&place, "fine.mcap", "apart.mcap").code, Some(1), "the impairment changed nothing");
    run(&place, &graph, "inproc", "other.mcap", &["--lambda", "0.1", "--seed", "2"]);
    assert_eq!(diff(&place, "other.mcap", "apart.mcap").code, Some(1), "another seed changed nothing");
}

/// Nodes that share a process say on their topics what they say in processes of their own.
#[test]
fn nodes_together_in_a_process() {
    let place = Place::new();
    let changes = ["--guard", "--dither", "--lambda", "5"];
    run(&place, &file("launch/contact.toml"), "iceoryx2", "apart.mcap", &changes);
    for (together, sharing) in [
        ("[\"scaling\", \"canceller\"]", 2),
        ("[[\"operator\", \"master\"], [\"slave\", \"scaling\"]]", 4),
        ("[\"slave\", \"scaling\", \"canceller\", \"master\", \"operator\"]", 5),
    ] {
        let text = format!("together = {together}\n{}", graph_text("launch/contact.toml"));
        let graph = place.write("together.toml", &text).display().to_string();
        let mut arguments = vec!["run", &graph, "--bag", "together.mcap", "--duration", SHORT, "--json", "--overwrite"];
        arguments.extend(changes);
        let done = place.backdrive(&arguments);
        let report = done.json();
        assert_eq!(report["lost"], 0, "{done:?}");
        // Every node is reported under its own name, with those that shared its process.
        let nodes = report["run"]["nodes"].as_array().unwrap();
        for name in ["operator", "master", "canceller", "scaling", "slave", "recorder"] {
            let node = nodes.iter().find(|n| n["name"] == name).unwrap_or_else(|| panic!("{name} is not reported: {report}"));
            assert_eq!((&node["end"], &node["status"]["steps"]), (&"done".into(), &5000.into()), "{report}");
        }
        assert_eq!(nodes.iter().filter(|n| n["with"].is_array()).count(), sharing, "{report}");
        assert_same(&place, "apart.mcap", "together.mcap", 9 * 5000);
    }
}

/// A copy of a bag in which one message is changed.
fn copy_with(from: &Path, to: &Path, mut change: impl FnMut(&str, &mut Message)) {
    let reader = Reader::open(from).unwrap();
    let header = reader.header().unwrap();
    let mut recorder = Recorder::create(to, header, &RecorderOptions::lockstep()).unwrap();
    for (topic, mut message) in messages(from) {
        change(&topic, &mut message);
        let place = header.topics.iter().position(|t| t.topic.name == topic).unwrap();
        recorder.push(place, message, 0).unwrap();
    }
    assert_eq!(recorder.finish().unwrap().lost(), 0);
}

#[test]
fn one_bit_of_one_sample_is_found() {
    let place = Place::new();
    run(&place, &file("launch/contact.toml"), "inproc", "a.mcap", &[]);
    copy_with(&place.path("a.mcap"), &place.path("copy.mcap"), |_, _| {});
    assert_same(&place, "a.mcap", "copy.mcap", 9 * 5000);

    copy_with(&place.path("a.mcap"), &place.path("b.mcap"), |topic, message| {
        if let Message::Sample(sample) = message
            && (topic, sample.step) == ("/slave/servo_jp", 4321)
        {
            sample.position[0] = f64::from_bits(sample.position[0].to_bits() ^ 1);
        }
    });
    let told = place.backdrive(&["bag", "diff", "a.mcap", "b.mcap"]);
    assert_eq!(told.code, Some(1), "{told:?}");
    for word in ["/slave/servo_jp", "4321", "position[0]"] {
        assert!(told.stdout.contains(word), "{word} is not named: {}", told.stdout);
    }
    let found = diff(&place, "a.mcap", "b.mcap").json();
    assert_eq!(found["first"][0], "/slave/servo_jp");
    assert_eq!((&found["first"][1]["step"], &found["first"][1]["field"]), (&4321.into(), &"position[0]".into()));
    let differing: u64 = found["topics"].as_array().unwrap().iter().map(|t| t["differing"].as_u64().unwrap()).sum();
    assert_eq!(differing, 1);
    // What is asked to be ignored is.
    assert_eq!(place.backdrive(&["bag", "diff", "a.mcap", "b.mcap", "--tolerance", "/slave/servo_jp=1e-12"]).code, Some(0));
    assert_eq!(place.backdrive(&["bag", "diff", "a.mcap", "b.mcap", "--ignore", "/slave/servo_jp"]).code, Some(0));
}
