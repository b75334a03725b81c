//! Graph files with a coupling: its keys, and a coupling instead of scaling.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_control::coupling::LawKind;
use backdrive_nodes::graph::{Files, Graph, NodeKind, Overrides, Settings, coupling::conditions};
use naming::assert_names;
use std::path::{Path, PathBuf};

fn file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

fn with(law: LawKind) -> Overrides {
    Overrides { coupling: Some(law), ..Overrides::default() }
}

/// The graph of `launch/coupling.toml` with some of its text replaced.
fn changed(from: &str, to: &str) -> Result<Graph, String> {
    let path = file("launch/coupling.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from}");
    Graph::from_text(&text.replacen(from, to, 1), &path, &Overrides::default(), &Files::Disk).map_err(|e| e.to_string())
}

fn law(graph: &Graph) -> &'static str {
    match &graph.loop_node().unwrap().settings {
        Settings::Coupling { law, .. } => law.name(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn one_word_swaps_the_law_and_the_values_of_the_others_stay() {
    assert_eq!(law(&changed("law = \"wave\"", "law = \"passivity\"").unwrap()), "passivity");
    for (name, kind) in LawKind::ALL {
        assert_eq!(law(&Graph::load(&file("launch/coupling.toml"), &with(kind)).unwrap()), name);
    }
}

#[test]
fn what_is_wrong_is_said_with_what_there_is() {
    let error = |from: &str, to: &str| changed(from, to).unwrap_err();
    let unknown = error("law = \"wave\"", "law = \"waves\"");
    assert_names(&unknown, &["law", "wave"]);
    let key = error("impedance = 20.0", "impedence = 20.0");
    assert_names(&key, &["impedence", "impedance"]);
    let range = error("impedance = 20.0", "impedance = -1.0");
    assert_names(&range, &["impedance"]);
    // Tables of laws that are not in force are read nevertheless.
    let other = error("impedance = 20.0", "impedance = 20.0\n[nodes.four_channel]\ncompensation = 1.0");
    assert_names(&other, &["compensation"]);
    let hand = changed("law = \"wave\"", "law = \"four_channel\"").and_then(|_| {
        let path = file("launch/coupling.toml");
        let text = std::fs::read_to_string(&path).unwrap().replace("law = \"wave\"", "law = \"four_channel\"");
        let without = text.replace("from = \"master.user\"\nto = \"coupling.hand\"", "from = \"master.user\"\nto = \"canceller.hand\"");
        let cut: String =
            without.split("[[connections]]").filter(|part| !part.contains("canceller.hand")).collect::<Vec<_>>().join("[[connections]]");
        Graph::from_text(&cut, &path, &Overrides::default(), &Files::Disk).map_err(|e| e.to_string())
    });
    let hand = hand.unwrap_err();
    assert_names(&hand, &["\"hand\""]);
    let no_loop = Graph::load(&file("launch/identify.toml"), &with(LawKind::Wave)).unwrap_err().to_string();
    assert_names(&no_loop, &["--coupling"]);
}

#[test]
fn a_coupling_takes_the_place_of_scaling_and_topics_keep_their_names() {
    let before = Graph::load(&file("launch/push-and-hold.toml"), &Overrides::default()).unwrap();
    let after = Graph::load(&file("launch/push-and-hold.toml"), &with(LawKind::PositionPosition)).unwrap();
    let topic = |graph: &Graph, port: &str| {
        let at = graph.nodes.iter().position(|n| n.kind.closes_loop()).unwrap();
        graph.topic_of(at, port).name
    };
    assert_eq!(law(&after), "position_position");
    assert!(after.node_of(NodeKind::Scaling).is_none());
    for port in ["command", "force"] {
        assert_eq!(topic(&before, port), topic(&after, port));
    }
    // A step each: the force, the way back, the contact.
    let found = conditions(&after);
    assert_eq!(found.held_steps, 2);
    assert!((found.round_trip_s - 3.0 / 5000.0).abs() < 1e-12, "{found:?}");
}

#[test]
fn what_impaired_the_way_to_the_slave_impairs_the_link() {
    let path = file("launch/contact.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let there = "from = \"scaling.command\"\nto = \"slave.command\"";
    let text = text.replace(there, &format!("{there}\ndelay = 5\nimpair = {{ delay_s = 0.03, loss = 0.1 }}"));
    let graph = Graph::from_text(&text, &path, &with(LawKind::Wave), &Files::Disk).unwrap();
    let of = |port: &str| graph.connections.iter().find(|c| c.from.1 == port).unwrap();
    let (link, command) = (of("to_far"), of("command"));
    assert_eq!((link.delay, link.impairment.map(|i| (i.delay_s, i.loss))), (5, Some((0.03, 0.1))));
    assert_eq!((command.delay, command.impairment), (0, None));
    assert_eq!((of("to_near").delay, of("to_near").impairment), (1, None));
}
