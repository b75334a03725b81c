//! What two bags of a loop state differently: their graphs, and the model files in them, key by key.

use super::types::Kind;
use backdrive_bags::Reader;
use std::collections::BTreeMap;
use toml_edit::{DocumentMut, Item, TableLike, Value};

/// Keys that describe the recording, and not the loop.
const OF_RECORDING: [&str; 9] = ["title", "duration_s", "seed", "bag", "overwrite", "record_origin", "hosts", "experiments", "together"];
/// Kinds of nodes that are no part of the loop: the hand, whose motion may be another one, and the recorder.
const BESIDE: [&str; 2] = ["operator", "recorder"];
/// Keys of nodes that name a file which the bag holds.
const OF_FILES: [&str; 4] = ["model", "grip", "environment", "settings"];

/// A key whose value differs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stated {
    pub kind: Kind,
    pub key: String,
    /// `None` where one of both does not state it.
    pub old: Option<String>,
    pub new: Option<String>,
}

impl Stated {
    /// "slave.environment.elements.wall.stiffness 1000 -> 2000".
    pub fn words(&self) -> String {
        let said = |value: &Option<String>| value.clone().unwrap_or_else(|| "not stated".to_string());
        format!("{} {} -> {}", self.key, said(&self.old), said(&self.new))
    }
}

/// All keys of a bag's loop; `None` of a recording without a graph.
pub(super) fn keys(reader: &Reader) -> Option<BTreeMap<String, String>> {
    let header = reader.header().filter(|header| !header.graph_toml.is_empty())?;
    let document: DocumentMut = header.graph_toml.parse().ok()?;
    let mut out = BTreeMap::new();
    for (key, item) in document.iter() {
        if OF_RECORDING.contains(&key) {
            continue;
        }
        match key {
            "nodes" => each(item, &mut |node| of_node(node, &header.files, &mut out)),
            "connections" => each(item, &mut |connection| {
                let end = |name: &str| connection.get(name).and_then(Item::as_str).unwrap_or("?").to_string();
                let name = format!("{} to {}", end("from"), end("to"));
                out.insert(name.clone(), "connected".to_string());
                below(&name, connection, &["from", "to"], &mut out);
            }),
            _ => put(key, item, &mut out),
        }
    }
    Some(out)
}

/// What differs.
pub(super) fn differ(old: &BTreeMap<String, String>, new: &BTreeMap<String, String>) -> Vec<Stated> {
    let all: std::collections::BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let of = |key: &&String| {
        let (a, b) = (old.get(*key).cloned(), new.get(*key).cloned());
        (!same(a.as_deref(), b.as_deref())).then(|| Stated {
            kind: kind_of(key, a.is_none() || b.is_none()),
            key: (*key).clone(),
            old: a,
            new: b,
        })
    };
    all.iter().filter_map(of).collect()
}

/// Numbers are the same whatever way they are written.
fn same(a: Option<&str>, b: Option<&str>) -> bool {
    match (a.map(str::parse::<f64>), b.map(str::parse::<f64>)) {
        (Some(Ok(a)), Some(Ok(b))) => a == b,
        _ => a == b,
    }
}

fn kind_of(key: &str, is_added: bool) -> Kind {
    let has = |words: &[&str]| words.iter().any(|word| key.contains(word));
    match () {
        () if has(&["rate", "clock", ".delay", ".jitter", ".loss", ".latency"]) => Kind::Rate,
        () if key.starts_with("gains.") => Kind::Gain,
        () if has(&["resolution", "noise", "sensor", ".outputs."]) => Kind::Sensor,
        () if has(&[".elements."]) && is_added => Kind::Physics,
        () => Kind::Parameter,
    }
}

fn each(item: &Item, hear: &mut dyn FnMut(&dyn TableLike)) {
    if let Some(tables) = item.as_array_of_tables() {
        tables.iter().for_each(|table| hear(table));
    } else if let Some(array) = item.as_array() {
        array.iter().filter_map(Value::as_inline_table).for_each(|table| hear(table));
    }
}

fn of_node(node: &dyn TableLike, files: &[(String, String)], out: &mut BTreeMap<String, String>) {
    let text = |key: &str| node.get(key).and_then(Item::as_str).map(str::to_string);
    if text("kind").is_some_and(|kind| BESIDE.contains(&kind.as_str())) {
        return;
    }
    let name = text("name").unwrap_or_default();
    let mut inside = Vec::new();
    for key in OF_FILES {
        let Some(named) = text(key) else { continue };
        let file = files.iter().find(|(path, _)| *path == named);
        if let Some(document) = file.and_then(|(_, text)| text.parse::<DocumentMut>().ok()) {
            inside.push(key);
            below(&format!("{name}.{key}"), document.as_table(), &["name", "title", "description"], out);
        }
    }
    inside.push("name");
    below(&name, node, &inside, out);
}

fn below(prefix: &str, table: &dyn TableLike, without: &[&str], out: &mut BTreeMap<String, String>) {
    for (key, item) in table.iter().filter(|(key, _)| !without.contains(key)) {
        put(&format!("{prefix}.{key}"), item, out);
    }
}

/// A value, or what is below a table. Tables of a list are named by their name, else by their place.
fn put(key: &str, item: &Item, out: &mut BTreeMap<String, String>) {
    if let Some(table) = item.as_table_like() {
        return below(key, table, &[], out);
    }
    let mut index = 0;
    let mut listed = false;
    each(item, &mut |table| {
        let name = table.get("name").and_then(Item::as_str).map_or_else(|| index.to_string(), str::to_string);
        below(&format!("{key}.{name}"), table, &["name"], out);
        (index, listed) = (index + 1, true);
    });
    if listed {
        return;
    }
    if let Some(value) = item.as_value() {
        let mut value = value.clone();
        value.decor_mut().clear();
        let said = value.as_str().map_or_else(|| value.to_string(), str::to_string);
        out.insert(key.to_string(), said.trim().to_string());
    }
}
