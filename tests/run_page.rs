//! The page of a run and of a replay: one file that shows what happened, in one process, in processes, and of a run that went wrong.

mod system;

/// The class of a headline that decides nothing.
const UNSURE: &str = "class=\"lead unsure\"";

use nix::sys::signal::Signal;
use system::{Place, alone, file, kill, until_recorded};

fn read(place: &Place, name: &str) -> String {
    std::fs::read_to_string(place.path(name)).unwrap()
}

#[test]
fn a_run_in_one_process_and_its_replay_have_a_page() {
    let place = Place::new();
    let graph = file("launch/contact.toml");
    let run = place.backdrive(&["run", &graph, "--transport", "inproc", "--bag", "run.mcap", "--html", "run.html"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let page = read(&place, "run.html");
    for says in [
        "Stable at μλ = 0.3",
        "What to do now",
        "backdrive stability run.mcap",
        "contact for",
        "master x_m",
        "on the slave F_s",
        "one process",
    ] {
        assert!(page.contains(says), "{says}");
    }
    let again = place.backdrive(&["replay", "run.mcap", "--lambda", "8", "--canceller", "none", "--html", "again.html"]);
    assert_eq!(again.code, Some(1), "{again:?}");
    let page = read(&place, "again.html");
    assert!(page.contains("μλ = 8") && !page.contains("Stable at"), "the replay's page says otherwise");
    let short =
        place.backdrive(&["run", &graph, "--transport", "inproc", "--duration", "0.5", "--html", "short.html", "--bag", "short.mcap"]);
    assert!(short.code == Some(7) && read(&place, "short.html").contains(UNSURE), "{short:?}");
}

#[test]
fn a_run_in_which_a_node_died_says_so_on_its_page() {
    let (_alone, place) = (alone(), Place::new());
    let graph = file("launch/contact.toml");
    let options = ["--clock", "realtime", "--rate", "1000", "--duration", "2.2", "--bag", "run.mcap", "--html", "run.html"];
    let run = place.start(&[&["run", graph.as_str()], &options[..]].concat());
    until_recorded(&place.path("run.mcap"), "/master/measured_js", 1300);
    kill(place.process("slave").unwrap(), Signal::SIGKILL);
    assert_eq!(run.end().code, Some(6));
    let page = read(&place, "run.html");
    for says in ["It is not known", "slave", "SIGKILL", "missed deadlines", "loop p99", "Loop time of each node", "force"] {
        assert!(page.contains(says), "{says}");
    }
}
