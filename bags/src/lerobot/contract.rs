//! What the columns of a dataset are, which its files do not say. Keys and defaults are those of `Contract` in the Python package.

use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table};
use std::collections::BTreeMap;
use std::path::Path;

/// When the target of a row is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CommandedAt {
    /// At the row's own time; it holds to the next.
    #[default]
    Frame,
    /// It stands in the row before the one at whose time it is sent.
    Next,
}

/// A number for all joints or for each, by the dataset's name of it.
#[derive(Debug, Clone, PartialEq)]
pub enum PerJoint {
    /// The same for all.
    All(f64),
    /// One for each.
    Each(BTreeMap<String, f64>),
}

/// Which features of a dataset are what, in which unit, and when. A feature that the dataset does not have stays missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Contract {
    /// Measured positions, a number a joint.
    pub measured: Option<String>,
    /// Targets that were sent to the joints.
    pub commanded: Option<String>,
    /// Velocities, in the unit of angles over s.
    pub velocity: Option<String>,
    /// Efforts.
    pub effort: Option<String>,
    /// When targets are sent.
    pub commanded_at: CommandedAt,
    /// rad in one unit of measured, commanded and velocity.
    pub angle: PerJoint,
    /// N m in one unit of effort.
    pub effort_scale: PerJoint,
    /// Other names for joints, by the dataset's.
    pub joints: BTreeMap<String, String>,
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

impl Default for Contract {
    fn default() -> Contract {
        Contract {
            measured: Some("observation.state".to_owned()),
            commanded: Some("action".to_owned()),
            velocity: Some("observation.velocity".to_owned()),
            effort: Some("observation.effort".to_owned()),
            commanded_at: CommandedAt::Frame,
            angle: PerJoint::All(DEGREE),
            effort_scale: PerJoint::All(1.0),
            joints: BTreeMap::new(),
        }
    }
}

/// What a feature's numbers are of a joint, as they end the names of columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Position,
    Velocity,
    Command,
    Effort,
}

impl Role {
    pub(crate) const ALL: [Role; 4] = [Role::Position, Role::Velocity, Role::Command, Role::Effort];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Role::Position => "position",
            Role::Velocity => "velocity",
            Role::Command => "command",
            Role::Effort => "effort",
        }
    }
}

impl Contract {
    /// Reads a contract from a TOML file: `measured`, `commanded`, `velocity`, `effort` (`""` for none), `commanded_at` (`"frame"`, `"next"`), `angle` (`"deg"`,
    /// `"rad"`, rad a unit, or a table of these by joint), `effort_scale`, `joints`. What it does not say is as by default.
    ///
    /// # Errors
    /// The file cannot be read, or a key is unknown or wrong.
    pub fn read(path: &Path) -> Result<Contract, FileError> {
        let mut table = Table::open(path)?;
        let mut contract = Contract::default();
        for (key, feature) in [
            ("measured", &mut contract.measured),
            ("commanded", &mut contract.commanded),
            ("velocity", &mut contract.velocity),
            ("effort", &mut contract.effort),
        ] {
            if let Some(name) = table.string(key)? {
                *feature = Some(name).filter(|name| !name.is_empty());
            }
        }
        if let Some(at) = table.one_of("commanded_at", &[("frame", CommandedAt::Frame), ("next", CommandedAt::Next)])? {
            contract.commanded_at = at;
        }
        if let Some(angle) = per_joint(&mut table, "angle")? {
            contract.angle = angle;
        }
        if let Some(scale) = per_joint(&mut table, "effort_scale")? {
            contract.effort_scale = scale;
        }
        if let Some(mut joints) = table.table("joints")? {
            for joint in joints.keys() {
                let name = joints.need_string(&joint)?;
                contract.joints.insert(joint, name);
            }
            joints.finish()?;
        }
        table.finish()?;
        Ok(contract)
    }

    /// The feature that has a role.
    pub(crate) fn feature(&self, role: Role) -> Option<&str> {
        let feature = match role {
            Role::Position => &self.measured,
            Role::Velocity => &self.velocity,
            Role::Command => &self.commanded,
            Role::Effort => &self.effort,
        };
        feature.as_deref()
    }

    /// An entry for a joint that is none of the dataset's, which would be without effect: a sentence.
    pub(crate) fn unknown_joint(&self, joints: &[String]) -> Option<String> {
        let each = |of: &PerJoint| match of {
            PerJoint::All(_) => Vec::new(),
            PerJoint::Each(by) => by.keys().cloned().collect(),
        };
        let told =
            [("angle", each(&self.angle)), ("effort_scale", each(&self.effort_scale)), ("joints", self.joints.keys().cloned().collect())];
        told.into_iter().find_map(|(key, named)| {
            let unknown = named.into_iter().find(|joint| !joints.contains(joint))?;
            Some(format!("contract: {key}: the dataset has no joint {unknown:?}; it has {}", joints.join(", ")))
        })
    }

    /// SI units in one of the dataset's.
    ///
    /// # Errors
    /// A sentence: the joint has none.
    pub(crate) fn scale(&self, role: Role, joint: &str) -> Result<f64, String> {
        let (key, of) = if role == Role::Effort { ("effort_scale", &self.effort_scale) } else { ("angle", &self.angle) };
        match of {
            PerJoint::All(scale) => Ok(*scale),
            PerJoint::Each(by) => by.get(joint).copied().ok_or_else(|| {
                let told: Vec<&str> = by.keys().map(String::as_str).collect();
                format!("contract: {key}: does not contain the joint {joint:?}; it has {}", told.join(", "))
            }),
        }
    }
}

fn per_joint(table: &mut Table, key: &str) -> Result<Option<PerJoint>, FileError> {
    if !table.is_table(key) {
        return Ok(number(table, key)?.map(PerJoint::All));
    }
    let Some(mut by) = table.table(key)? else { return Ok(None) };
    let mut each = BTreeMap::new();
    for joint in by.keys() {
        if let Some(value) = number(&mut by, &joint)? {
            each.insert(joint, value);
        }
    }
    by.finish()?;
    Ok(Some(PerJoint::Each(each)))
}

fn number(table: &mut Table, key: &str) -> Result<Option<f64>, FileError> {
    let value = match table.is_string(key) {
        true => table.one_of(key, &[("deg", DEGREE), ("rad", 1.0)])?,
        false => table.number(key, Range::Any)?,
    };
    match value {
        Some(0.0) => Err(table.error_at(key, "must not be 0")),
        value => Ok(value),
    }
}
