//! Whoever asks for JSON gets JSON: one object on standard output, whatever the exit code.

mod system;

use nix::sys::signal::Signal;
use serde_json::Value;
use std::process::Command;
use system::{Ended, Place, Running, graph_text, kill, until};

/// The one JSON value that standard output holds.
fn json(what: &str, done: &Ended) -> Value {
    let value: Value = serde_json::from_str(&done.stdout).unwrap_or_else(|e| panic!("{what}: no JSON ({e}): {done:?}"));
    assert!(value.is_object(), "{what}: {done:?}");
    value
}

/// A failure: its code as the process ends, a word for it, and its standard error.
fn assert_error(what: &str, done: &Ended, code: i32, kind: &str) {
    let value = json(what, done);
    assert_eq!(done.code, Some(code), "{what}: {done:?}");
    let error = &value["error"];
    assert_eq!((&error["code"], &error["kind"]), (&code.into(), &kind.into()), "{what}: {done:?}");
    let message = error["message"].as_str().unwrap_or_default();
    assert!(!message.is_empty() && message.lines().next().is_some_and(|line| done.stderr.contains(line)), "{what}: {done:?}");
    assert!(error["hints"].is_array(), "{what}: {done:?}");
}

/// Every verb that has the option, from the program's own help, with the words that name it.
fn verbs() -> Vec<Vec<String>> {
    let help = |words: &[String]| {
        let done = Command::new(env!("CARGO_BIN_EXE_backdrive")).args(words).arg("--help").output().unwrap();
        String::from_utf8_lossy(&done.stdout).into_owned()
    };
    let inside = |text: &str| -> Vec<String> {
        let lines = text.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
        let names = lines.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
        names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help").map(str::to_string).collect()
    };
    let mut found = Vec::new();
    for verb in inside(&help(&[])) {
        let text = help(std::slice::from_ref(&verb));
        let below = inside(&text);
        let all = if below.is_empty() { vec![vec![verb.clone()]] } else { below.into_iter().map(|b| vec![verb.clone(), b]).collect() };
        found.extend(all.into_iter().filter(|words| help(words).contains("--json")));
    }
    found
}

/// Files that are not there, as each verb needs them.
fn absent(verb: &[String]) -> Option<Vec<&'static str>> {
    Some(match verb.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["run"] => vec!["absent.toml"],
        ["replay" | "stability" | "why"] | ["bag", "info"] => vec!["absent.mcap"],
        ["compare"] => vec!["absent.toml"],
        ["inspect"] => vec!["absent.csv"],
        ["init"] => vec!["absent.csv"],
        ["diagnose"] => vec!["absent.csv", "--model", "absent.toml"],
        ["fit"] => vec!["absent.toml", "absent.csv"],
        ["simulate"] => vec!["absent.toml", "absent.csv", "--out", "out.csv"],
        ["export"] => vec!["absent.toml"],
        ["test-bench"] => vec!["absent.mcap"],
        ["bridge"] => vec!["absent.toml"],
        ["model", _] => vec!["absent.toml"],
        ["bag", "merge"] => vec!["absent.mcap", "other.mcap", "--bag", "out.mcap"],
        ["bag", "diff"] => vec!["absent.mcap", "other.mcap"],
        // A machine is examined without changes.
        ["doctor"] => return None,
        // A port is no file, and belongs to the machine.
        ["device", "find" | "new"] => return None,
        _ => vec!["absent"],
    })
}

#[test]
fn every_verb_gives_json_for_wrong_usage_and_for_files_that_are_not_there() {
    let place = Place::new();
    let verbs = verbs();
    assert!(verbs.len() >= 13, "{verbs:?}");
    for verb in &verbs {
        let words: Vec<&str> = verb.iter().map(String::as_str).collect();
        let wrong = place.backdrive(&[&words[..], &["--json", "--no-such-option"]].concat());
        assert_error(&format!("{verb:?}, wrong usage"), &wrong, 2, "usage");
        if let Some(files) = absent(verb) {
            let done = place.backdrive(&[&words[..], &files, &["--json"]].concat());
            let error = json(&format!("{verb:?}, absent"), &done)["error"].clone();
            assert!(matches!(done.code, Some(2 | 3)), "{verb:?}: {done:?}");
            assert_eq!(error["code"], done.code.unwrap(), "{verb:?}: {done:?}");
        }
    }
}

#[test]
fn a_program_that_is_no_node_a_full_disk_and_a_bag_that_exists_are_json() {
    let place = Place::new();
    // 6: a node that ends before it begins.
    let text = graph_text("launch/contact.toml").replace("kind = \"slave\"\n", "kind = \"slave\"\ncommand = [\"false\"]\n");
    place.write("dies.toml", &text);
    assert_error("a node dies", &place.backdrive(&["run", "dies.toml", "--duration", "0.1", "--bag", "a.mcap", "--json"]), 6, "node");
    // 3: the bag is there already.
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    let run = ["run", "graph.toml", "--transport", "inproc", "--duration", "0.1", "--bag", "b.mcap", "--json"];
    json("a run", &place.backdrive(&run));
    assert_error("a bag that exists", &place.backdrive(&run), 3, "bad_input");
    // 5: the page cannot be written.
    let page = place.backdrive(&["stability", "b.mcap", "--html", "/dev/null/x", "--json"]);
    assert_error("no place for the page", &page, 5, "machine");
    // 7 and 4: what is known is the result, not an error.
    let short = place.backdrive(&["stability", "b.mcap", "--json"]);
    assert_eq!((short.code, json("a short bag", &short)["error"].is_null()), (Some(7), true), "{short:?}");
    let bytes = std::fs::read(place.path("b.mcap")).unwrap();
    std::fs::write(place.path("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let cut = place.backdrive(&["bag", "info", "cut.mcap", "--json"]);
    assert_eq!((cut.code, json("a cut bag", &cut)["error"].is_null()), (Some(4), true), "{cut:?}");
}

/// 130: interrupted before its nodes have met, and while it runs.
#[test]
fn an_interrupted_run_is_json() {
    let place = Place::new();
    let text =
        graph_text("launch/contact.toml").replace("kind = \"slave\"\n", "kind = \"slave\"\ncommand = [\"sh\", \"-c\", \"sleep 60\"]\n");
    place.write("waits.toml", &text);
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    for graph in ["waits.toml", "graph.toml"] {
        let mut command = place.command(env!("CARGO_BIN_EXE_backdrive"));
        command.args(["run", graph, "--duration", "3000", "--bag", "run.mcap", "--overwrite", "--json"]);
        let run = Running::start(&place, command);
        until("a process of the run", || place.process("master").is_some());
        kill(run.pid(), Signal::SIGINT);
        let done = run.end();
        let value = json(graph, &done);
        assert_eq!(done.code, Some(130), "{done:?}");
        assert!(value["error"]["kind"] == "interrupted" || value["run"]["cause"].is_object(), "{done:?}");
    }
}
