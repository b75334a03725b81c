//! Edits to a model file that keep its comments, its order and everything that they do not name.

use super::text::{number, parameter_text};
use crate::elements::{Law, Parameter};
use crate::model::Model;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value as TomlValue, value};

/// A parameter's new value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A list of numbers.
    Numbers(Vec<f64>),
}

/// An element by the names of its ends, as a file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementSpec {
    /// Unique in the model.
    pub name: String,
    /// Names of bodies, or `ground`.
    pub between: [String; 2],
    /// Kind and parameters.
    pub law: Law,
}

/// One edit. A `comment`, without its `#`, goes to the end of the line that was set, or above a new table.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Sets a number or a list: `bodies.drum`, `elements.cable.stiffness`, `inputs.feedback_force.delay`,
    /// `outputs.motor_position.offset`, `axes.forward.force`. The body or table must be there, the key need not.
    Set {
        /// Section, name and key; the name may hold dots.
        path: String,
        /// The new value.
        value: Value,
        /// Why.
        comment: Option<String>,
    },
    /// Adds an element; one of the same name is replaced where it stands.
    PutElement {
        /// The element.
        element: ElementSpec,
        /// Why.
        comment: Option<String>,
    },
    /// Takes an element out.
    RemoveElement {
        /// Its name.
        name: String,
    },
    /// Adds a body, or sets the inertia of the one that is there.
    PutBody {
        /// Its name.
        name: String,
        /// kg or kg m².
        inertia: f64,
        /// Why.
        comment: Option<String>,
    },
}

/// Why an edit cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PatchError {
    /// The original text is not TOML.
    #[error("the model to be edited is not valid TOML: {0}")]
    NotToml(String),
    /// A path that no edit can set.
    #[error("\"{0}\" is not a path that can be set; expected bodies.NAME or (elements|inputs|outputs|axes).NAME.KEY")]
    Path(String),
    /// There is no table of that name.
    #[error("there is no \"{name}\" among the model's {section}")]
    NoSuch {
        /// `elements`, `inputs`, `outputs` or `axes`.
        section: String,
        /// The name that was asked for.
        name: String,
    },
    /// A section is not what a model file has there.
    #[error("\"{0}\" is not written as a model file writes it")]
    Section(String),
}

/// Makes the edits in their order; everything else of `original` stays unchanged, comments included.
pub fn patch(original: &str, edits: &[Edit]) -> Result<String, PatchError> {
    let mut document: DocumentMut = original.parse().map_err(|e: toml_edit::TomlError| PatchError::NotToml(e.message().to_string()))?;
    for edit in edits {
        match edit {
            Edit::Set { path, value, comment } => set(&mut document, path, value, comment.as_deref())?,
            Edit::PutElement { element, comment } => put_element(&mut document, element, comment.as_deref())?,
            Edit::RemoveElement { name } => remove_element(&mut document, name)?,
            Edit::PutBody { name, inertia, comment } => {
                let bodies = bodies(&mut document)?;
                put(bodies, name, number_value(*inertia), comment.as_deref());
            }
        }
    }
    Ok(document.to_string())
}

/// A number rounded to this number of significant digits, for files that people read.
pub fn round_significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

impl Model {
    /// An element by names, for an [`Edit`]; `None` where there is no such index.
    pub fn element_spec(&self, index: usize) -> Option<ElementSpec> {
        let element = self.elements.get(index)?;
        Some(ElementSpec {
            name: element.name.clone(),
            between: element.between.map(|place| self.place_name(place).to_string()),
            law: element.law.clone(),
        })
    }
}

fn number_value(x: f64) -> TomlValue {
    // Parsed from our own writing of numbers, so that 39500 is written 39500.0 and 0.000002 is 2e-6.
    number(x).parse().unwrap_or_else(|_| TomlValue::from(x))
}

fn to_toml(v: &Value) -> TomlValue {
    match v {
        Value::Number(x) => number_value(*x),
        Value::Numbers(list) => TomlValue::Array(list.iter().map(|x| number_value(*x)).collect::<Array>()),
    }
}

fn bodies(document: &mut DocumentMut) -> Result<&mut dyn toml_edit::TableLike, PatchError> {
    if !document.contains_key("bodies") {
        document.insert("bodies", Item::Table(Table::new()));
    }
    document.get_mut("bodies").and_then(Item::as_table_like_mut).ok_or_else(|| PatchError::Section("bodies".to_string()))
}

/// The tables of a section; a list of inline tables becomes `[[section]]`.
fn tables<'a>(document: &'a mut DocumentMut, section: &str) -> Result<&'a mut ArrayOfTables, PatchError> {
    let wrong = || PatchError::Section(section.to_string());
    let item = document.entry(section).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
    if !item.is_array_of_tables() {
        *item = std::mem::take(item).into_array_of_tables().map(Item::ArrayOfTables).map_err(|_| wrong())?;
    }
    item.as_array_of_tables_mut().ok_or_else(wrong)
}

/// Index of a table by its name; elements without one count as element0, element1, ...
fn find(tables: &ArrayOfTables, section: &str, name: &str) -> Option<usize> {
    tables.iter().enumerate().position(|(index, table)| match table.get("name").and_then(Item::as_str) {
        Some(given) => given == name,
        None => section == "elements" && name == format!("element{index}"),
    })
}

fn set(document: &mut DocumentMut, path: &str, v: &Value, comment: Option<&str>) -> Result<(), PatchError> {
    let bad_path = || PatchError::Path(path.to_string());
    let (section, rest) = path.split_once('.').ok_or_else(bad_path)?;
    if section == "bodies" {
        let table = bodies(document)?;
        if !table.contains_key(rest) {
            return Err(PatchError::NoSuch { section: section.to_string(), name: rest.to_string() });
        }
        put(table, rest, to_toml(v), comment);
        return Ok(());
    }
    if !["elements", "inputs", "outputs", "axes"].contains(&section) {
        return Err(bad_path());
    }
    // Keys hold no dots, names may (those of an attached grip do).
    let (name, key) = rest.rsplit_once('.').ok_or_else(bad_path)?;
    let missing = || PatchError::NoSuch { section: section.to_string(), name: name.to_string() };
    let all = tables(document, section)?;
    let index = find(all, section, name).ok_or_else(missing)?;
    let table = all.get_mut(index).ok_or_else(missing)?;
    put(table, key, to_toml(v), comment);
    Ok(())
}

/// Sets a key in place, with what stood around the old value, and the comment behind it.
fn put(table: &mut dyn toml_edit::TableLike, key: &str, mut new: TomlValue, comment: Option<&str>) {
    let old = table.get(key).and_then(Item::as_value);
    let (prefix, suffix) = match old {
        Some(v) => (text(v.decor().prefix(), " "), text(v.decor().suffix(), "")),
        None => (" ".to_string(), String::new()),
    };
    let suffix = match comment.map(one_line) {
        None => suffix,
        Some(comment) if suffix.contains('#') => format!("{}; {comment}", suffix.trim_end()),
        Some(comment) => format!("  # {comment}"),
    };
    new.decor_mut().set_prefix(prefix);
    new.decor_mut().set_suffix(suffix);
    match table.get_mut(key) {
        Some(item) => *item = value_item(new),
        None => {
            table.insert(key, value_item(new));
        }
    }
}

fn value_item(v: TomlValue) -> Item {
    Item::Value(v)
}

fn text(raw: Option<&toml_edit::RawString>, otherwise: &str) -> String {
    raw.and_then(|r| r.as_str()).unwrap_or(otherwise).to_string()
}

fn one_line(comment: &str) -> String {
    comment.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn put_element(document: &mut DocumentMut, element: &ElementSpec, comment: Option<&str>) -> Result<(), PatchError> {
    let all = tables(document, "elements")?;
    let index = find(all, "elements", &element.name);
    match index.and_then(|i| all.get_mut(i)) {
        Some(table) => {
            let kind = element.law.kind();
            let same_kind = table.get("kind").and_then(Item::as_str) == Some(kind.name);
            let known = |key: &str| ["name", "kind", "between"].contains(&key) || kind.parameters.iter().any(|p| p.key == key);
            table.retain(|key, _| known(key));
            fill(table, element, same_kind);
            add_comment(table, comment);
        }
        None => {
            let mut table = Table::new();
            table.decor_mut().set_prefix("\n");
            fill(&mut table, element, false);
            add_comment(&mut table, comment);
            all.push(table);
        }
    }
    Ok(())
}

/// Sets name, kind, ends and parameters; where the kind stays, values that stay keep their line untouched.
fn fill(table: &mut Table, element: &ElementSpec, same_kind: bool) {
    let set_text = |table: &mut Table, key: &str, new: &str| {
        if table.get(key).and_then(Item::as_str) != Some(new) {
            put(table, key, TomlValue::from(new), None);
        }
    };
    set_text(table, "name", &element.name);
    set_text(table, "kind", element.law.kind().name);
    let standing: Option<Vec<&str>> =
        table.get("between").and_then(Item::as_array).map(|a| a.iter().filter_map(TomlValue::as_str).collect());
    if standing.as_deref() != Some(&[element.between[0].as_str(), element.between[1].as_str()]) {
        put(table, "between", TomlValue::Array(element.between.iter().map(String::as_str).collect()), None);
    }
    for (parameter, v) in element.law.kind().parameters.iter().zip(element.law.values()) {
        if same_kind && stands(table, parameter, &v) {
            continue;
        }
        match parameter_text(parameter, &v) {
            None if table.contains_key(parameter.key) && v.len() == 1 => put(table, parameter.key, number_value(v[0]), None),
            None => {}
            Some(_) if parameter.list => put(table, parameter.key, to_toml(&Value::Numbers(v)), None),
            Some(_) => put(table, parameter.key, number_value(v[0]), None),
        }
    }
}

/// Whether a parameter stands in the file with this value.
fn stands(table: &Table, parameter: &Parameter, v: &[f64]) -> bool {
    let number = |item: &TomlValue| item.as_float().or_else(|| item.as_integer().map(|i| i as f64));
    match table.get(parameter.key).and_then(Item::as_value) {
        Some(TomlValue::Array(list)) => list.iter().map(number).collect::<Option<Vec<_>>>().as_deref() == Some(v),
        // The numbers are in another file, which the edit does not know to differ.
        Some(TomlValue::String(_)) => true,
        Some(item) => number(item).is_some_and(|x| v == [x]),
        None => false,
    }
}

fn add_comment(table: &mut Table, comment: Option<&str>) {
    if let Some(comment) = comment.map(one_line) {
        let before = text(table.decor().prefix(), "\n");
        table.decor_mut().set_prefix(format!("{before}# {comment}\n"));
    }
}

fn remove_element(document: &mut DocumentMut, name: &str) -> Result<(), PatchError> {
    let all = tables(document, "elements")?;
    let missing = || PatchError::NoSuch { section: "elements".to_string(), name: name.to_string() };
    // Elements without a name are called by their place, so the ones behind must be named before it shifts.
    let index = find(all, "elements", name).ok_or_else(missing)?;
    for (place, table) in all.iter_mut().enumerate().skip(index + 1) {
        if !table.contains_key("name") {
            table.insert("name", value(format!("element{place}")));
        }
    }
    all.remove(index);
    Ok(())
}
