//! A graph in a bag does not identify the machine, and is the same graph.

use backdrive_nodes::graph::{Files, Graph, Overrides};
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// The contact task with a master and a canceller whose model files are called the same and hold different things.
fn graph(folder: &Path, changes: Overrides) -> Graph {
    let models = repository().join("plant/models");
    for (place, model) in [("a", "impulse-engine.toml"), ("b", "impulse-engine-linear.toml")] {
        std::fs::create_dir_all(folder.join(place)).unwrap();
        std::fs::copy(models.join(model), folder.join(place).join("model.toml")).unwrap();
    }
    let (master, canceller) = (Some(folder.join("a/model.toml")), Some(folder.join("b/model.toml")));
    let bag = Some(folder.join("new.mcap"));
    Graph::load(&repository().join("launch/contact.toml"), &Overrides { master, canceller, bag, ..changes }).unwrap()
}

#[test]
fn it_has_no_folders_and_is_the_same_graph() {
    let folder = tempfile::tempdir().unwrap();
    let graph = graph(folder.path(), Overrides::default());
    assert!(graph.text.contains(folder.path().to_str().unwrap()), "what processes read is absolute");
    let (text, files) = graph.portable();
    for path in [folder.path(), &repository()] {
        assert!(!text.contains(path.to_str().unwrap()), "{text}");
    }
    assert!(files.iter().all(|(name, _)| !name.contains('/')), "{:?}", files.iter().map(|f| &f.0).collect::<Vec<_>>());
    let texts = |files: &[(String, String)]| files.iter().map(|(_, text)| text.clone()).collect::<Vec<_>>();
    assert_eq!(texts(&files), texts(&graph.files));
    // On a machine that has none of these files.
    let again = Graph::from_text(&text, Path::new("/nowhere/run.mcap"), &Overrides::default(), &Files::Bag(&files)).unwrap();
    assert_eq!((texts(&again.files), again.nodes.len()), (texts(&files), graph.nodes.len()));
    assert_eq!(again.portable(), (text, files), "and so is a bag of its replay");
}

#[test]
fn folders_stay_where_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let graph = graph(folder.path(), Overrides { record_origin: true, ..Overrides::default() });
    assert!(graph.record_origin);
    assert_eq!(graph.portable(), (graph.text.clone(), graph.files.clone()));
}
