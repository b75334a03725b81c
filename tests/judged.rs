//! How a loop is judged: one judgement by every verb; in free motion where the law reflects motion, at low rates, under a coarse sensor. The
//! oscillation is measured here by the handle's true motion and the force at the hand, which no verb uses.

mod system;

use backdrive_control::coupling::LawKind;
use backdrive_msgs::Message;
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides};
use backdrive_nodes::sequence::Sequence;
use backdrive_stability::collect::Collector;
use backdrive_stability::outcome::Outcome;
use std::path::PathBuf;
use system::assert_names;
use system::{Ended, Place, file, samples};

fn run(place: &Place, graph: &str, bag: &str, more: &[&str]) -> Ended {
    place.backdrive(&[&["run", &file(graph), "--transport", "inproc", "--bag", bag, "--json"], more].concat())
}

fn peak_to_peak(signal: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = signal.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    high - low
}

/// A verb's amplitude and frequency of a limit cycle.
fn cycle(said: &serde_json::Value) -> (f64, f64) {
    assert_eq!(said["outcome"], "limit_cycle", "{said}");
    (said["amplitude_m"].as_f64().unwrap(), said["frequency_hz"].as_f64().unwrap())
}

#[test]
fn a_pair_that_shakes_in_free_motion_is_a_limit_cycle_by_every_verb() {
    let place = Place::new();
    let pair = "tests/cases/bilateral-pair/pair.toml";
    let wall = file("tests/cases/bilateral-pair/far-wall.toml");
    for (bag, more) in [("pair.mcap", &[][..]), ("far.mcap", &["--environment", &wall][..])] {
        let done = run(&place, pair, bag, more);
        assert_eq!(done.code, Some(1), "{done:?}");
        let (amplitude, hz) = cycle(&done.json()["outcome_detail"]);
        let held = samples(&place.path(bag), "/master/user_js");
        let true_peak_to_peak = peak_to_peak(held.iter().skip(750).map(|s| s.position[0]));
        assert!((true_peak_to_peak - 2.0).abs() < 0.1, "{true_peak_to_peak}");
        assert!((2.0 * amplitude / true_peak_to_peak - 1.0).abs() < 0.05 && (8.2..8.9).contains(&hz), "{amplitude} {hz}");
        assert_eq!(done.json()["outcome_detail"]["unit"], "rad");

        let again = place.backdrive(&["replay", bag]);
        again.answers(1, &["limit cycle of ±1.0", " rad at 8."]);
        let why = place.backdrive(&["why", bag, "--json"]);
        assert_eq!(why.json()["happening"]["happens"], "limit_cycle", "{why:?}");
        // Nine tenths of the shaking go with the delay, the rest with the gain.
        assert_eq!(why.json()["causes"][0]["kind"], "delay", "{why:?}");
    }
    let asked = place.backdrive(&["stability", "pair.mcap", "--grips", "1", "--json"]);
    assert_eq!((asked.code, &asked.json()["verdict"]), (Some(1), &"limit_cycle".into()), "{asked:?}");

    // The same signals as a table of somebody else's.
    let [master, slave] = ["/master/measured_js", "/slave/measured_js"].map(|topic| samples(&place.path("pair.mcap"), topic));
    let rows = master.iter().zip(&slave).enumerate().map(|(row, (m, s))| {
        let torque = 290.0 * (m.position[0] - s.position[0]);
        format!("{},{},{},{},{},{torque}\n", row as f64 * 2e-3, m.position[0], m.effort[0], s.position[0], s.effort[0])
    });
    place.write("pair.csv", &format!("t,xm,Ff,xs,fs,taus\n{}", rows.collect::<String>()));
    place.write("roles.toml", "[signals]\nx_m=\"xm\"\nF_f=\"Ff\"\nx_s=\"xs\"\ntau_s=\"taus\"\nF_s=\"fs\"\n");
    let table = place.backdrive(&["stability", "pair.csv", "--roles", "roles.toml"]);
    table.answers(1, &["LIMIT_CYCLE", "limit cycle of ±1.0"]);
    assert!(!table.stdout.contains(" mm "), "{table:?}");
}

#[test]
fn at_the_rate_of_a_camera_the_loop_s_own_limit_cycle_is_found() {
    let place = Place::new();
    for rate in ["15", "30", "60"] {
        let bag = format!("{rate}.mcap");
        let done = run(&place, "launch/contact.toml", &bag, &["--canceller", "none", "--rate", rate]);
        let hertz: usize = rate.parse().unwrap();
        let held = samples(&place.path(&bag), "/master/user_js");
        let moved = peak_to_peak(held.iter().take(29 * hertz / 10).skip(2 * hertz).map(|s| s.position[0]));
        match moved > 0.1e-3 {
            true => {
                assert_eq!(done.code, Some(1), "{rate} Hz, the handle moves by {moved}: {done:?}");
                let (_, hz) = cycle(&done.json()["outcome_detail"]);
                assert!((2.0..7.0).contains(&hz), "{rate}: {hz}");
            }
            false => assert_eq!(done.code, Some(0), "{rate} Hz, the handle moves by {moved}: {done:?}"),
        }
        if rate == "30" {
            assert!(moved > 1.0e-3, "{moved}");
            let why = place.backdrive(&["why", &bag, "--json"]).json();
            let amplitude = why["happening"]["amplitude_m"].as_f64().unwrap();
            assert!(why["happening"]["happens"] == "limit_cycle" && (0.7e-3..0.8e-3).contains(&amplitude), "{why}");
            assert_names(why.to_string(), &["30 Hz"]);
        }
    }
    let arms =
        place.backdrive(&["run", &file("launch/leader-follower.toml"), "--rate", "30", "--transport", "inproc", "--bag", "arms.mcap"]);
    arms.answers(0, &["loop     stable"]);
}

#[test]
fn without_force_feedback_there_is_nothing_to_judge() {
    let place = Place::new();
    let done = place.backdrive(&["run", &file("tests/cases/one-way/one-way.toml"), "--transport", "inproc", "--bag", "one-way.mcap"]);
    done.answers(0, &["lambda is 0"]);
    let why = place.backdrive(&["why", "one-way.mcap"]);
    // The follower sticks and slips, which no gain of the loop does.
    assert_names(&why.stdout, &["stairs", "stiction in the follower (slave)"]);
    for inside in ["tolerance", "never in contact", "a search"] {
        assert!(!why.stdout.contains(inside) && !why.stderr.contains(inside), "{why:?}");
    }
}

#[test]
fn a_limit_cycle_below_a_step_of_the_encoder_is_seen_in_the_forces() {
    let place = Place::new();
    let fine = std::fs::read_to_string(file("plant/models/impulse-engine.toml")).unwrap();
    assert!(fine.contains("resolution = 2.0e-6"), "the model's encoder has changed");
    place.write("coarse.toml", &fine.replace("resolution = 2.0e-6", "resolution = 5.0e-4"));
    for (lambda, code) in [("1.0", 1), ("0.3", 0)] {
        let bag = format!("{lambda}.mcap");
        let more = ["--master", "coarse.toml", "--canceller", "none", "--lambda", lambda];
        let done = run(&place, "launch/contact.toml", &bag, &more);
        assert_eq!(done.code, Some(code), "{done:?}");
        let held = samples(&place.path(&bag), "/master/user_js");
        let swings = peak_to_peak(held.iter().take(14_000).skip(8_000).map(|s| s.effort[0]));
        assert_eq!(swings > 0.5, code == 1, "the force at the hand swings by {swings}");
        let why = place.backdrive(&["why", &bag, "--json"]).json();
        if code == 1 {
            let (amplitude, hz) = cycle(&done.json()["outcome_detail"]);
            assert!((1.5e-4..3e-4).contains(&amplitude) && (hz - 102.0).abs() < 2.0, "{amplitude} {hz}");
            assert_eq!(why["causes"][0]["kind"], "coarse_sensor", "{why}");
        } else {
            assert!(["nothing", "ringing"].iter().any(|quiet| why["happening"]["happens"] == *quiet), "{why}");
        }
    }
}

/// The graph of a link of 20 ms each way, with this law.
fn held_graph(law: LawKind, more: Overrides) -> Graph {
    let changes = Overrides { coupling: Some(law), ..more };
    Graph::load(&PathBuf::from(file("launch/coupling.toml")), &changes).unwrap()
}

/// The product's verdict on a run, and how far handle or slave truly move in the last second of the hold and in the one before.
fn judged(graph: &Graph) -> (Option<Outcome>, [f64; 2]) {
    let plans = graph.nodes.iter().filter(|n| n.kind != NodeKind::Recorder).map(|n| plan(graph, &n.name).unwrap()).collect();
    let mut sequence = Sequence::new(plans, &graph.timing).unwrap();
    let names: Vec<String> = sequence.topics().iter().map(|t| t.name.clone()).collect();
    let mut collector = Collector::of(graph, "run");
    let (mut handle, mut slave) = (Vec::new(), Vec::new());
    let mut take = |topic: usize, message: &Message| {
        match (message, names[topic].as_str()) {
            (Message::Sample(sample), "/master/user_js") => handle.push(sample.position[0]),
            (Message::Sample(sample), "/slave/measured_js") => slave.push(sample.position[0]),
            _ => {}
        }
        collector.take(&names[topic], message);
    };
    sequence.run(graph.timing.steps.unwrap(), Some(&mut take));
    let row = |time: f64| (time * graph.timing.rate_hz) as usize;
    let moved = |x: &[f64], from: f64, to: f64| peak_to_peak(x[row(from)..row(to)].iter().copied());
    let of = |from: f64, to: f64| moved(&handle, from, to).max(moved(&slave, from, to));
    (collector.outcome(), [of(2.3, 3.3), of(3.3, 4.3)])
}

#[test]
fn whatever_the_law_and_the_rate_nothing_that_shakes_is_called_stable() {
    let long = std::env::var("BACKDRIVE_LONG").as_deref() == Ok("1");
    let full = std::env::var("BACKDRIVE_FULL").as_deref() == Ok("1");
    let rates: &[f64] = match (full, long) {
        (true, _) => &[15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 250.0, 350.0, 500.0],
        (_, true) => &[15.0, 30.0, 60.0, 120.0, 250.0, 500.0],
        _ => &[15.0, 30.0, 60.0, 250.0],
    };
    let lambdas: &[f64] = if full { &[0.1, 0.3, 0.6, 1.0, 2.0, 4.0] } else { &[0.3, 2.0] };
    let mut counts = [0; 4];
    let mut wrong = Vec::new();
    for (name, law) in LawKind::ALL {
        for rate in rates {
            for lambda in lambdas {
                for free in [false, true] {
                    let environment = free.then(|| PathBuf::from("none"));
                    let graph =
                        held_graph(law, Overrides { rate_hz: Some(*rate), lambda: Some(*lambda), environment, ..Overrides::default() });
                    let (said, [before, after]) = judged(&graph);
                    // Half a millimetre that does not fall is no settling. Without a law that reflects motion a loop in free motion is open.
                    let shakes = after > 0.5e-3 && after > 0.8 * before;
                    let rests = after < 1e-6;
                    let what = format!("{name} {rate} Hz lambda {lambda} free {free}: {said:?}, moved {before:.2e} then {after:.2e}");
                    match said {
                        Some(Outcome::Stable) => counts[0] += 1,
                        Some(Outcome::NotJudged { .. }) | None => counts[2] += 1,
                        Some(_) => counts[1] += 1,
                    }
                    counts[3] += usize::from(shakes);
                    if (shakes && matches!(said, Some(Outcome::Stable) | None)) || (rests && said.is_some_and(|s| s.is_unstable())) {
                        wrong.push(what);
                    } else if full {
                        println!("{what}");
                    }
                }
            }
        }
    }
    println!("stable {}, not stable {}, not judged {}; shakes {}", counts[0], counts[1], counts[2], counts[3]);
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(counts[0] > 10 && counts[3] > 10, "{counts:?}: too little of either kind to show anything");
}
