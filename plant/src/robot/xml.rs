//! A cursor over an XML file that knows lines: URDF and MJCF are read through it. Every error is a [`FileError`] that names file, line and element.

use crate::elements::Range;
use crate::tomlfile::{FileError, check_range};
use nalgebra::Vector3;
use roxmltree::{Document, Node};

/// An element of a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<'a> {
    node: Node<'a, 'a>,
    file: &'a str,
}

/// Reads a text; `file` stands for it in errors.
pub(super) fn parse<'a>(text: &'a str, file: &str) -> Result<Document<'a>, FileError> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    Document::parse_with_options(text, options).map_err(|error| {
        let (line, message) = (error.pos().row as usize, error.to_string());
        // The parser formats line and column in its own way.
        let message = message.split(" at ").next().unwrap_or(&message).to_string();
        FileError::at(file, line, "", format!("is not valid XML at column {}: {message}", error.pos().col))
    })
}

impl<'a> Element<'a> {
    pub(super) fn root(document: &'a Document<'a>, file: &'a str) -> Element<'a> {
        Element { node: document.root_element(), file }
    }

    pub(super) fn tag(&self) -> &'a str {
        self.node.tag_name().name()
    }

    pub(super) fn line(&self) -> usize {
        self.node.document().text_pos_at(self.node.range().start).row as usize
    }

    /// Such as `<joint name="shoulder">`.
    pub(super) fn describe(&self) -> String {
        match self.node.attribute("name") {
            Some(name) => format!("<{} name=\"{name}\">", self.tag()),
            None => format!("<{}>", self.tag()),
        }
    }

    /// Names it and what it is in: `<joint name="shoulder"> <axis>`.
    fn place(&self) -> String {
        let has_name = self.node.has_attribute("name");
        let owner = self.node.ancestors().skip(1).find(|n| n.is_element() && n.has_attribute("name"));
        match owner.filter(|owner| !has_name && owner.parent_element().is_some()) {
            Some(node) => format!("{} {}", Element { node, file: self.file }.describe(), self.describe()),
            None => self.describe(),
        }
    }

    pub(super) fn error(&self, message: impl Into<String>) -> FileError {
        FileError::at(self.file, self.line(), self.place(), message)
    }

    pub(super) fn error_at(&self, attribute: &str, message: impl Into<String>) -> FileError {
        FileError::at(self.file, self.line(), format!("{} {attribute}", self.place()), message)
    }

    pub(super) fn children(self) -> impl Iterator<Item = Element<'a>> {
        self.node.children().filter(Node::is_element).map(move |node| Element { node, file: self.file })
    }

    pub(super) fn children_named(self, tag: &'a str) -> impl Iterator<Item = Element<'a>> {
        self.children().filter(move |child| child.tag() == tag)
    }

    /// The one child of this name.
    pub(super) fn child(self, tag: &'a str) -> Result<Option<Element<'a>>, FileError> {
        let mut found = self.children_named(tag);
        let first = found.next();
        match found.next() {
            None => Ok(first),
            Some(second) => Err(second.error(format!("a second <{tag}>; expected one"))),
        }
    }

    pub(super) fn need_child(self, tag: &'a str, what: &str) -> Result<Element<'a>, FileError> {
        self.child(tag)?.ok_or_else(|| self.error(format!("has no <{tag}>: {what}")))
    }

    pub(super) fn attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name)
    }

    fn attributes(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.node.attributes().map(|attribute| attribute.name())
    }

    pub(super) fn need_attribute(&self, name: &str) -> Result<&'a str, FileError> {
        match self.attribute(name).map(str::trim) {
            Some("") => Err(self.error_at(name, "must not be empty")),
            Some(text) => Ok(text),
            None => {
                let all: Vec<&str> = self.attributes().collect();
                let has = if all.is_empty() { "no attributes".to_string() } else { all.join(", ") };
                Err(self.error(format!("missing attribute \"{name}\"; it has {has}")))
            }
        }
    }

    /// A text as a number within a range.
    pub(super) fn as_number(&self, name: &str, text: &str, range: Range) -> Result<f64, FileError> {
        let value: f64 = text.trim().parse().map_err(|_| self.error_at(name, format!("expected a number, found \"{text}\"")))?;
        check_range(value, range).map_err(|message| self.error_at(name, message))?;
        Ok(value)
    }

    /// A text as a list of numbers.
    pub(super) fn as_numbers(&self, name: &str, text: &str) -> Result<Vec<f64>, FileError> {
        text.split_whitespace().map(|word| self.as_number(name, word, Range::Any)).collect()
    }

    /// A text as this number of values.
    pub(super) fn as_array<const N: usize>(&self, name: &str, text: &str) -> Result<[f64; N], FileError> {
        let numbers = self.as_numbers(name, text)?;
        let count = numbers.len();
        numbers.try_into().map_err(|_| self.error_at(name, format!("expected {N} numbers, found {count}")))
    }

    pub(super) fn number(&self, name: &str, range: Range) -> Result<Option<f64>, FileError> {
        self.attribute(name).map(|text| self.as_number(name, text, range)).transpose()
    }

    pub(super) fn need_number(&self, name: &str, range: Range) -> Result<f64, FileError> {
        let text = self.need_attribute(name)?;
        self.as_number(name, text, range)
    }

    pub(super) fn vector(&self, name: &str) -> Result<Option<Vector3<f64>>, FileError> {
        Ok(self.attribute(name).map(|text| self.as_array::<3>(name, text)).transpose()?.map(Vector3::from))
    }
}
