//! Keys of a graph about hands: a canceller that estimates one, a master whose hand changes its grip.

#[path = "../../tests/common/naming.rs"]
mod naming;

use backdrive_control::changing_grip::GripChange;
use backdrive_control::hand::HandSettings;
use backdrive_nodes::build::plan;
use backdrive_nodes::graph::{Graph, NodeKind, Overrides, Settings};
use naming::assert_names;
use std::path::Path;

/// The contact graph with a line put under the grip of its master (0) or its canceller (1).
fn graph(of: usize, line: &str) -> Result<Graph, String> {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
    let text = std::fs::read_to_string(project.join("launch/contact.toml")).unwrap();
    let text = text.replace("../plant", &project.join("plant").display().to_string());
    let grip = format!("grip = \"{}\"\n", project.join("plant/grips/normal.toml").display());
    let mut parts: Vec<String> = text.split(&grip).map(str::to_string).collect();
    assert_eq!(parts.len(), 3);
    parts[of + 1] = format!("{line}\n{}", parts[of + 1]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("contact.toml");
    std::fs::write(&path, parts.join(&grip)).unwrap();
    Graph::load(&path, &Overrides::default()).map_err(|e| e.to_string())
}

fn canceller(graph: &Graph) -> Option<HandSettings> {
    match &graph.node_of(NodeKind::Canceller).unwrap().settings {
        Settings::Canceller(.., hand) => *hand,
        _ => unreachable!(),
    }
}

#[test]
fn a_canceller_takes_the_hand_as_modelled_unless_it_is_told_to_estimate_it() {
    assert_eq!(canceller(&graph(1, "").unwrap()), None);
    assert_eq!(canceller(&graph(1, "hand = \"as_modelled\"").unwrap()), None);
    assert_eq!(canceller(&graph(1, "hand = \"estimated\"").unwrap()), Some(HandSettings::default()));
    let narrow = graph(1, "hand = \"estimated\"\nhand_range = [0.8, 1.25]").unwrap();
    assert_eq!(canceller(&narrow), Some(HandSettings { softest: 0.8, firmest: 1.25, edge_without: None }));
    let known = graph(1, "hand = \"estimated\"\nedge_without = 2.06").unwrap();
    assert_eq!(canceller(&known), Some(HandSettings { edge_without: Some(2.06), ..HandSettings::default() }));
    assert!(plan(&narrow, "canceller").is_ok());
}

#[test]
fn what_is_wrong_with_a_hand_is_told_with_file_line_and_key() {
    for (of, line, told) in [
        (1, "hand = \"guessed\"", "hand"),
        (1, "hand_range = [0.5, 2.0]", "hand = \"estimated\""),
        (1, "edge_without = 2.06", "hand = \"estimated\""),
        (1, "hand = \"estimated\"\nedge_without = 0.0", "edge_without"),
        (1, "hand = \"estimated\"\nhand_range = [2.0, 0.5]", "the softer first"),
        (1, "hand = \"estimated\"\nhand_range = [1.0]", "the softer first"),
        (1, "hand = \"estimated\"\nhand_range = [0.0, 1.0]", "hand_range"),
        (0, "grip_changes = [{ t = 2.0, scale = 1.5 }, { t = 1.0, scale = 1.0 }]", "times must increase"),
        (0, "grip_changes = [{ t = 2.0, scale = 0.0 }]", "scale"),
        (0, "grip_changes = [{ t = 2.0 }]", "scale"),
        (1, "grip_changes = [{ t = 2.0, scale = 1.5 }]", "grip_changes"),
    ] {
        let error = graph(of, line).unwrap_err();
        assert_names(&error, &["contact.toml:", told]);
    }
}

#[test]
fn a_master_knows_how_its_hand_changes_its_grip() {
    let graph = graph(0, "grip_changes = [{ t = 2.0, scale = 1.5 }, { t = 3.0, scale = 0.7 }]").unwrap();
    let Settings::Master(files) = &graph.node_of(NodeKind::Master).unwrap().settings else { unreachable!() };
    assert_eq!(files.grip_changes, [GripChange { at_s: 2.0, scale: 1.5 }, GripChange { at_s: 3.0, scale: 0.7 }]);
    assert!(plan(&graph, "master").is_ok());
}
