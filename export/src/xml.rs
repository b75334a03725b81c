//! Text of XML: attributes, and changes to a file that leave the rest of it unchanged.

use roxmltree::Node;
use std::ops::Range;

/// A number with every digit.
pub(crate) fn number(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        // Whole numbers as such: `2`, not `2.0`.
        _ if value == value.trunc() && value.abs() < 1e9 => format!("{value:.0}"),
        _ => format!("{value:?}"),
    }
}

/// Numbers with spaces between them.
pub(crate) fn numbers(values: &[f64]) -> String {
    values.iter().map(|v| number(*v)).collect::<Vec<_>>().join(" ")
}

/// A text that may stand in an attribute.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A text that may stand in a comment.
pub(crate) fn comment(text: &str) -> String {
    text.replace("--", "- -")
}

/// Changes to a text, made all at once.
#[derive(Debug, Default)]
pub(crate) struct Edits(Vec<(Range<usize>, String)>);

impl Edits {
    /// Replaces a part of the text.
    pub(crate) fn replace(&mut self, range: Range<usize>, by: impl Into<String>) {
        self.0.push((range, by.into()));
    }

    /// Puts something in at a place.
    pub(crate) fn insert(&mut self, at: usize, text: impl Into<String>) {
        self.replace(at..at, text);
    }

    /// Gives an element an attribute with this value.
    pub(crate) fn set(&mut self, node: Node, name: &str, value: &str) {
        match node.attribute_node(name) {
            Some(there) => self.replace(there.range_value(), escaped(value)),
            None => self.insert(name_end(node), format!(" {name}=\"{}\"", escaped(value))),
        }
    }

    /// Takes an element out, with the white space before it in its line.
    pub(crate) fn remove(&mut self, node: Node) {
        self.replace(node.range(), "");
    }

    /// Puts elements in at the end of one that has an end tag, or opens one that has none.
    pub(crate) fn append(&mut self, node: Node, inside: &str) {
        let text = &node.document().input_text()[node.range()];
        match text.rfind("</") {
            Some(at) if !text.ends_with("/>") => self.insert(node.range().start + at, inside),
            _ => self.replace(node.range().end - 2..node.range().end, format!(">{inside}</{}>", node.tag_name().name())),
        }
    }

    /// The text with all changes. Of changes in a part that is replaced as a whole only that counts.
    pub(crate) fn done(mut self, text: &str) -> String {
        self.0.sort_by_key(|(range, _)| (range.start, std::cmp::Reverse(range.end)));
        let (mut out, mut at) = (String::with_capacity(text.len()), 0);
        for (range, by) in self.0 {
            if range.start < at {
                continue;
            }
            out.push_str(text.get(at..range.start).unwrap_or_default());
            out.push_str(&by);
            at = range.end;
        }
        out.push_str(text.get(at..).unwrap_or_default());
        out
    }
}

/// Where the name of an element's start tag ends.
fn name_end(node: Node) -> usize {
    let text = &node.document().input_text()[node.range()];
    let name = text[1..].find(|c: char| c.is_whitespace() || c == '/' || c == '>').unwrap_or(text.len() - 1);
    node.range().start + 1 + name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_whole() {
        assert_eq!(numbers(&[0.0, -0.0, 1.0, -2.0, 0.1, 1e-9, 1e12]), "0 0 1 -2 0.1 1e-9 1000000000000.0");
        assert_eq!(number(100.0), "100");
        assert_eq!(number(-10.0), "-10");
        assert_eq!(number(-0.5), "-0.5");
    }

    #[test]
    fn edits_leave_the_rest_as_it_was() {
        let text = "<a>\n  <!-- kept -->\n  <b x='1' y=\"2\"/>\n  <c><d/></c>\n</a>";
        let document = roxmltree::Document::parse(text).unwrap();
        let node = |name: &str| document.descendants().find(|n| n.has_tag_name(name)).unwrap();
        let mut edits = Edits::default();
        edits.set(node("b"), "x", "<3>");
        edits.set(node("b"), "z", "4");
        edits.append(node("d"), "<e/>");
        edits.append(node("a"), "<f/>");
        assert_eq!(edits.done(text), "<a>\n  <!-- kept -->\n  <b z=\"4\" x='&lt;3&gt;' y=\"2\"/>\n  <c><d><e/></d></c>\n<f/></a>");
        let mut edits = Edits::default();
        edits.set(node("d"), "x", "1");
        edits.remove(node("c"));
        assert_eq!(edits.done(text), "<a>\n  <!-- kept -->\n  <b x='1' y=\"2\"/>\n  \n</a>");
    }
}
