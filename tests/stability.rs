//! `backdrive stability` from the outside: its output, its exit codes, and honest answers to bags that lack something.

mod system;

use backdrive_bags::{Reader, Recorder, RecorderOptions};
use backdrive_msgs::Message;
use nix::sys::signal::Signal;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use system::assert_names;
use system::{Place, file};

/// A short push on the wall by the linear master: fast to run, and its stability limit is sharp.
fn record(place: &Place, bag: &str, more: &[&str]) {
    let graph = file("launch/push-and-hold.toml");
    let master = file("plant/models/impulse-engine-linear.toml");
    let dither = "multisine:peak=0.3,from=1,to=400,period=1,crest=50";
    let plain = ["run", &graph, "--transport", "inproc", "--duration", "7", "--master", &master, "--limits", "ignored", "--bag", bag];
    let dithered = if more.contains(&"--dither") { Vec::new() } else { vec!["--dither", dither] };
    let done = place.backdrive(&[&plain[..], &dithered[..], more].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
}

/// Copies a bag, message by message as `change` leaves them; those that it rejects are left out.
fn rewrite(from: &Path, to: &Path, mut change: impl FnMut(&str, &mut Message) -> bool) {
    let reader = Reader::open(from).unwrap();
    let header = reader.header().unwrap().clone();
    let mut recorder = Recorder::create(to, &header, &RecorderOptions::lockstep()).unwrap();
    for entry in reader.messages().unwrap() {
        let entry = entry.unwrap();
        let Some(mut message) = entry.message(from).unwrap() else { continue };
        if change(&entry.topic.name, &mut message)
            && let Some(place) = header.topic(&entry.topic.name)
        {
            recorder.push(place, message, 0).unwrap();
        }
    }
    let _ = recorder.finish();
}

fn ask(place: &Place, bag: &str, more: &[&str]) -> (Option<i32>, Value) {
    let done = place.backdrive(&[&["stability", bag, "--json", "--grips", "1"], more].concat());
    assert!(done.code.is_some_and(|c| [0, 1, 7].contains(&c)), "{done:?}");
    (done.code, done.json())
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {value}"))
}

fn texts(value: &Value, key: &str) -> String {
    value[key].to_string()
}

#[test]
fn below_and_beyond_the_edge() {
    let place = Place::new();
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    let (code, low) = ask(&place, "run.mcap", &["--gain", "0.3"]);
    assert_eq!((code, low["verdict"].as_str()), (Some(0), Some("stable")), "{low}");
    for key in [
        "/gain",
        "/verdict",
        "/critical_gain",
        "/critical_gain_ci95/0",
        "/margins/gain_db",
        "/margins/phase_deg",
        "/margins/delay_ms",
        "/margins/modulus",
        "/methods/frequency/verdict",
        "/methods/resimulation/verdict",
        "/methods/energy/verdict",
    ] {
        assert!(low.pointer(key).is_some_and(|v| !v.is_null()), "{key} is missing in {low}");
    }
    assert!(low.get("limit_cycle").is_some_and(Value::is_null) && low["disagreement"].is_array());
    // Both methods find one stability limit, and models that are right are not called wrong.
    let (edge, measured) = (number(&low, "/critical_gain"), number(&low, "/methods/frequency/critical_gain"));
    assert!((measured / edge - 1.0).abs() < 0.1, "{edge} and {measured}");
    assert!(!texts(&low, "disagreement").contains("\"model\""), "{}", low["disagreement"]);
    assert!((number(&low, "/margins/gain_db") - 20.0 * (measured / 0.3).log10()).abs() < 0.2, "{low}");

    let beyond = format!("{}", 1.5 * edge);
    let (code, high) = ask(&place, "run.mcap", &["--gain", &beyond]);
    assert_eq!(code, Some(1), "{high}");
    assert!(["limit_cycle", "unstable"].contains(&high["verdict"].as_str().unwrap()), "{high}");
    assert_eq!(high["methods"]["frequency"]["verdict"], "unstable");
    let hz = number(&high, "/methods/frequency/frequency_hz");
    assert!((50.0..90.0).contains(&hz), "{hz}");

    // By mu and lambda it is the same question.
    let (_, split) = ask(&place, "run.mcap", &["--mu", "2", "--lambda", "0.15"]);
    assert_eq!((number(&split, "/gain"), split["verdict"].as_str()), (0.3, Some("stable")));
}

#[test]
fn the_edge_is_the_loop_s_and_not_the_question_s() {
    let place = Place::new();
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    let edges = ["1e-3", "0.3", "1", "5"].map(|gain| ask(&place, "run.mcap", &["--gain", gain]).1);
    for found in &edges {
        for path in ["/critical_gain", "/critical_frequency_hz", "/methods/frequency/critical_gain", "/methods/resimulation/critical_gain"]
        {
            assert_eq!(number(found, path), number(&edges[0], path), "{path} at {}", found["gain"]);
        }
    }
    // An impossible question for any loop ends at once, and reports this.
    for gain in ["1e-300", "1e300"] {
        let begun = std::time::Instant::now();
        let done = place.backdrive(&["stability", "run.mcap", "--gain", gain]);
        assert!(done.code == Some(3) && done.stderr.contains("out of range"), "{done:?}");
        assert!(begun.elapsed().as_secs() < 30, "{:?}", begun.elapsed());
    }
}

#[test]
fn a_swapped_part_and_a_named_script() {
    let place = Place::new();
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    let (model, grip) = (file("plant/models/impulse-engine-linear.toml"), file("plant/grips/normal.toml"));
    let (_, plain) = ask(&place, "run.mcap", &["--gain", "0.3"]);
    let (code, cancelled) =
        ask(&place, "run.mcap", &["--gain", "3", "--canceller", &model, "--canceller-grip", &grip, "--sensors", "ideal"]);
    assert_eq!(code, Some(0), "an exact copy cancels all: {cancelled}");
    assert!(cancelled["critical_gain"].is_null() && number(&cancelled, "/at_least") >= 50.0, "{cancelled}");
    let firm = file("plant/grips/firm.toml");
    let over = ["--gain", "3", "--grip", &firm, "--canceller", &model, "--canceller-grip", &grip];
    let (code, over) = ask(&place, "run.mcap", &over);
    assert_eq!(code, Some(1), "{over}");
    assert!(texts(&over, "warnings").contains("stiffer"), "{}", over["warnings"]);
    let soft = file("plant/environments/soft-tissue.toml");
    let (_, tissue) = ask(&place, "run.mcap", &["--gain", "0.3", "--environment", &soft]);
    assert!(number(&tissue, "/critical_gain") > 2.0 * number(&plain, "/critical_gain"), "{tissue}");
    let script = file("launch/contact.toml");
    let (_, scripted) = ask(&place, "run.mcap", &["--gain", "0.3", "--script", &script]);
    assert!(scripted.pointer("/methods/resimulation/script").unwrap().as_str().unwrap().contains("Contact task"), "{scripted}");
}

#[test]
fn a_bag_without_excitation() {
    let place = Place::new();
    // A dither without power is none.
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    rewrite(&place.path("run.mcap"), &place.path("quiet.mcap"), |topic, _| topic != "/scaling/dither_jf");
    let graph = std::fs::read_to_string(file("launch/push-and-hold.toml")).unwrap().replace("../plant", &file("plant"));
    let without: Vec<&str> = graph.lines().filter(|l| !l.starts_with("dither")).collect();
    place.write("graph.toml", &without.join("\n"));
    let master = file("plant/models/impulse-engine-linear.toml");
    let run = ["run", "graph.toml", "--transport", "inproc", "--duration", "5", "--lambda", "0.2", "--bag", "plain.mcap"];
    assert_eq!(place.backdrive(&[&run[..], &["--limits", "ignored", "--master", &master]].concat()).code, Some(0));
    let (code, found) = ask(&place, "plain.mcap", &["--gain", "0.3"]);
    assert_eq!(found["methods"]["frequency"]["verdict"], "cannot_tell", "{found}");
    assert!(found["methods"]["frequency"]["critical_gain"].is_null());
    assert_names(texts(&found, "advice"), &["--dither"]);
    // The models are all there and do what was recorded: they are used, and the output states that only they were.
    assert_eq!((code, found["from"].as_str()), (Some(0), Some("resimulation")));
    assert!(texts(&found, "warnings").contains("not measured"), "{}", found["warnings"]);
    // Without models that do what was recorded there is no evidence.
    let mut step = 0_u64;
    rewrite(&place.path("plain.mcap"), &place.path("strange.mcap"), |topic, message| {
        if let (Message::Sample(sample), "/master/measured_js") = (message, topic) {
            step += 1;
            sample.position[0] *= 1.0 + 0.3 * (step as f64 * 0.01).sin();
        }
        true
    });
    let (code, strange) = ask(&place, "strange.mcap", &["--gain", "0.3"]);
    assert_eq!((code, strange["verdict"].as_str()), (Some(7), Some("cannot_tell")), "{strange}");
    assert!(texts(&strange, "disagreement").contains("the master's model does not explain"), "{strange}");
}

#[test]
fn bags_that_lack_something() {
    let place = Place::new();
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    let (_, whole) = ask(&place, "run.mcap", &["--gain", "0.3"]);
    let edge = number(&whole, "/critical_gain");

    // The force on the slave: no answer is possible, and the reason is stated.
    rewrite(&place.path("run.mcap"), &place.path("deaf.mcap"), |topic, _| topic != "/slave/measured_js");
    let done = place.backdrive(&["stability", "deaf.mcap", "--gain", "0.3"]);
    done.ends(3, &["F_s", "deaf.mcap"]);

    // The operator: the hand is recovered.
    rewrite(&place.path("run.mcap"), &place.path("unseen.mcap"), |topic, _| topic != "/operator/setpoint_js");
    let (code, unseen) = ask(&place, "unseen.mcap", &["--gain", "0.3"]);
    assert_eq!(code, Some(0), "{unseen}");
    assert!(texts(&unseen, "warnings").contains("recovered"), "{}", unseen["warnings"]);
    assert!((number(&unseen, "/critical_gain") / edge - 1.0).abs() < 0.1, "{unseen}");

    // Dropouts: counted, and lived with.
    let mut count = 0_u64;
    rewrite(&place.path("run.mcap"), &place.path("holes.mcap"), |topic, _| {
        count += u64::from(topic == "/slave/measured_js");
        !(topic == "/slave/measured_js" && count % 997 < 3)
    });
    let (code, holes) = ask(&place, "holes.mcap", &["--gain", "0.3"]);
    assert_eq!(code, Some(0), "{holes}");
    assert!(texts(&holes, "warnings").contains("have no message"), "{}", holes["warnings"]);
    assert!((number(&holes, "/methods/frequency/critical_gain") / edge - 1.0).abs() < 0.1, "{holes}");
}

#[test]
fn two_gains_in_one_file() {
    let place = Place::new();
    let graph = std::fs::read_to_string(file("launch/push-and-hold.toml")).unwrap().replace("../plant", &file("plant"));
    let graph = graph.replace("ramp_s = 0.05", "change = [{ at_s = 6.0, mu = 1.0, lambda = 0.1 }]\nramp_s = 0.05");
    place.write("two.toml", &graph);
    let master = file("plant/models/impulse-engine-linear.toml");
    let run =
        ["run", "two.toml", "--transport", "inproc", "--lambda", "0.2", "--bag", "two.mcap", "--limits", "ignored", "--master", &master];
    let done = place.backdrive(&[&run[..], &["--dither", "multisine:peak=0.3,from=1,to=400,period=1,crest=50"]].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    let (code, found) = ask(&place, "two.mcap", &["--gain", "0.3"]);
    assert_eq!(code, Some(0), "{found}");
    assert_eq!((number(&found, "/recorded_gain/0"), number(&found, "/recorded_gain/1")), (0.1, 0.2));
    let (edge, measured) = (number(&found, "/critical_gain"), number(&found, "/methods/frequency/critical_gain"));
    assert!((measured / edge - 1.0).abs() < 0.1, "{edge} and {measured}");
}

#[test]
fn a_force_that_is_clipped() {
    let place = Place::new();
    let model = std::fs::read_to_string(file("plant/models/impulse-engine-linear.toml")).unwrap();
    let clipped: Vec<&str> =
        model.lines().filter(|l| !l.starts_with("force  ") && !l.starts_with("force ") || !l.contains("8.9")).collect();
    place.write("clipped.toml", &(clipped.join("\n") + "\nforce = 0.5\n"));
    let graph = file("launch/push-and-hold.toml");
    let run =
        ["run", &graph, "--transport", "inproc", "--duration", "6", "--lambda", "0.3", "--master", "clipped.toml", "--bag", "run.mcap"];
    let done = place.backdrive(&run);
    assert_eq!(done.code, Some(1), "a clipped run is limited: {done:?}");
    let (code, found) = ask(&place, "run.mcap", &["--gain", "0.3"]);
    assert_eq!(code, Some(1), "{found}");
    assert_eq!(found["verdict"], "limited", "{found}");
    assert!(!found["methods"]["resimulation"]["limited_from"].is_null(), "{found}");
    // The headline states where the clamp ends the stable range, and no margin of another limit stands beside it.
    let (headline, again) = (number(&found, "/limited_from"), number(&found, "/methods/resimulation/limited_from"));
    assert!((headline / again - 1.0).abs() < 0.01, "{found}");
    assert!(found["critical_gain"].is_null() && found["margins"]["phase_deg"].is_null(), "{found}");
    let text = place.backdrive(&["stability", "run.mcap", "--gain", "0.3", "--grips", "1"]).stdout;
    assert!(text.contains("on a clamp acts or the master leaves its travel") && text.contains("dB to where a clamp acts"), "{text}");
}

#[test]
fn the_report_is_one_file_and_a_sweep_has_every_gain() {
    let place = Place::new();
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    let asked = ["stability", "run.mcap", "--gain", "0.3", "--sweep", "0.1:10:12", "--html", "r.html", "--grips", "1,1.2", "--json"];
    let done = place.backdrive(&asked);
    assert_eq!(done.code, Some(0), "{done:?}");
    let found = done.json();
    let sweep = found["sweep"].as_array().unwrap();
    assert_eq!(sweep.len(), 12);
    assert_eq!((sweep[0]["verdict"].as_str(), number(&sweep[11], "/gain")), (Some("stable"), 10.0));
    assert!(sweep.iter().any(|p| p["verdict"] != "stable"));
    assert_eq!(found["grips"].as_array().unwrap().len(), 1, "the grip as it is belongs to the edge itself");
    let page = std::fs::read_to_string(place.path("r.html")).unwrap();
    for part in ["Nyquist", "coherence", "Verdict over the loop gain", "energy", "What to do now", "× 1 (as recorded)", "application/json"]
    {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.replace("http://www.w3.org/", "").contains("http"), "nothing is fetched");
    assert!(!page.contains("mu*lambda"), "one spelling of the gain");
    let text = place.backdrive(&["stability", "run.mcap", "--gain", "0.3", "--grips", "1"]);
    for part in ["verdict  STABLE", "limit", "margins", "energy"] {
        assert!(text.stdout.contains(part), "{part}: {}", text.stdout);
    }
}

#[test]
fn an_interrupted_sweep_prints_what_it_has() {
    let place = Place::new();
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    let child = Command::new(env!("CARGO_BIN_EXE_backdrive"))
        .args(["stability", "run.mcap", "--sweep", "0.1:50:5000", "--grips", "1"])
        .current_dir(place.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Longer than the 5 s after which a program without a terminal reports its progress.
    std::thread::sleep(std::time::Duration::from_secs(8));
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(child.id() as i32), Signal::SIGINT).unwrap();
    let done = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout);
    assert_eq!(done.status.code(), Some(130), "{text}");
    assert!(text.contains("sweep") && text.contains("stopped after") && text.contains("of 5000 gains"), "{text}");
    let told = String::from_utf8_lossy(&done.stderr);
    assert!(told.lines().any(|l| l.starts_with("sweep: ") && l.contains(" of 5000, after 5 s")), "{told}");
}

#[test]
fn wrong_questions() {
    let place = Place::new();
    place.write("empty.toml", "");
    record(&place, "run.mcap", &["--lambda", "0.2"]);
    for (words, code, told) in [
        (vec!["stability", "none.mcap"], 3, "none.mcap"),
        (vec!["stability", "."], 3, "name the bag in it, ./run.mcap"),
        (vec!["stability", "tmp"], 3, "is a folder without a bag"),
        (vec!["stability", "run.mcap", "--gain", "0"], 2, "above 0"),
        (vec!["stability", "run.mcap", "--gain", "1", "--mu", "2"], 2, "cannot be used with"),
        (vec!["stability", "run.mcap", "--sweep", "1:2"], 2, "FROM:TO:COUNT"),
        (vec!["stability", "run.mcap", "--sweep", "2:1:5"], 2, "FROM"),
        (vec!["stability", "run.mcap", "--roles", "empty.toml"], 3, "empty.toml"),
        (vec!["stability", "run.mcap", "--html", "/dev/null/r.html"], 5, "r.html"),
        (vec!["stability", "run.mcap", "--script", "empty.toml"], 3, "empty.toml"),
    ] {
        let done = place.backdrive(&words);
        assert!(done.code == Some(code) && done.stderr.contains(told), "{words:?}: {done:?}");
    }
}
