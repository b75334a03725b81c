//! Numbers, texts and lists as TOML writes them.

use crate::elements::Parameter;

/// A number as TOML that reads back as the same number: `39500.0`, `2e-6`.
pub fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A text as TOML, in quotes.
pub fn string(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}

/// A name as a key of TOML, in quotes where it needs them.
pub fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.to_string() } else { string(name) }
}

pub(super) fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(", "))
}

pub(super) fn strings<'a>(values: impl IntoIterator<Item = &'a str>) -> String {
    format!("[{}]", values.into_iter().map(string).collect::<Vec<_>>().join(", "))
}

/// A parameter's value as TOML; `None` where it is the default, which files leave out.
pub(super) fn parameter_text(parameter: &Parameter, value: &[f64]) -> Option<String> {
    match (parameter.list, value) {
        (true, []) => None,
        (true, values) => Some(list(values)),
        (false, [one]) if parameter.default == Some(*one) => None,
        (false, [one]) => Some(number(*one)),
        // A law that has no such value: its default builds it again.
        (false, _) => None,
    }
}
