//! `backdrive diagnose` and `backdrive fit` on recordings made here: omitted dry friction is named, a right model is accepted, and what cannot be
//! diagnosed is reported in one line.

mod system;

use backdrive_plant::excitation::Excitation;
use backdrive_plant::model::Model;
use backdrive_plant::stepper::{Options, simulate};
use std::fmt::Write as _;
use system::Place;
use system::{PANIC, assert_names};

const NOMINAL: &str = "name = 'small-master'
[bodies]
motor = 0.02   # kg
handle = 0.1
[[elements]]
name = 'cable'
kind = 'spring'
between = ['motor', 'handle']
stiffness = 3000.0
[[elements]]
name = 'cable_damping'
kind = 'damper'
between = ['motor', 'handle']
damping = 3.0
[[elements]]
name = 'grip'
kind = 'spring'
between = ['handle', 'ground']
stiffness = 400.0
[[elements]]
name = 'grip_damping'
kind = 'damper'
between = ['handle', 'ground']
damping = 8.0
[[inputs]]
name = 'force'
kind = 'force'
on = 'motor'
hold = 'zero'
[[outputs]]
name = 'position'
kind = 'position'
of = 'motor'
";
const FRICTION: &str = "[[elements]]
name = 'friction'
kind = 'coulomb'
between = ['motor', 'ground']
force = 0.4
";
const SET: &str = "model = 'model.toml'\nfit = ['sweep.csv', 'triangle.csv']\nheld_out = ['multisine.csv']\n";
const RATE: f64 = 1000.0;

/// A device that differs from the nominal text by what is added, recorded with a little noise.
fn record(place: &Place, truth: &str) {
    let model = Model::from_toml(truth, "truth").unwrap();
    let drives = [
        ("sweep", "sweep:amplitude=2,from=0.5,to=40,duration=2"),
        ("triangle", "triangle:amplitude=1.5,period=0.5,cycles=4"),
        ("multisine", "multisine:rms=1.2,from=0.5,to=40,period=2"),
    ];
    for (i, (name, drive)) in drives.iter().enumerate() {
        let drive: Excitation = drive.parse().unwrap();
        let force = drive.samples(RATE).unwrap();
        let columns = simulate(&model, &[&force], 1.0 / RATE, &Options { substeps: Some(8), ..Options::default() }).unwrap();
        let mut text = "t,force,position\n".to_string();
        let mut state = 12345 + i as u64;
        for (k, (u, y)) in force.iter().zip(&columns[0]).enumerate() {
            // Noise of a standard deviation of 2 micrometres: the sum of twelve even numbers.
            let mut noise = -6.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                noise += (state >> 33) as f64 / (1u64 << 31) as f64;
            }
            let _ = writeln!(text, "{},{u},{}", k as f64 / RATE, y + 2e-6 * noise);
        }
        place.write(&format!("{name}.csv"), &text);
    }
    place.write("model.toml", NOMINAL);
    place.write("set.toml", SET);
}

fn read(place: &Place, name: &str) -> String {
    std::fs::read_to_string(place.path(name)).unwrap()
}

#[test]
fn friction_that_was_left_out_is_named_and_written() {
    let place = Place::new();
    record(&place, &format!("{NOMINAL}{FRICTION}"));
    let done = place.backdrive(&["diagnose", ".", "--out", "out", "--effort", "2"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    let verdict: serde_json::Value = serde_json::from_str(&read(&place, "out/verdict.json")).unwrap();
    assert_eq!(verdict["verdict"], "missing", "{verdict:#}");
    let finding = &verdict["findings"][0];
    assert_eq!(finding["physics"], "coulomb", "{verdict:#}");
    assert_eq!(finding["between"], serde_json::json!(["motor", "ground"]), "{verdict:#}");
    let force = &finding["parameters"]["force"];
    assert!((force["value"].as_f64().unwrap() - 0.4).abs() < 0.02, "{verdict:#}");
    // What remains is a statement of its own: here the sensor's noise, so nothing that it looks like.
    let left = &verdict["remaining"];
    assert!(left["share"].as_f64().unwrap() < 0.1 && left["noise_sd"].as_f64().unwrap() < 1.15 && left["where"].is_null(), "{left}");
    assert!(verdict["sentence"].as_str().is_some_and(|s| done.stdout.contains(s)), "{done:?}");
    let held = &verdict["held_out"];
    let of = |key: &str| held[key].as_f64().unwrap();
    assert!(of("nrmse_after") < 0.1 * of("nrmse_refit") && of("nrmse_refit") <= of("nrmse_before"), "{verdict:#}");
    assert!(verdict["audit"].as_array().is_some_and(|a| a.iter().any(|r| r["what"] == "noise")), "{verdict:#}");
    // The model is the nominal one with the friction added: it loads, and keeps its comments.
    let text = read(&place, "out/model.diagnosed.toml");
    let model = Model::from_toml(&text, "diagnosed").unwrap();
    assert!(model.elements.iter().any(|e| e.law.kind().name == "coulomb"), "{text}");
    assert_names(&text, &["# kg"]);
    for said in ["audit ", "refit ", "MISSING", "dry friction at the motor", "held out", "out: verdict.json"] {
        assert!(done.stdout.contains(said), "\"{said}\" is missing: {}", done.stdout);
    }
    assert!(done.stdout.lines().count() < 20, "{}", done.stdout);
    let report = read(&place, "out/report.html");
    for said in [
        "Where the models differ most",
        "Dry friction at the motor: force against velocity",
        "What to do now",
        "All hypotheses",
        "sensor&#39;s noise",
        "held out",
    ] {
        assert!(report.contains(said), "the report does not say \"{said}\"");
    }
    let seconds: f64 = read(&place, "out/time.txt").trim().parse().unwrap();
    assert!(seconds > 0.0);

    // Withheld, it is not named.
    let done = place.backdrive(&["diagnose", ".", "--out", "less", "--without", "coulomb", "--effort", "0.4", "--no-report", "--json"]);
    let verdict = done.json();
    let named: Vec<&str> = verdict["findings"].as_array().unwrap().iter().filter_map(|f| f["physics"].as_str()).collect();
    assert!(!named.contains(&"coulomb") && !named.contains(&"stribeck"), "{verdict:#}");
    assert!(!place.path("less/report.html").exists());

    // Refitting the numbers alone does not do.
    let done = place.backdrive(&["fit", "model.toml", ".", "--out", "fitted.toml", "--json"]);
    let fit = done.json();
    let worst = fit["fitted"].as_array().unwrap().iter().map(|q| q["floors"].as_f64().unwrap()).fold(0.0, f64::max);
    assert!(worst > 3.0, "{fit:#}");
    assert!(done.code == Some(0) || done.code == Some(1), "{done:?}");
    Model::from_toml(&read(&place, "fitted.toml"), "fitted").unwrap();
}

#[test]
fn a_right_model_is_left_alone_and_its_numbers_are_found() {
    let place = Place::new();
    record(&place, NOMINAL);
    let done = place.backdrive(&["diagnose", "set.toml", "--out", "out", "--no-report"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let verdict: serde_json::Value = serde_json::from_str(&read(&place, "out/verdict.json")).unwrap();
    assert_eq!(verdict["verdict"], "nothing_missing", "{verdict:#}");
    assert_eq!(verdict["findings"], serde_json::json!([]));

    // Recordings by name: the last one is held out. A stiffness that is off by a fifth is found, with its error, and the rest stays.
    place.write("off.toml", &NOMINAL.replace("3000.0", "2500.0"));
    let done = place.backdrive(&["fit", "off.toml", "sweep.csv", "triangle.csv", "multisine.csv", "--out", "fitted.toml", "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert_names(&done.stderr, &["multisine.csv"]);
    let fit = done.json();
    let row = fit["numbers"].as_array().unwrap().iter().find(|r| r["name"] == "elements.cable.stiffness").unwrap();
    let of = |key: &str| row[key].as_f64().unwrap();
    assert!((of("value") - 3000.0).abs() < 4.0 * of("standard_error"), "{row}");
    assert!(of("standard_error") < 30.0 && of("moved_sd") > 10.0, "{row}");
    assert!(fit["fitted"].as_array().unwrap().iter().all(|q| q["floors"].as_f64().unwrap() < 1.2), "{fit:#}");
    assert_eq!(fit["agree"], true, "{fit:#}");
    let text = read(&place, "fitted.toml");
    assert_names(&text, &["was 2500"]);
    let stiffness = Model::from_toml(&text, "fitted").unwrap().values_at("elements.cable.stiffness").unwrap()[0];
    assert!((stiffness - of("value")).abs() < 1e-3 * stiffness);
    let done = place.backdrive(&["fit", "off.toml", "set.toml"]);
    for said in ["parameter", "std. error", "elements.cable.stiffness", "in noise sd", "sweep.csv", "agree within their errors"] {
        assert!(done.stdout.contains(said), "\"{said}\" is missing: {}", done.stdout);
    }
}

#[test]
fn bags_that_do_not_start_at_rest_are_diagnosed_too() {
    let place = Place::new();
    record(&place, &format!("{NOMINAL}{FRICTION}"));
    let done = place.backdrive(&["bag", "import", "sweep.csv", "triangle.csv", "multisine.csv", "--bag", "bags"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    // The device moves already where the rows that count begin.
    place.write(
        "set.toml",
        "model = 'model.toml'
fit = ['bags/sweep.mcap', 'bags/triangle.mcap']
held_out = ['bags/multisine.mcap']
initial = 'free'
[columns]
force = { topic = '/recording/force', field = 'position[0]' }
position = { topic = '/recording/position', field = 'position[0]' }
[files.'bags/triangle.mcap']
rows = [310, 1900]
[files.'bags/multisine.mcap']
rows = [155, 1900]
",
    );
    let done = place.backdrive(&["diagnose", ".", "--out", "out", "--effort", "2", "--json"]);
    let verdict = done.json();
    assert_eq!(verdict["verdict"], "missing", "{verdict:#}");
    // Dry friction, by whichever law has Coulomb's as a limit: where the device already moves, presliding may have been anything.
    let friction = &verdict["findings"][0];
    let name = friction["physics"].as_str().unwrap();
    assert!(["coulomb", "dahl", "stribeck", "friction_deficit", "asymmetric_coulomb"].contains(&name), "{verdict:#}");
    assert_eq!(friction["between"], serde_json::json!(["motor", "ground"]), "{verdict:#}");
    let level = ["force", "coulomb", "positive"].iter().find_map(|key| friction["parameters"][key]["value"].as_f64()).unwrap();
    assert!((level - 0.4).abs() < 0.02, "{verdict:#}");
    let held = &verdict["held_out"];
    let of = |key: &str| held[key].as_f64().unwrap();
    assert!(of("nrmse_after") < 0.2 * of("nrmse_refit"), "{verdict:#}");
    assert_names(read(&place, "out/report.html"), &["at the motor: force against"]);

    // A bag that was cut off is used as far as it goes, and this is reported.
    let whole = std::fs::read(place.path("bags/sweep.mcap")).unwrap();
    std::fs::write(place.path("cut.mcap"), &whole[..whole.len() / 2]).unwrap();
    let done = place.backdrive(&["fit", "model.toml", "cut.mcap"]);
    assert_names(&done.stderr, &["cut.mcap", "backdrive bag recover"]);
}

#[test]
fn interrupted_it_writes_what_it_has() {
    let place = Place::new();
    record(&place, &format!("{NOMINAL}{FRICTION}"));
    let run = place.start(&["diagnose", ".", "--out", "out", "--effort", "1000", "--patience", "600"]);
    std::thread::sleep(std::time::Duration::from_millis(300));
    system::kill(run.pid(), nix::sys::signal::Signal::SIGINT);
    let done = run.end();
    // Either it was still at work, or it had found everything already.
    assert!(done.code == Some(130) || done.code == Some(1), "{done:?}");
    assert!(done.code == Some(1) || done.stderr.contains("the results so far are written"), "{done:?}");
    let verdict: serde_json::Value = serde_json::from_str(&read(&place, "out/verdict.json")).unwrap();
    assert!(verdict["verdict"].is_string(), "{verdict:#}");
    Model::from_toml(&read(&place, "out/model.diagnosed.toml"), "diagnosed").unwrap();
    assert!(place.path("out/report.html").exists());
}

/// A recording of `n` rows with these columns; what is wrong with it is done to the text.
fn recording(n: usize, header: &str, row: impl Fn(usize) -> String) -> String {
    (0..n).fold(format!("{header}\n"), |text, k| format!("{text}{}\n", row(k)))
}

#[test]
fn what_cannot_be_diagnosed_is_told_in_one_line() {
    let place = Place::new();
    place.write("model.toml", NOMINAL);
    let wave = |k: usize, f: f64| (k as f64 * f).sin();
    let fine = |k: usize| format!("{},{},{}", k as f64 * 1e-3, wave(k, 0.05), 1e-3 * wave(k, 0.049));
    place.write("fine.csv", &recording(300, "t,force,position", fine));
    place.write("other.csv", &recording(300, "t,torque,position", fine));
    place.write("outputs.csv", &recording(300, "t,force,angle", fine));
    place.write("short.csv", &recording(3, "t,force,position", fine));
    place.write("empty.csv", "");
    place.write("nan.csv", &recording(300, "t,force,position", |k| if k == 70 { "0.070,NaN,0.0".to_string() } else { fine(k) }));
    let back = |k: usize| fine(if k > 150 { k - 100 } else { k });
    place.write("back.csv", &recording(300, "t,force,position", back));
    let still = |k: usize| format!("{},0,{}", k as f64 * 1e-3, 1e-3 * wave(k, 0.05));
    place.write("still.csv", &recording(300, "t,force,position", still));
    let dead = |k: usize| format!("{},{},0.004", k as f64 * 1e-3, wave(k, 0.05));
    place.write("dead.csv", &recording(300, "t,force,position", dead));
    let model = Model::from_toml(NOMINAL, "model").unwrap();
    let force: Vec<f64> = (0..2000).map(|k| 2.0 * wave(k, 0.02)).collect();
    let moved = simulate(&model, &[&force], 1e-3, &Options::default()).unwrap();
    let in_mm = |k: usize| format!("{},{},{}", k as f64 * 1e-3, force[k], 1e3 * moved[0][k]);
    place.write("mm.csv", &recording(2000, "t,force,position", in_mm));
    for folder in ["nothing", "held"] {
        std::fs::create_dir(place.path(folder)).unwrap();
    }
    place.write("held/model.toml", NOMINAL);
    place.write("held/a.csv", &recording(300, "t,force,position", fine));
    place.write("held/set.toml", "model = 'model.toml'\nfit = ['a.csv']\nheld_out = ['b.csv']\n");
    let cases: [(&[&str], &[&str]); 15] = [
        (&["fine.csv"], &["fine.csv", "--model"]),
        (&["other.csv", "--model", "model.toml"], &["other.csv", "no signal \"force\"", "torque", "[columns]"]),
        (&["outputs.csv", "--model", "model.toml"], &["position", "recorded"]),
        (&["short.csv", "--model", "model.toml"], &["short.csv", "3 samples", "at least"]),
        (&["empty.csv", "--model", "model.toml"], &["empty.csv"]),
        (&["nan.csv", "--model", "model.toml"], &["nan.csv", "force", "NaN"]),
        (&["back.csv", "--model", "model.toml"], &["back.csv", "time does not rise"]),
        (&["still.csv", "--model", "model.toml"], &["still.csv", "force", "constant", "record an excitation"]),
        (&["dead.csv", "--model", "model.toml"], &["dead.csv", "position", "constant"]),
        (&["mm.csv", "--model", "model.toml"], &["mm.csv", "position", "1000 times", "mm", "scale = 0.001"]),
        (&["nothing", "--model", "model.toml"], &["nothing", "no recordings"]),
        (&["held"], &["set.toml", "b.csv", "no file"]),
        (&["absent"], &["absent", "no such file"]),
        (&["fine.csv", "held", "--model", "model.toml"], &["held", "not a recording"]),
        (&["fine.csv", "--model", "missing.toml"], &["missing.toml"]),
    ];
    for (arguments, says) in cases {
        let all: Vec<&str> = ["diagnose"].into_iter().chain(arguments.iter().copied()).chain(["--out", "out"]).collect();
        let done = place.backdrive(&all);
        assert_eq!(done.code, Some(3), "{arguments:?}: {done:?}");
        for text in says {
            assert!(done.stderr.contains(text), "{arguments:?}: standard error does not say \"{text}\": {}", done.stderr);
        }
        assert_eq!(done.stderr.lines().filter(|l| l.starts_with("error:")).count(), 1, "{arguments:?}: {}", done.stderr);
        assert!(!done.stderr.contains(PANIC), "{arguments:?}: {}", done.stderr);
        assert_eq!(done.stdout, "", "{arguments:?}");
        assert!(!place.path("out").exists(), "{arguments:?}: left a folder");
    }
    let done = place.backdrive(&["diagnose", "fine.csv", "--model", "model.toml", "--out", "out", "--without", "magnetism"]);
    done.ends(2, &["magnetism", "coulomb"]);
    let done = place.backdrive(&["fit", "model.toml", "nothing"]);
    assert!(done.code == Some(3) && done.stderr.contains("no recordings"), "{done:?}");
}

#[test]
fn what_a_fit_has_seen_is_not_held_out_too() {
    let place = Place::new();
    record(&place, NOMINAL);
    std::fs::copy(place.path("sweep.csv"), place.path("copy.csv")).unwrap();
    std::os::unix::fs::symlink("sweep.csv", place.path("link.csv")).unwrap();
    // The same samples in other bytes: a table with other line ends, and the bag that it is imported into.
    place.write("other-bytes.csv", &read(&place, "sweep.csv").replace('\n', "\r\n"));
    assert_eq!(place.backdrive(&["bag", "import", "sweep.csv", "--bag", "bag.mcap"]).code, Some(0));
    std::fs::create_dir(place.path("set")).unwrap();
    for file in ["model.toml", "sweep.csv", "copy.csv"] {
        std::fs::copy(place.path(file), place.path(&format!("set/{file}"))).unwrap();
    }
    place.write("set/set.toml", "model = 'model.toml'\nfit = ['sweep.csv']\nheld_out = ['copy.csv']\n");
    let cases: [&[&str]; 9] = [
        &["diagnose", "sweep.csv", "sweep.csv", "--model", "model.toml", "--out", "out"],
        &["diagnose", "sweep.csv", "./sweep.csv", "--model", "model.toml", "--out", "out"],
        &["diagnose", "sweep.csv", "copy.csv", "--model", "model.toml", "--out", "out"],
        &["diagnose", "sweep.csv", "link.csv", "--model", "model.toml", "--out", "out"],
        &["diagnose", "sweep.csv", "other-bytes.csv", "--model", "model.toml", "--out", "out"],
        &["diagnose", "bag.mcap", "sweep.csv", "--model", "model.toml", "--out", "out"],
        &["diagnose", "set", "--out", "out"],
        &["fit", "model.toml", "sweep.csv", "copy.csv"],
        &["fit", "model.toml", "set"],
    ];
    for arguments in cases {
        let done = place.backdrive(arguments);
        assert_eq!(done.code, Some(3), "{arguments:?}: {done:?}");
        assert!(done.stderr.contains("held out") && !done.stderr.contains("no fit uses it"), "{arguments:?}: {done:?}");
        assert!(!place.path("out").exists(), "{arguments:?}");
    }
}

#[test]
fn a_hand_that_was_recorded_and_that_nothing_takes_stops_a_diagnosis() {
    let place = Place::new();
    record(&place, NOMINAL);
    for file in ["sweep.csv", "triangle.csv", "multisine.csv"] {
        let text = read(&place, file);
        let more = |(k, line): (usize, &str)| if k == 0 { format!("{line},normal.hand,comment") } else { format!("{line},0,1") };
        place.write(file, &text.lines().enumerate().map(more).collect::<Vec<_>>().join("\n"));
    }
    let done = place.backdrive(&["diagnose", ".", "--out", "out"]);
    assert_eq!(done.code, Some(3), "{done:?}");
    for said in ["normal.hand", "has no input for it", "--grip normal.toml", "--ignore-signal normal.hand", "set.toml"] {
        assert!(done.stderr.contains(said), "\"{said}\" is missing: {}", done.stderr);
    }
    assert_eq!(place.backdrive(&["fit", "model.toml", "."]).code, Some(3));
    // With the option it goes on; other unused data is a note.
    let done = place.backdrive(&["fit", "model.toml", ".", "--ignore-signal", "normal.hand", "--grip", "none"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    assert_names(&done.stderr, &["comment"]);
    place.write("set.toml", &format!("{SET}ignore = ['normal.hand']\n"));
    let done = place.backdrive(&["fit", "model.toml", "."]);
    assert_eq!(done.code, Some(0), "{done:?}");
}

#[test]
fn time_that_is_not_in_seconds_is_told_and_not_explained_by_physics() {
    let place = Place::new();
    for truth in [&format!("{NOMINAL}{FRICTION}"), NOMINAL] {
        record(&place, truth);
        time_is_told(&place);
    }
    // In seconds nothing is wrong with it, and a set may say that its rates differ on purpose.
    place.write("set.toml", "fit = ['ms.csv']\n[columns]\nt = { column = 't', scale = 1e-3 }\n");
    assert_eq!(place.backdrive(&["fit", "model.toml", "."]).code, Some(0));
    place.write("set.toml", "fit = ['sweep.csv', 'slow.csv']\nmixed_rates = true\n");
    let done = place.backdrive(&["fit", "model.toml", "."]);
    assert!(done.code == Some(0) || done.code == Some(1), "{done:?}");
}

/// Times in ms and mixed rates stop a diagnosis, whether the model's structure is right or not.
fn time_is_told(place: &Place) {
    let rewritten = |file: &str, every: usize, scale: f64| {
        let text = read(place, file);
        let rows = text.lines().skip(1).step_by(every).map(|line| {
            let (t, rest) = line.split_once(',').unwrap();
            format!("{},{rest}", t.parse::<f64>().unwrap() * scale)
        });
        format!("t,force,position\n{}\n", rows.collect::<Vec<_>>().join("\n"))
    };
    place.write("ms.csv", &rewritten("sweep.csv", 1, 1e3));
    place.write("slow.csv", &rewritten("triangle.csv", 10, 1.0));
    for (files, says) in [
        (&["ms.csv"][..], &["ms.csv", "milliseconds", "scale = 1e-3"][..]),
        (&["ms.csv", "triangle.csv"], &["ms.csv", "milliseconds", "scale = 1e-3"]),
        (&["sweep.csv", "slow.csv"], &["slow.csv", "every 0.0100 s", "sweep.csv", "mixed_rates"]),
    ] {
        let all: Vec<&str> =
            ["diagnose"].into_iter().chain(files.iter().copied()).chain(["--model", "model.toml", "--out", "out"]).collect();
        let done = place.backdrive(&all);
        assert_eq!(done.code, Some(3), "{files:?}: {done:?}");
        for text in says {
            assert!(done.stderr.contains(text), "{files:?}: \"{text}\" is missing: {}", done.stderr);
        }
    }
}

#[test]
fn a_fit_does_not_lose_the_model_that_it_read() {
    let place = Place::new();
    record(&place, NOMINAL);
    // A mass that the recordings say nothing of: it hangs on a spring that is as good as none.
    let idle = format!("{}[[elements]]\nname = 'idle'\nkind = 'spring'\nbetween = ['motor', 'ground']\nstiffness = 1e-6\n", NOMINAL);
    place.write("model.toml", &idle);
    let done = place.backdrive(&["fit", "model.toml", ".", "--out", "model.toml"]);
    assert_eq!(done.code, Some(3), "{done:?}");
    assert_names(&done.stderr, &["--overwrite"]);
    assert_eq!(read(&place, "model.toml"), idle);
    let done = place.backdrive(&["fit", "model.toml", ".", "--out", "sweep.csv", "--overwrite"]);
    assert!(done.code == Some(3) && read(&place, "sweep.csv").starts_with("t,force"), "{done:?}");
    let done = place.backdrive(&["fit", "model.toml", ".", "--out", "model.toml", "--overwrite"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let written = Model::from_toml(&read(&place, "model.toml"), "written").unwrap();
    assert_eq!(written.values_at("elements.idle.stiffness").unwrap(), [1e-6], "{}", read(&place, "model.toml"));
    assert_names(&done.stderr, &["elements.idle.stiffness"]);
    assert!(done.stdout.contains("not determined: kept as given"), "{done:?}");
}
