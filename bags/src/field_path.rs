//! Where a number stands in a message.

/// Where a number stands in a message: `effort[0]`, `effort[elbow]` (by the message's names of its joints), `wrench.force.x`, `header.stamp` (a time, in s).
#[derive(Debug, Clone, PartialEq)]
pub struct FieldPath {
    pub(crate) text: String,
    /// Place of the field in its type, and which entry of it if it is a list.
    pub(crate) steps: Vec<(usize, Option<Entry>)>,
    pub(crate) is_time: bool,
}

/// Which entry of a list.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Entry {
    At(usize),
    /// The one that stands where the message's list `name` has this name.
    Named(String),
}

impl FieldPath {
    /// In a message of JSON or protobuf only the first entry of a path matters here: whether it is by place or by name.
    pub(crate) fn of_json(path: &str) -> FieldPath {
        let first = path.split_once('[').filter(|(list, _)| !list.contains('.')).and_then(|(_, rest)| rest.split_once(']'));
        let entry = first.map(|(entry, _)| entry.parse().map_or_else(|_| Entry::Named(entry.to_owned()), Entry::At));
        FieldPath { text: path.to_owned(), steps: vec![(0, entry)], is_time: false }
    }

    /// Whether it takes an entry of a list of the message by its place.
    pub fn is_by_place(&self) -> bool {
        matches!(self.steps.first(), Some((_, Some(Entry::At(_)))))
    }

    /// Whether it takes an entry by the name of a joint, which a message need not have.
    pub fn is_by_name(&self) -> bool {
        matches!(self.steps.first(), Some((_, Some(Entry::Named(_)))))
    }
}

impl std::fmt::Display for FieldPath {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}
