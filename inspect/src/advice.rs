//! Lines to paste into a set.

use crate::joints::Joint;
use crate::quantity::Quantity;
use crate::recording::{Recording, Signal};
use std::fmt::Write as _;

/// Where a signal stands, as a set writes it, with more keys behind it: `{ column = "tau1", scale = -1 }`.
pub fn source(recording: &Recording, signal: &Signal, more: &str) -> String {
    let stream = recording.stream(signal);
    let place = match &signal.field {
        Some(field) => format!("topic = {:?}, field = {field:?}", stream.topic),
        None => format!("column = {:?}", heading(signal)),
    };
    let unit =
        signal.stated.or(signal.hint).filter(|_| !more.contains("unit")).map_or(String::new(), |unit| format!(", unit = {:?}", unit.name));
    let more = if more.is_empty() { String::new() } else { format!(", {more}") };
    format!("{{ {place}{unit}{more} }}")
}

/// The heading of a column as its file has it.
fn heading(signal: &Signal) -> String {
    signal.stated.map_or_else(|| signal.name.clone(), |unit| format!("{} [{}]", signal.name, unit.name))
}

/// An entry for a signal of a joint: in `[joints.NAME]` where a set has a key for it, else in `[columns]`.
pub fn entry(recording: &Recording, joint: &Joint, place: usize, more: &str) -> String {
    let signal = &recording.signals[place];
    let place = source(recording, signal, more);
    let name = table_name(&joint.name);
    let mut text = String::new();
    let _ = match (signal.quantity.key(), joint.name.is_empty()) {
        (Some(key), false) => write!(text, "[joints.{name}]\n{key} = {place}"),
        _ => write!(text, "[columns]\n{} = {place}", column_key(signal, joint)),
    };
    text
}

/// A bare key of TOML, else one in quotes.
pub fn table_name(name: &str) -> String {
    let is_bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if is_bare { name.to_string() } else { format!("{name:?}") }
}

fn column_key(signal: &Signal, joint: &Joint) -> String {
    let key = match signal.quantity {
        Quantity::Command => "command",
        quantity => quantity.key().unwrap_or("signal"),
    };
    match joint.name.is_empty() {
        true => key.to_string(),
        false => format!("{:?}", format!("{}.{key}", joint.name)),
    }
}

/// The pieces of a file before and behind rows that do not count: those from `from` up to `to`, which counts again. Rows of data are counted from 0.
pub fn without(file: &str, from: usize, to: usize, rows: usize) -> String {
    let name = std::path::Path::new(file).file_name().map_or_else(|| file.to_string(), |name| name.to_string_lossy().into_owned());
    // A shorter piece is no evidence.
    let piece = |key: &str, from: usize, to: usize| {
        (to > from + LEAST_ROWS).then(|| format!("\n{key} = {{ of = {name:?}, rows = [{from}, {to}] }}"))
    };
    let pieces: String = [piece("before", 0, from), piece("behind", to, rows)].into_iter().flatten().collect();
    format!("[files]{pieces}")
}

/// Rows of the shortest piece that is named.
const LEAST_ROWS: usize = 20;
