//! `<compiler>`: how the numbers of a file are to be understood.

use crate::elements::Range;
use crate::robot::xml::Element;
use crate::tomlfile::FileError;

/// What to do about what is not read in.
pub(super) const SAVE_WHOLE: &str = "let MuJoCo write the whole model (mujoco.mj_saveLastXML in Python) and name that file";

/// Where a body's inertia comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FromGeoms {
    /// From its geoms where it has no `<inertial>`.
    Auto,
    Always,
    Never,
}

/// How the numbers of a file are to be understood.
#[derive(Debug, Clone)]
pub(super) struct Compiler {
    /// rad per unit of an angle.
    pub(super) angle: f64,
    /// Axes of Euler angles, one after the other: about the turned axes, or capital, about the fixed ones.
    pub(super) euler: [char; 3],
    /// Whether a range by itself limits.
    pub(super) autolimits: bool,
    pub(super) from_geoms: FromGeoms,
    /// Groups of geoms that have inertia, from the first to the last.
    pub(super) groups: [f64; 2],
}

impl Compiler {
    pub(super) fn read(root: Element) -> Result<Compiler, FileError> {
        let mut found = Compiler {
            angle: 1f64.to_radians(),
            euler: ['x', 'y', 'z'],
            autolimits: true,
            from_geoms: FromGeoms::Auto,
            groups: [0.0, 5.0],
        };
        for element in root.children_named("compiler") {
            found.take(element)?;
        }
        Ok(found)
    }

    fn take(&mut self, element: Element) -> Result<(), FileError> {
        if let Some(in_degrees) = choice(element, "angle", &[("degree", true), ("radian", false)])? {
            self.angle = if in_degrees { 1f64.to_radians() } else { 1.0 };
        }
        if let Some(text) = element.attribute("eulerseq") {
            let axes: Vec<char> = text.chars().collect();
            let known = |axis: &char| "xyzXYZ".contains(*axis);
            self.euler = match <[char; 3]>::try_from(axes) {
                Ok(axes) if axes.iter().all(known) => axes,
                _ => return Err(element.error_at("eulerseq", format!("expected three of x, y, z, X, Y, Z, found \"{text}\""))),
            };
        }
        if let Some(auto) = choice(element, "autolimits", &[("true", true), ("false", false)])? {
            self.autolimits = auto;
        }
        let ways = [("auto", FromGeoms::Auto), ("true", FromGeoms::Always), ("false", FromGeoms::Never)];
        if let Some(way) = choice(element, "inertiafromgeom", &ways)? {
            self.from_geoms = way;
        }
        if let Some(text) = element.attribute("inertiagrouprange") {
            self.groups = element.as_array("inertiagrouprange", text)?;
        }
        if choice(element, "coordinate", &[("local", false), ("global", true)])? == Some(true) {
            return Err(element.error_at("coordinate", format!("global coordinates are not read: {SAVE_WHOLE}")));
        }
        if choice(element, "balanceinertia", &[("true", true), ("false", false)])? == Some(true) {
            return Err(element.error_at("balanceinertia", format!("changes inertias, which is not done here: {SAVE_WHOLE}")));
        }
        for (name, unchanged) in [("boundmass", 0.0), ("boundinertia", 0.0), ("settotalmass", -1.0)] {
            if element.number(name, Range::Any)?.is_some_and(|value| value > unchanged) {
                return Err(element.error_at(name, format!("changes masses, which is not done here: {SAVE_WHOLE}")));
            }
        }
        Ok(())
    }
}

/// One of several words.
pub(super) fn choice<T: Copy>(element: Element, name: &str, words: &[(&str, T)]) -> Result<Option<T>, FileError> {
    let Some(word) = element.attribute(name) else { return Ok(None) };
    match words.iter().find(|(known, _)| *known == word) {
        Some((_, value)) => Ok(Some(*value)),
        None => {
            let all: Vec<String> = words.iter().map(|(known, _)| format!("\"{known}\"")).collect();
            Err(element.error_at(name, format!("expected {}, found \"{word}\"", all.join(" or "))))
        }
    }
}
