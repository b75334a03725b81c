//! Couplings in whole runs: every law in processes, from its bag, asked about, compared.

mod system;

use nix::sys::signal::Signal;
use system::assert_names;
use system::{Place, file, kill};

const LAWS: [&str; 6] = ["direct", "wave", "passivity", "position_position", "four_channel", "virtual_coupling"];

#[test]
fn every_law_runs_in_processes_and_again_from_its_bag_bit_for_bit() {
    let place = Place::new();
    let graph = file("launch/coupling.toml");
    for law in LAWS {
        let short = ["--coupling", law, "--duration", "1.1", "--bag", "apart.mcap", "--overwrite"];
        let done = place.backdrive(&[&["run", graph.as_str()], &short[..]].concat());
        assert!(matches!(done.code, Some(0 | 1 | 7)), "{law}: {done:?}");
        let contact = system::samples(&place.path("apart.mcap"), "/slave/measured_js");
        assert!(contact.iter().any(|s| s.effort[0] < -0.05), "{law}: nothing was touched");
        let again = place.backdrive(&["replay", "apart.mcap", "--bag", "again.mcap", "--overwrite"]);
        assert!(matches!(again.code, Some(0 | 1 | 7)), "{law}: {again:?}");
        let same = place.backdrive(&["bag", "diff", "apart.mcap", "again.mcap"]);
        assert_eq!(same.code, Some(0), "{law}: {same:?}");
    }
}

#[test]
fn a_bag_of_scaling_is_asked_about_a_law_and_a_bag_of_a_law_is_judged() {
    let place = Place::new();
    let short = ["--duration", "2.0", "--transport", "inproc", "--canceller", "none", "--lambda", "0.3"];
    let run = |bag: &str, more: &[&str]| {
        let done = place.backdrive(&[&["run", &file("launch/contact.toml"), "--bag", bag], &short[..], more].concat());
        assert_eq!(done.code, Some(0), "{done:?}");
    };
    run("scaling.mcap", &[]);
    run("wave.mcap", &["--coupling", "wave"]);
    for (bag, more) in [("scaling.mcap", &["--coupling", "wave"][..]), ("wave.mcap", &[])] {
        let found = place.backdrive(&[&["stability", bag, "--gain", "0.3", "--grips", "1", "--json"], more].concat());
        let json = found.json();
        assert_eq!((found.code, &json["verdict"]), (Some(0), &"stable".into()), "{bag}: {found:?}");
        let edge = json["critical_gain"].as_f64().unwrap();
        assert!((2.0..6.0).contains(&edge), "{bag}: the edge with waves is {edge}");
        let text = place.backdrive(&[&["stability", bag, "--gain", "0.3", "--grips", "1"], more].concat()).stdout;
        assert_names(&text, &["wave"]);
    }
}

#[test]
fn laws_are_compared_on_a_graph_and_on_a_bag() {
    let place = Place::new();
    let few = ["--delays", "0,50", "--jitter", "120:40", "--loss", "0.3", "--grips", "1.3", "--at", "50"];
    let graph = file("launch/coupling.toml");
    let done = place.backdrive(&[&["compare", &graph, "--laws", "wave,direct", "--html", "a/b.html", "--json"], &few[..]].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    let json = done.json();
    let cells = json["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 2 * 5);
    let edge = |law: &str, delay: f64| {
        let it = cells.iter().find(|c| c["rival"] == law && c["condition"]["varied"] == "delay" && c["condition"]["delay_s"] == delay);
        it.and_then(|c| c["critical_gain"].as_f64()).unwrap()
    };
    // Waves are passive over any delay: what ends them is the master's own sampled damping, wherever the slave is.
    assert!((edge("wave", 0.05) / edge("wave", 0.0) - 1.0).abs() < 0.15, "{} {}", edge("wave", 0.0), edge("wave", 0.05));
    assert!(edge("direct", 0.05) < 0.3 * edge("direct", 0.0), "{} {}", edge("direct", 0.0), edge("direct", 0.05));
    let page = std::fs::read_to_string(place.path("a/b.html")).unwrap();
    assert_names(&page, &["Against the delay of the link", "120 +- 40 ms"]);

    // The hand of a bag, and a graph with scaling.
    let run = ["run", &file("launch/contact.toml"), "--duration", "2", "--transport", "inproc", "--bag", "run.mcap"];
    assert!(matches!(place.backdrive(&run).code, Some(0 | 1 | 7)));
    let few = ["--laws", "canceller,wave", "--delays", "0", "--jitter", "none", "--loss", "none", "--grips", "1"];
    let done = place.backdrive(&[&["compare", "run.mcap"], &few[..]].concat());
    assert_eq!(done.code, Some(0), "{done:?}");
    assert_names(&done.stdout, &["canceller", "link 0 ms"]);
}

#[test]
fn what_cannot_be_compared_is_refused_and_an_interrupt_shows_what_was_done() {
    let place = Place::new();
    let (graph, identify) = (file("launch/coupling.toml"), file("launch/identify.toml"));
    for (arguments, code, told) in [
        (&["compare", &graph, "--jitter", "20:40"][..], 2, "must not be above the mean"),
        (&["compare", &graph, "--loss", "1"], 2, "below 1"),
        (&["compare", &graph, "--laws", "waves"], 2, "virtual_coupling"),
        (&["compare", &identify], 3, "neither a coupling nor a scaling node"),
        (&["compare", "nothing.toml"], 3, "nothing.toml"),
    ] {
        let done = place.backdrive(arguments);
        assert_eq!(done.code, Some(code), "{arguments:?}: {done:?}");
        assert!(done.stderr.contains(told), "{arguments:?}: {done:?}");
    }
    let many: Vec<String> = (0..200).map(|ms| ms.to_string()).collect();
    let running = place.start(&["compare", &graph, "--delays", &many.join(","), "--json"]);
    std::thread::sleep(std::time::Duration::from_secs(6));
    kill(running.pid(), Signal::SIGINT);
    let done = running.end();
    assert_eq!(done.code, Some(130), "{done:?}");
    let cells = done.json()["cells"].as_array().unwrap().len();
    assert!(cells > 0 && cells < 1400, "{cells} cells were done");
}
