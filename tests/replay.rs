//! Re-simulation of a bag's graph: the hand's motion comes from the bag, everything else from its models, changed as asked.

mod system;

use nix::sys::signal::Signal;
use system::{Ended, Place, alone, file, graph_text, kill, samples, until_recorded};

fn same(place: &Place, a: &str, b: &str) -> Ended {
    place.backdrive(&["bag", "diff", a, b])
}

#[test]
fn at_another_gain_it_is_the_run_at_that_gain() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    let run = |bag: &str, changes: &[&str]| {
        let done =
            place.backdrive(&[&["run", graph.as_str(), "--transport", "inproc", "--duration", "1.5", "--bag", bag], changes].concat());
        assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    };
    run("recorded.mcap", &[]);
    let (second, mass) = (file("plant/models/impulse-engine-second-order.toml"), file("plant/models/rigid-mass.toml"));
    let (tissue, firm) = (file("plant/environments/soft-tissue.toml"), file("plant/grips/firm.toml"));
    let changes: [&[&str]; 7] = [
        &["--lambda", "0.8"],
        &["--mu", "1.5", "--lambda", "0.1"],
        &["--canceller", "none", "--lambda", "2", "--guard"],
        &["--canceller", &second, "--high-pass", "0.5"],
        &["--master", &mass, "--lambda", "0.1"],
        &["--environment", &tissue, "--grip", &firm],
        &["--dither", "--sensors", "ideal", "--limits", "ignored"],
    ];
    for change in changes {
        run("asked.mcap", &[change, &["--overwrite"]].concat());
        let again = place.backdrive(&[&["replay", "recorded.mcap", "--overwrite", "--bag", "again.mcap"], change].concat());
        assert!(matches!(again.code, Some(0 | 1 | 7)), "{change:?}: {again:?}");
        assert_eq!(same(&place, "asked.mcap", "again.mcap").code, Some(0), "{change:?}");
        assert_eq!(same(&place, "recorded.mcap", "again.mcap").code, Some(1), "{change:?} changed nothing");
    }
}

#[test]
fn the_bag_is_all_it_needs() {
    let place = Place::new();
    let names = ["models/impulse-engine.toml", "models/slave.toml", "grips/normal.toml", "environments/stiff-wall.toml"];
    let mut text = graph_text("launch/contact.toml")
        .replace("kind = \"scaling\"", "kind = \"scaling\"\ndither = \"recorded:file=small.csv,column=x\"");
    for name in names {
        let own = name.replace('/', "-");
        std::fs::copy(file(&format!("plant/{name}")), place.path(&own)).unwrap();
        text = text.replace(&file(&format!("plant/{name}")), &own);
    }
    let rows: String = (0..500).map(|k| format!("{},{}\n", k as f64 * 1e-3, 0.02 * (k as f64 * 0.3).sin())).collect();
    place.write("small.csv", &format!("t,x\n{rows}"));
    place.write("graph.toml", &text);
    let done = place.backdrive(&["run", "graph.toml", "--duration", "1.2", "--bag", "run.mcap"]);
    assert_eq!(done.code, Some(7), "{done:?}");
    for gone in names.map(|n| n.replace('/', "-")).iter().chain(&["small.csv".to_string(), "graph.toml".to_string()]) {
        std::fs::remove_file(place.path(gone)).unwrap();
    }
    let elsewhere = Place::new();
    std::fs::copy(place.path("run.mcap"), elsewhere.path("run.mcap")).unwrap();
    let again = elsewhere.backdrive(&["replay", "run.mcap", "--bag", "again.mcap"]);
    assert_eq!(again.code, Some(7), "{again:?}");
    let found = same(&elsewhere, "run.mcap", "again.mcap");
    assert_eq!(found.code, Some(0), "{found:?}");
}

#[test]
fn of_a_run_in_real_time_that_was_stopped() {
    let (_alone, place) = (alone(), Place::new());
    let graph = file("launch/contact.toml");
    let options = ["--clock", "realtime", "--rate", "1000", "--duration", "60", "--bag", "run.mcap"];
    let run = place.start(&[&["run", graph.as_str()], &options[..]].concat());
    until_recorded(&place.path("run.mcap"), "/operator/setpoint_js", 1100);
    kill(run.pid(), Signal::SIGINT);
    assert_eq!(run.end().code, Some(130));
    let done = place.backdrive(&["replay", "run.mcap", "--overwrite", "--bag", "again.mcap", "--json"]);
    assert!(matches!(done.code, Some(0 | 1 | 7)), "{done:?}");
    let (meant, replayed) =
        (samples(&place.path("run.mcap"), "/operator/setpoint_js"), samples(&place.path("again.mcap"), "/operator/setpoint_js"));
    let last = meant.iter().map(|s| s.step).max().unwrap();
    assert_eq!(done.json()["steps"], last + 1);
    for sample in &meant {
        let again = &replayed[sample.step as usize];
        assert_eq!((again.step, again.position[0], again.velocity[0]), (sample.step, sample.position[0], sample.velocity[0]));
    }
    // Once in lockstep, it is the same ever after.
    assert!(matches!(place.backdrive(&["replay", "again.mcap", "--bag", "third.mcap"]).code, Some(0 | 1 | 7)));
    assert_eq!(same(&place, "again.mcap", "third.mcap").code, Some(0));
}

#[test]
fn a_longer_or_shorter_one() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    assert_eq!(place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "1.2", "--bag", "run.mcap"]).code, Some(7));
    for (duration, steps, code) in [("0.5", 2500, 7), ("2", 10_000, 0)] {
        let done = place.backdrive(&["replay", "run.mcap", "--duration", duration, "--overwrite", "--bag", "again.mcap", "--json"]);
        assert_eq!((done.code, &done.json()["steps"]), (Some(code), &steps.into()), "{done:?}");
        let rows = samples(&place.path("again.mcap"), "/operator/setpoint_js");
        // Beyond its end the hand rests where it was.
        assert!(rows.iter().skip(6000).all(|s| s.position[0] == rows[5999].position[0] && s.velocity[0] == 0.0));
    }
    // Without a name for it, no second bag, and the first is not touched.
    let before = std::fs::read(place.path("run.mcap")).unwrap();
    let done = place.backdrive(&["replay", "run.mcap", "--lambda", "1", "--json"]);
    assert!(done.json()["bag"].is_null(), "{done:?}");
    assert_eq!(std::fs::read(place.path("run.mcap")).unwrap(), before);
}
