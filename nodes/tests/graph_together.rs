//! `together` in graph files: which nodes share a process, and what is wrong with wrong ones.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_nodes::graph::{Files, Graph, Overrides, draw};
use naming::assert_names;
use std::path::Path;

fn read(together: &str, change: impl Fn(String) -> String, file: &str) -> Result<Graph, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch").join(file);
    let text = change(std::fs::read_to_string(&path).unwrap());
    let text = format!("together = {together}\n{text}");
    Graph::from_text(&text, &path, &Overrides::default(), &Files::Disk).map_err(|e| e.to_string())
}

fn contact(together: &str) -> Result<Graph, String> {
    read(together, |text| text, "contact.toml")
}

fn names(graph: &Graph, of: &str) -> Vec<String> {
    graph.process_of(of).iter().map(|n| n.name.clone()).collect()
}

#[test]
fn who_shares_a_process() {
    let graph = contact("[\"scaling\", \"canceller\"]").unwrap();
    assert_eq!(names(&graph, "canceller"), ["scaling", "canceller"]);
    assert_eq!(names(&graph, "scaling"), ["scaling", "canceller"]);
    assert_eq!(names(&graph, "master"), ["master"]);
    assert!(names(&graph, "nobody").is_empty());
    assert_names(draw(&graph), &["scaling + canceller"]);

    let graph = contact("[[\"operator\", \"master\"], [\"scaling\", \"slave\"]]").unwrap();
    assert_eq!(names(&graph, "master"), ["operator", "master"]);
    assert_eq!(names(&graph, "slave"), ["scaling", "slave"]);
    assert_eq!(names(&contact("[]").unwrap_or_else(|e| panic!("{e}")), "slave"), ["slave"]);
}

#[test]
fn what_is_wrong_is_said_with_file_and_key() {
    let wrong = |together: &str| {
        let told = contact(together).unwrap_err();
        assert_names(&told, &["contact.toml:1", "together"]);
        told
    };
    let told = wrong("[\"scaling\", \"canceler\"]");
    assert_names(&told, &["canceler", "canceller"]);
    assert_names(wrong("[\"scaling\", \"scaling\"]"), &["\"scaling\""]);
    assert_names(wrong("[[\"scaling\", \"slave\"], [\"canceller\", \"scaling\"]]"), &["\"scaling\""]);
    let told = wrong("[\"operator\", \"slave\"]");
    assert_names(&told, &["\"slave\"", "\"operator\""]);
    assert_names(wrong("[\"scaling\", \"recorder\"]"), &["recorder"]);
    // One node alone, a number, a text, and a list beside a text.
    for together in ["[\"scaling\"]", "[\"scaling\", 3]", "\"scaling\"", "[[\"scaling\", \"slave\"], \"canceller\"]"] {
        wrong(together);
    }
}

#[test]
fn what_cannot_share_a_process() {
    let master = |line: &'static str| move |text: String| text.replace("kind = \"master\"\n", &format!("kind = \"master\"\n{line}\n"));
    let told = read("[\"master\", \"canceller\"]", master("command = [\"./own\"]"), "contact.toml").unwrap_err();
    assert_names(&told, &["\"master\""]);
    let realtime = |text: String| master("restart = true")(text.replace("clock = \"lockstep\"", "clock = \"realtime\""));
    let told = read("[\"master\", \"canceller\"]", realtime, "contact.toml").unwrap_err();
    assert_names(&told, &["master", "canceller", "restart"]);
    let told = read("[\"scaling\", \"slave\"]", |text| text, "contact-hosts.toml").unwrap_err();
    assert_names(&told, &["scaling", "slave"]);
}
