//! A coupling instead of scaling, written into a graph's text.

use backdrive_plant::tomlfile::FileError;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// Lets the law `law` run in the graph's coupling. In a graph with a scaling node, a coupling of the same name replaces it, so that topics keep their
/// names. Dither and guard are removed, delays and impairments of the way to the slave and back become the link's, and the force of the hand is
/// connected where there is a master.
///
/// # Errors
/// A graph that has neither a coupling nor a scaling node.
pub(super) fn put_coupling(doc: &mut DocumentMut, law: &str, file: &str) -> Result<(), FileError> {
    let nodes = || doc.get("nodes").and_then(Item::as_array_of_tables).into_iter().flat_map(ArrayOfTables::iter);
    let word = |table: &Table, key: &str| table.get(key).and_then(Item::as_str).map(str::to_owned);
    let named = |kind: &str| nodes().find(|n| word(n, "kind").as_deref() == Some(kind)).and_then(|n| word(n, "name"));
    let (coupling, scaling, master) = (named("coupling"), named("scaling"), named("master"));
    let Some(name) = coupling.clone().or(scaling) else {
        return Err(FileError::whole(file, "has neither a coupling nor a scaling node, so --coupling has no effect; omit it".to_string()));
    };
    let tables = doc.get_mut("nodes").and_then(Item::as_array_of_tables_mut);
    for node in tables.into_iter().flat_map(ArrayOfTables::iter_mut).filter(|n| word(n, "name").as_ref() == Some(&name)) {
        node["kind"] = value("coupling");
        node["law"] = value(law);
        if coupling.is_none() {
            for key in ["dither", "guard"] {
                node.remove(key);
            }
            if let Some(topics) = node.get_mut("topics").and_then(Item::as_table_like_mut) {
                topics.remove("dither");
            }
        }
    }
    let connections = doc.get_mut("connections").and_then(Item::as_array_of_tables_mut);
    if let Some(connections) = connections.filter(|_| coupling.is_none()) {
        rewire(connections, &name, master.as_deref());
    }
    Ok(())
}

/// Connections of a scaling node become those of a coupling.
fn rewire(connections: &mut ArrayOfTables, name: &str, master: Option<&str>) {
    let end = |table: &Table, key: &str| table.get(key).and_then(Item::as_str).map(str::to_owned).unwrap_or_default();
    let (dither, guarded) = (format!("{name}.dither"), format!("{name}.measured"));
    let (command, contact, force) = (format!("{name}.command"), format!("{name}.contact"), format!("{name}.force"));
    let mut link = [Table::new(), Table::new()];
    let ways = [("to_far", "from_near", 0), ("to_near", "from_far", 1)];
    for (table, (from, to, delay)) in link.iter_mut().zip(ways) {
        table.insert("from", value(format!("{name}.{from}")));
        table.insert("to", value(format!("{name}.{to}")));
        table.insert("delay", value(delay));
    }
    connections.retain(|c| end(c, "from") != dither && end(c, "to") != guarded);
    for connection in connections.iter_mut() {
        let (from, to) = (end(connection, "from"), end(connection, "to"));
        let delay = connection.get("delay").and_then(Item::as_integer).unwrap_or(0);
        let least = i64::from(to == contact || from == force);
        // What is beyond the step that a loop needs lies on the way between the sides.
        let way = if from == command { 0 } else { 1 };
        if from == command || to == contact {
            let further = (delay - least).max(0);
            let own = link[way].get("delay").and_then(Item::as_integer).unwrap_or(0);
            link[way].insert("delay", value(own + further));
            if let Some(impair) = connection.remove("impair") {
                link[way].insert("impair", impair);
            }
            connection.insert("delay", value(least));
        } else if from == force {
            connection.insert("delay", value(delay.max(least)));
        }
    }
    link.into_iter().for_each(|table| connections.push(table));
    if let Some(master) = master {
        let mut hand = Table::new();
        hand.insert("from", value(format!("{master}.user")));
        hand.insert("to", value(format!("{name}.hand")));
        connections.push(hand);
    }
}
