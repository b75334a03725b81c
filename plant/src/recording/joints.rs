//! Where a log of an arm keeps position, velocity and torque of each joint.

use super::columns::{ColumnRule, Columns, Source, read_one};
use crate::elements::Range;
use crate::tomlfile::{FileError, Table};

/// What a log has of a joint. Its columns are called `NAME.position`, `NAME.velocity` and `NAME.torque`, with a rule for each.
#[derive(Debug, Clone, PartialEq)]
pub struct JointColumns {
    /// Name of the joint in the robot file.
    pub name: String,
    /// Whether its velocity was logged.
    pub has_velocity: bool,
    /// Torque per current that the set states, N m/A or N/A, where the current was logged instead of the torque.
    pub torque_constant: Option<f64>,
    /// Whether the set has `torque = 0`: the joint has no motor, and no column holds its torque.
    pub is_passive: bool,
    /// Whether the position command of its servo was logged.
    pub has_command: bool,
    /// Whether its torque was logged, or a current with a torque constant. Only a joint with a command may be without.
    pub has_torque: bool,
}

impl JointColumns {
    /// Name of the signal of its position, rad or m.
    pub fn position(&self) -> String {
        format!("{}.position", self.name)
    }

    /// Name of the signal of its velocity, rad/s or m/s.
    pub fn velocity(&self) -> String {
        format!("{}.velocity", self.name)
    }

    /// Name of the signal of its torque or force, N m or N.
    pub fn torque(&self) -> String {
        format!("{}.torque", self.name)
    }

    /// Name of the signal of its servo's position command, rad or m.
    pub fn command(&self) -> String {
        format!("{}.command", self.name)
    }

    /// A joint of a position servo whose torque was not logged, with a column of each of these headings as it stands.
    pub fn of_servo(name: &str, command: &str, position: &str, columns: &mut Columns) -> JointColumns {
        let joint = JointColumns {
            name: name.to_string(),
            has_velocity: false,
            torque_constant: None,
            is_passive: false,
            has_command: true,
            has_torque: false,
        };
        for (signal, heading) in [(joint.command(), command), (joint.position(), position)] {
            columns.push((signal, ColumnRule::of(Source::Column(heading.to_string()))));
        }
        joint
    }

    /// Reads a column of each of these headings as it stands; without a heading for it, no velocity.
    pub fn of_headings(name: &str, position: &str, velocity: Option<&str>, torque: &str, columns: &mut Columns) -> JointColumns {
        let joint = JointColumns {
            name: name.to_string(),
            has_velocity: velocity.is_some(),
            torque_constant: None,
            is_passive: false,
            has_command: false,
            has_torque: true,
        };
        let mut add = |signal: String, heading: &str| columns.push((signal, ColumnRule::of(Source::Column(heading.to_string()))));
        add(joint.position(), position);
        add(joint.torque(), torque);
        if let Some(heading) = velocity {
            add(joint.velocity(), heading);
        }
        joint
    }
}

/// Whether a key holds the number 0; other numbers are no torque of a log.
fn is_zero(table: &mut Table, key: &str) -> Result<bool, FileError> {
    if !table.contains(key) || table.is_string(key) || table.is_table(key) || table.is_list(key) {
        return Ok(false);
    }
    match table.number(key, Range::Any)? {
        Some(0.0) => Ok(true),
        Some(other) => Err(table.error_at(key, format!("expected the heading of a column, a table with column, or with topic and field, or 0 for a joint without a motor; is {other}"))),
        None => Ok(false),
    }
}

/// Reads `[joints.NAME]` tables: `position`, `torque` (0 for a joint without a motor) or `current` with `torque_constant`, or the `command` of a position
/// servo. `velocity` is optional. Each is a heading or a table as in `[columns]`. The rules are added to `columns`.
pub(crate) fn read_joints(mut table: Table, columns: &mut Columns) -> Result<Vec<JointColumns>, FileError> {
    let mut joints = Vec::new();
    for name in table.keys() {
        let mut below = table.table(&name)?.ok_or_else(|| table.missing(&name))?;
        let position = read_one(&mut below, "position")?.ok_or_else(|| below.missing("position"))?;
        let velocity = read_one(&mut below, "velocity")?;
        let command = read_one(&mut below, "command")?;
        let is_passive = is_zero(&mut below, "torque")?;
        let torque = if is_passive { None } else { read_one(&mut below, "torque")? };
        let current = read_one(&mut below, "current")?;
        let constant = below.number("torque_constant", Range::Any)?;
        let torque = match (torque, current, constant) {
            (None, None, None) if is_passive => None,
            (None, _, _) if is_passive => {
                return Err(below.error_at("torque", "is 0, which means that the joint has no motor; omit current and torque_constant"));
            }
            (Some(torque), None, None) => Some(torque),
            (None, Some(current), Some(constant)) if constant != 0.0 => {
                Some(ColumnRule { scale: Some(current.scale.unwrap_or(1.0) * constant), offset: current.offset * constant, ..current })
            }
            (None, Some(_), Some(_)) => return Err(below.error_at("torque_constant", "must not be 0")),
            // A servo's current without a constant has no scale, often no sign: it is no torque.
            (None, Some(_), None) if command.is_some() => None,
            (None, Some(_), None) => return Err(below.missing("torque_constant")),
            (Some(_), Some(_), _) => return Err(below.error("has both a torque and a current; keep one")),
            (Some(_), None, Some(_)) => {
                return Err(below.error_at("torque_constant", "is for a current, but this joint has a torque; set scale at the torque"));
            }
            (None, None, Some(_)) => {
                return Err(below.error_at("torque_constant", "is for a current, and this joint has none; omit it"));
            }
            (None, None, None) if command.is_some() => None,
            (None, None, None) => {
                return Err(below
                    .error("has neither a torque nor a command; add torque = \"HEADING\", or for a position servo command = \"HEADING\""));
            }
        };
        below.finish()?;
        let joint = JointColumns {
            name,
            has_velocity: velocity.is_some(),
            torque_constant: constant,
            is_passive,
            has_command: command.is_some(),
            has_torque: torque.is_some(),
        };
        columns.push((joint.position(), position));
        for (signal, rule) in [(joint.torque(), torque), (joint.command(), command)] {
            if let Some(rule) = rule {
                columns.push((signal, rule));
            }
        }
        if let Some(velocity) = velocity {
            columns.push((joint.velocity(), velocity));
        }
        joints.push(joint);
    }
    table.finish()?;
    Ok(joints)
}
