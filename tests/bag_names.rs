//! An existing bag is never lost: not to a second run, not to a run that is requested again.

mod system;

use system::assert_names;
use system::{Place, graph_text};

fn place() -> Place {
    let place = Place::new();
    place.write("graph.toml", &graph_text("launch/contact.toml"));
    place
}

#[test]
fn a_bag_that_exists_is_replaced_only_when_that_is_asked_for() {
    let place = place();
    for transport in ["inproc", "iceoryx2"] {
        let run = ["run", "graph.toml", "--transport", transport, "--duration", "0.2", "--bag"];
        let bag = format!("{transport}.mcap");
        let first = place.backdrive(&[&run[..], &[&bag]].concat());
        assert!(matches!(first.code, Some(0 | 7)), "{first:?}");
        let whole = std::fs::read(place.path(&bag)).unwrap();
        let told = place.backdrive(&[&run[..], &[&bag]].concat());
        assert_eq!(told.code, Some(3), "{told:?}");
        assert_names(&told.stderr, &["--overwrite", &bag]);
        assert_eq!(std::fs::read(place.path(&bag)).unwrap(), whole);
        let again = place.backdrive(&[&run[..], &[&bag, "--overwrite", "--seed", "5"]].concat());
        assert!(matches!(again.code, Some(0 | 7)), "{again:?}");
        assert_ne!(std::fs::read(place.path(&bag)).unwrap(), whole);
    }
    for verb in [
        &["replay", "inproc.mcap", "--bag", "iceoryx2.mcap"][..],
        &["bag", "recover", "inproc.mcap", "--bag", "iceoryx2.mcap"],
        &["bag", "merge", "inproc.mcap", "inproc.mcap", "--bag", "iceoryx2.mcap"],
    ] {
        let told = place.backdrive(verb);
        told.ends(3, &["--overwrite"]);
    }
}

#[test]
fn a_bag_that_is_being_written_is_refused_to_a_second_run_whatever_it_was_told() {
    let place = place();
    let options = ["--clock", "realtime", "--rate", "200", "--duration", "6", "--bag", "run.mcap"];
    let run = place.start(&[&["run", "graph.toml"], &options[..]].concat());
    let bag = place.path("run.mcap");
    for _ in 0..600 {
        if std::fs::metadata(&bag).is_ok_and(|m| m.len() > 0) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    for second in [
        &["run", "graph.toml", "--transport", "inproc", "--duration", "0.1", "--bag", "run.mcap", "--overwrite"][..],
        &["run", "graph.toml", "--duration", "0.1", "--bag", "run.mcap", "--overwrite"],
    ] {
        let told = place.backdrive(second);
        assert!(told.code == Some(3) && told.stderr.contains("is being written by another run"), "{told:?}");
    }
    let first = run.end();
    assert_names(&first.stdout, &["run.mcap"]);
    assert_eq!(place.backdrive(&["bag", "info", "run.mcap"]).code, Some(0));
}
