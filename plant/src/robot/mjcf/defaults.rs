//! `<default>`: classes of attributes, each with those of the enclosing class.

use crate::elements::Range;
use crate::robot::xml::Element;
use crate::tomlfile::{FileError, unknown};

/// The class that holds where no other does.
const MAIN: &str = "main";

/// All classes of a file.
#[derive(Debug)]
pub(super) struct Defaults<'a> {
    classes: Vec<Class<'a>>,
}

#[derive(Debug)]
struct Class<'a> {
    name: &'a str,
    around: Option<usize>,
    elements: Vec<Element<'a>>,
}

/// Index of a class.
pub(super) type ClassIndex = usize;

/// An element with the attributes of its class.
#[derive(Debug, Clone, Copy)]
pub(super) struct Styled<'a, 'd> {
    pub(super) element: Element<'a>,
    defaults: &'d Defaults<'a>,
    class: ClassIndex,
    /// Elements of a class that speak of this one.
    tags: &'d [&'d str],
}

impl<'a> Defaults<'a> {
    pub(super) fn read(root: Element<'a>) -> Result<Defaults<'a>, FileError> {
        let mut found = Defaults { classes: vec![Class { name: MAIN, around: None, elements: Vec::new() }] };
        let mut open: Vec<(Element<'a>, ClassIndex)> = Vec::new();
        for element in root.children_named("default") {
            if let Some(name) = element.attribute("class") {
                found.classes[0].name = name;
            }
            open.push((element, 0));
        }
        while let Some((element, class)) = open.pop() {
            for child in element.children() {
                if child.tag() != "default" {
                    found.classes[class].elements.push(child);
                    continue;
                }
                let name = child.need_attribute("class")?;
                if found.classes.iter().any(|other| other.name == name) {
                    return Err(child.error_at("class", format!("another class is called \"{name}\"; names must be unique")));
                }
                found.classes.push(Class { name, around: Some(class), elements: Vec::new() });
                open.push((child, found.classes.len() - 1));
            }
        }
        Ok(found)
    }

    /// The class that an attribute of an element names; `otherwise` where it names none.
    pub(super) fn class(&self, element: Element<'a>, attribute: &str, otherwise: ClassIndex) -> Result<ClassIndex, FileError> {
        let Some(name) = element.attribute(attribute) else { return Ok(otherwise) };
        let index = self.classes.iter().position(|class| class.name == name);
        index.ok_or_else(|| element.error_at(attribute, unknown("class", name, self.classes.iter().map(|class| class.name))))
    }

    /// An element with the attributes of its class; `around` is the class of the enclosing element.
    pub(super) fn styled<'d>(&'d self, element: Element<'a>, around: ClassIndex, tags: &'d [&'d str]) -> Result<Styled<'a, 'd>, FileError> {
        Ok(Styled { element, defaults: self, class: self.class(element, "class", around)?, tags })
    }
}

impl<'a> Styled<'a, '_> {
    /// An attribute, and the element that it stands at.
    pub(super) fn text(&self, name: &str) -> Option<(Element<'a>, &'a str)> {
        if let Some(text) = self.element.attribute(name) {
            return Some((self.element, text));
        }
        let mut class = Some(self.class);
        while let Some(index) = class {
            let class_here = &self.defaults.classes[index];
            let speaks = |element: &&Element<'a>| self.tags.contains(&element.tag());
            let last = class_here.elements.iter().filter(speaks).filter_map(|e| e.attribute(name).map(|text| (*e, text))).next_back();
            if last.is_some() {
                return last;
            }
            class = class_here.around;
        }
        None
    }

    pub(super) fn number(&self, name: &str, range: Range) -> Result<Option<f64>, FileError> {
        self.text(name).map(|(element, text)| element.as_number(name, text, range)).transpose()
    }

    pub(super) fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, FileError> {
        self.text(name).map(|(element, text)| element.as_numbers(name, text)).transpose()
    }

    pub(super) fn array<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, FileError> {
        self.text(name).map(|(element, text)| element.as_array(name, text)).transpose()
    }

    /// Whether a limit is in force: as `flag` states, or automatically where the file has a range (`auto`).
    pub(super) fn limited(&self, flag: &str, range: &str, autolimits: bool) -> Result<bool, FileError> {
        match self.text(flag) {
            Some((_, "true")) => Ok(true),
            Some((_, "false")) => Ok(false),
            None | Some((_, "auto")) => Ok(autolimits && self.text(range).is_some()),
            Some((element, other)) => Err(element.error_at(flag, format!("expected \"true\", \"false\" or \"auto\", found \"{other}\""))),
        }
    }
}
