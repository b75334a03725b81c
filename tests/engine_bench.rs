//! The engine test bench as a graph: one answer over both transports and replayed, an observer that estimates the engine's torque, and the same
//! observer estimating a hand's force beside a teleoperation loop.

mod system;

use backdrive_msgs::Sample;
use system::assert_names;
use system::{Place, file, samples};

fn run(place: &Place, graph: &str, bag: &str, more: &[&str]) {
    let graph = file(graph);
    let done = place.backdrive(&[&["run", graph.as_str(), "--bag", bag, "--overwrite", "--json"], more].concat());
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    assert_eq!(done.json()["lost"], 0, "{done:?}");
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum::<f64>();
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

fn efforts(bag: &std::path::Path, topic: &str) -> Vec<f64> {
    samples(bag, topic).iter().map(|s: &Sample| s.effort[0]).collect()
}

#[test]
fn a_bench_is_the_same_in_processes_in_one_process_and_replayed() {
    let place = Place::new();
    let short = ["--duration", "7"];
    run(&place, "launch/engine-test-bench.toml", "apart.mcap", &short);
    run(&place, "launch/engine-test-bench.toml", "here.mcap", &[&short[..], &["--transport", "inproc"]].concat());
    let replayed = place.backdrive(&["replay", "apart.mcap", "--bag", "again.mcap"]);
    assert_eq!(replayed.code, Some(0), "{replayed:?}");
    for other in ["here.mcap", "again.mcap"] {
        let told = place.backdrive(&["bag", "diff", "apart.mcap", other, "--json"]);
        assert_eq!((told.code, &told.json()["same"]), (Some(0), &true.into()), "{other}: {told:?}");
    }
    // The pedal goes to 30 % at 5 s and the lag is above a second: the observer sees the torque rise with it.
    let bag = place.path("apart.mcap");
    let (truth, found) = (efforts(&bag, "/engine/torque_js"), efforts(&bag, "/observer/filtered_js"));
    assert_eq!((truth.len(), found.len()), (7000, 7000));
    assert!(truth[6999] > 60.0 && (found[6999] - truth[6999]).abs() < 0.15 * truth[6999], "{} {}", truth[6999], found[6999]);
}

#[test]
fn a_bench_is_identified_by_one_command_and_the_files_run() {
    let place = Place::new();
    let recorded = place.backdrive(&["run", &file("launch/engine-test-bench-identify.toml"), "--out", "bench", "--transport", "inproc"]);
    assert!(matches!(recorded.code, Some(0 | 1 | 7)), "{recorded:?}");
    let sheet = ["--engine-inertia", "0.85", "--stiffness", "2.2e4", "--power", "240e3", "--out", "identified"];
    let bags = ["test-bench", "bench/unfired.mcap", "bench/map.mcap", "bench/lag.mcap"];
    let unseen = ["--dragged", "bench/unfired-other.mcap", "--cycle", "bench/validation.mcap"];
    let told = place.backdrive(&[&bags[..], &unseen, &sheet, &["--json"]].concat());
    assert_eq!(told.code, Some(0), "{told:?}");
    let found = told.json();
    // The data sheet was off by 6 and 10 %.
    for (index, truth, within) in [(0, 0.7, 0.03), (1, 0.9, 0.03), (2, 2e4, 0.03), (3, 12.0, 0.1)] {
        let value = found["numbers"][index]["value"].as_f64().unwrap();
        assert!((value / truth - 1.0).abs() < within, "{}", found["numbers"][index]);
    }
    for of in found["correlations"].as_array().unwrap() {
        assert!(of["correlation"].as_f64().unwrap() > 0.95, "{of}");
    }
    // What it writes, a graph takes.
    let mut text = system::graph_text("launch/engine-test-bench.toml");
    let maps = file("launch/engine-test-bench");
    text = text.replace("\"engine-test-bench/cycle", &format!("\"{maps}/cycle")).replace("\"engine-test-bench/", "\"identified/");
    place.write("graph.toml", &text.replace("\"../plant/models/engine-test-bench.toml\"", "\"identified/shaft.toml\""));
    let run = place.backdrive(&["run", "graph.toml", "--duration", "1", "--transport", "inproc"]);
    assert!(matches!(run.code, Some(0 | 1 | 7)), "{run:?}");
    // A bag that does not show what a step needs, and one of something else.
    let told = place.backdrive(&[&["test-bench", "bench/unfired.mcap", "bench/unfired.mcap", "bench/lag.mcap"], &sheet[..]].concat());
    assert!(told.code == Some(3) && told.stderr.contains("one pedal only"), "{told:?}");
    run_contact(&place);
    let told = place.backdrive(&[&["test-bench", "contact.mcap", "bench/map.mcap", "bench/lag.mcap"], &sheet[..]].concat());
    told.ends(3, &["contact.mcap"]);
}

fn run_contact(place: &Place) {
    let done =
        place.backdrive(&["run", &file("launch/contact.toml"), "--transport", "inproc", "--duration", "0.5", "--bag", "contact.mcap"]);
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
}

#[test]
fn the_force_of_a_hand_is_told_without_a_force_sensor() {
    let place = Place::new();
    for (master, least) in [("impulse-engine-linear", 0.98), ("impulse-engine", 0.95)] {
        let model = file(&format!("plant/models/{master}.toml"));
        run(&place, "launch/user-force.toml", "user.mcap", &["--transport", "inproc", "--master", &model]);
        let bag = place.path("user.mcap");
        let (truth, found) = (efforts(&bag, "/master/user_js"), efforts(&bag, "/observer/filtered_js"));
        let error = (truth.iter().zip(&found).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / truth.len() as f64).sqrt();
        let most = truth.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let r = correlation(&truth, &found);
        println!("{master}: {error:.3} N rms of {most:.3} N, correlation {r:.4}");
        assert!(r > least, "{master}: correlation {r}, error {error} N of {most} N");
    }
}

#[test]
fn files_of_a_bench_that_are_wrong_are_told_with_their_line() {
    let place = Place::new();
    let maps = file("launch/engine-test-bench");
    let text = system::graph_text("launch/engine-test-bench.toml").replace("\"engine-test-bench/", &format!("\"{maps}/"));
    let engine = std::fs::read_to_string(file("launch/engine-test-bench/engine.toml")).unwrap();
    place.write("engine.toml", &engine.replace("torque = [-25, 65, 150, 240, 325, 410]", "torque = [-25, 65, 150]"));
    let wrong = |text: &str| {
        place.write("graph.toml", text);
        let told = place.backdrive(&["check", "graph.toml"]);
        assert_eq!(told.code, Some(3), "{told:?}");
        told.stderr
    };
    let told = wrong(&text.replace(&format!("map = \"{maps}/engine.toml\""), "map = \"engine.toml\""));
    assert_names(&told, &["engine.toml:", "6 pedals"]);
    let told = wrong(&text.replace("back_off = 1.2", "back_off = 1.0"));
    assert_names(&told, &["back_off"]);
    let told = wrong(&text.replace("noise = [0.02, 0.02]", "noise = [0.02]"));
    assert!(told.contains("1 noise levels for 2"), "{told}");
}
