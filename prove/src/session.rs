//! What of a session a diagnosis gets: bags that hold the nominal model and the digest of the truth, and of the hand what a real one would.

use crate::error::ProveError;
use crate::files::write;
use backdrive_bags::{BagHeader, Reader, without};
use std::path::Path;
use toml_edit::{DocumentMut, InlineTable, Item, Table, Value, value};

/// Copies a recorded session without what reveals how the hidden plant was run: its command line, and where the user's body was. Where the hand is not
/// shown, what it wanted is left out too, and the set declares it unknown up to `hand_hz`.
pub fn hand_over(recorded: &Path, session: &Path, shows_hand: bool, hand_hz: f64) -> Result<(), ProveError> {
    std::fs::create_dir_all(session).map_err(|e| ProveError::write(session, e))?;
    let mut names: Vec<_> = std::fs::read_dir(recorded)
        .and_then(|entries| entries.map(|e| e.map(|e| e.file_name())).collect::<Result<_, _>>())
        .map_err(|e| ProveError::input(format!("{}: cannot be read: {e}", recorded.display())))?;
    names.sort();
    for name in &names {
        let (from, to) = (recorded.join(name), session.join(name));
        if Path::new(name).extension().is_some_and(|e| e == "mcap") {
            let reader = Reader::open_begun(&from).map_err(ProveError::input)?;
            let hidden: Vec<String> = reader.header().map_or_else(Vec::new, |header| hidden_topics(header, shows_hand));
            without(&from, &to, &|topic| hidden.iter().any(|h| h == topic), &|header| tell_less(header, shows_hand))
                .map_err(ProveError::input)?;
        } else {
            let bytes = backdrive_plant::input_file::read(&from)
                .map_err(|e| ProveError::input(format!("{}: cannot be read: {e}", from.display())))?;
            write(&to, bytes)?;
        }
    }
    if !shows_hand {
        hide_hand(&session.join("set.toml"), hand_hz)?;
    }
    std::fs::remove_dir_all(recorded).map_err(|e| ProveError::write(recorded, e))
}

/// Topics that only a simulation knows, and those of the hand where it is not shown.
fn hidden_topics(header: &BagHeader, shows_hand: bool) -> Vec<String> {
    let graph: DocumentMut = header.graph_toml.parse().unwrap_or_default();
    let operators: Vec<String> = nodes(&graph, "operator");
    let masters: Vec<String> = nodes(&graph, "master");
    let told = header.topics.iter().filter(|info| {
        let user = masters.contains(&info.publisher) && info.topic.name.ends_with("/user_js");
        user || !shows_hand && operators.contains(&info.publisher)
    });
    told.map(|info| info.topic.name.clone()).collect()
}

fn nodes(graph: &DocumentMut, kind: &str) -> Vec<String> {
    let tables = graph.get("nodes").and_then(Item::as_array_of_tables);
    let of_kind = tables.into_iter().flat_map(|t| t.iter()).filter(|n| n.get("kind").and_then(Item::as_str) == Some(kind));
    of_kind.filter_map(|n| n.get("name").and_then(Item::as_str).map(str::to_string)).collect()
}

/// Takes the hidden plant's command line out of a bag's graph, and the script of a hand that is not shown.
fn tell_less(header: &mut BagHeader, shows_hand: bool) {
    let Ok(mut graph) = header.graph_toml.parse::<DocumentMut>() else {
        header.graph_toml.clear();
        return;
    };
    let tables = graph.get_mut("nodes").and_then(Item::as_array_of_tables_mut);
    for node in tables.into_iter().flat_map(|t| t.iter_mut()) {
        node.remove("command");
        if !shows_hand && node.get("kind").and_then(Item::as_str) == Some("operator") {
            let script: Vec<String> = node.iter().map(|(key, _)| key.to_string()).filter(|k| k != "name" && k != "kind").collect();
            script.iter().for_each(|key| drop(node.remove(key)));
        }
    }
    let experiments = graph.get_mut("experiments").and_then(Item::as_array_of_tables_mut);
    for experiment in experiments.into_iter().flat_map(|t| t.iter_mut()).filter(|_| !shows_hand) {
        experiment.remove("operator");
    }
    header.graph_toml = graph.to_string();
}

/// Makes the column of the hand in a set an unknown input.
fn hide_hand(path: &Path, hand_hz: f64) -> Result<(), ProveError> {
    let text = backdrive_plant::input_file::read_to_string(path)
        .map_err(|e| ProveError::input(format!("{}: cannot be read: {e}", path.display())))?;
    let mut set: DocumentMut = text.parse().map_err(|e| ProveError::input(format!("{}: {e}", path.display())))?;
    let Some(columns) = set.get_mut("columns").and_then(Item::as_table_like_mut) else { return Ok(()) };
    let topic = |item: &Item| item.as_table_like().and_then(|t| t.get("topic")?.as_str().map(str::to_string)).unwrap_or_default();
    let hands: Vec<String> =
        columns.iter().filter(|(_, item)| topic(item).contains("/setpoint_js")).map(|(name, _)| name.to_string()).collect();
    let mut unknown = Table::new();
    for hand in &hands {
        columns.remove(hand);
        let mut how = InlineTable::new();
        how.insert("bandwidth_hz", Value::from(hand_hz));
        unknown.insert(hand, value(how));
    }
    set.insert("unknown", Item::Table(unknown));
    write(path, set.to_string())
}
