//! What the tests of this crate build on.

use crate::difference::Difference;
use crate::trial::Trial;
use backdrive_nodes::graph::{Files, Graph, NodeKind, Overrides};
use backdrive_stability::by_itself::compared::{AsIf, Compared};
use backdrive_stability::by_itself::recorded::Quantity;
use std::path::Path;

/// `launch/contact.toml` with some of its text replaced: a canceller, a scaling, an exact model, no delay but the one step that a loop needs.
pub fn contact(changes: &[(&str, &str)]) -> Graph {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../launch/contact.toml");
    let mut text = std::fs::read_to_string(&path).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    Graph::from_text(&text, &path, &Overrides::default(), &Files::Disk).unwrap()
}

/// The same as a loop that is re-simulated.
pub fn trial(changes: &[(&str, &str)]) -> Trial {
    Trial::of(contact(changes))
}

/// A difference of an output; `way` is the input that is late.
pub fn difference(node: &str, kind: NodeKind, quantity: Quantity, as_if: AsIf, way: Option<&str>) -> Difference {
    let port = if kind == NodeKind::Canceller { "motion" } else { "measured" };
    let compared = Compared { error: 1.0, share: 0.3, as_if, left: 0.01 };
    let way = way.map(str::to_string);
    Difference { node: node.to_string(), kind, port: port.to_string(), quantity, axis: 0, compared, way, device: None }
}
