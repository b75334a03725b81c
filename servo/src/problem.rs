//! A set of commands and positions with the model that they are compared with.

use crate::error::ServoError;
use crate::gravity;
use crate::record::Record;
use backdrive_bags::{Reader, recording};
use backdrive_plant::model::{Hold, Model};
use backdrive_plant::recording::units::{Kind, split};
use backdrive_plant::recording::{ColumnRule, Columns, JointColumns, Recording, Source};
use backdrive_plant::servo::Numbers;
use backdrive_plant::set::RecordingSet;
use rayon::prelude::*;
use std::path::Path;

/// Commands and positions of joints.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The model; one of its name only, where none was given.
    pub model: Model,
    /// Each joint of the set.
    pub joints: Vec<Joint>,
    /// What a reader should know.
    pub notes: Vec<String>,
}

/// One joint and all that was recorded of it.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Recordings that a fit may see.
    pub fit: Vec<Record>,
    /// Recordings that no fit may see.
    pub held_out: Vec<Record>,
    /// What the model states of it.
    pub given: Option<Numbers>,
    /// Whether the model has a robot with this joint, so that the torque of gravity is known.
    pub is_weighed: bool,
}

/// Whether a set holds commands of position servos, and no torque. `Ok(false)` also where its first file cannot be read, which is reported there.
pub fn is_servo(set: &RecordingSet) -> bool {
    if !set.joints.is_empty() {
        return set.joints.iter().any(|j| j.has_command) && set.joints.iter().all(|j| !j.has_torque);
    }
    let Some(first) = set.fit.iter().chain(&set.held_out).next() else { return false };
    if set.is_bag(first) && !device_joints(set, first).is_empty() {
        return true;
    }
    let Ok(headings) = names_in(set, first) else { return false };
    let plain: Vec<&str> = headings.iter().map(|h| split(h).0).collect();
    let ends = |ends: &[&str]| plain.iter().any(|h| ends.iter().any(|e| h.ends_with(e)));
    !pairs(&plain).is_empty() && !ends(&[".torque", ".effort", "_torque", "_effort", ".tau"])
}

/// Joints of the devices of a run that took positions: name, topic of the command, topic of the position, and index of the axis. A device is known by
/// the topic on which it reports its bus.
fn device_joints(set: &RecordingSet, file: &str) -> Vec<(String, String, String, usize)> {
    let Ok(reader) = Reader::open_begun(&set.path_of(file)) else { return Vec::new() };
    let has = |name: &str| reader.topics().iter().any(|t| t.name == name);
    let mut found: Vec<(String, String, String, usize)> = Vec::new();
    for measured in reader.topics() {
        let Some(node) = measured.name.strip_suffix("/measured_js") else { continue };
        let command = format!("{node}/servo_jp");
        if !has(&format!("{node}/bus")) || !has(&command) {
            continue;
        }
        for (axis, name) in measured.axes.iter().enumerate() {
            // Two arms may have joints of one name.
            let taken = found.iter().any(|(other, ..)| other == name);
            let name = if taken { format!("{}_{name}", node.trim_start_matches('/')) } else { name.clone() };
            found.push((name, command.clone(), measured.name.clone(), axis));
        }
    }
    found
}

/// Headings of a table, or of what was a table before it became a bag.
fn names_in(set: &RecordingSet, file: &str) -> Result<Vec<String>, ServoError> {
    if !set.is_bag(file) {
        return Ok(set.table(file).headings()?);
    }
    let reader = Reader::open_begun(&set.path_of(file))?;
    Ok(reader.topics().iter().filter_map(|t| t.name.strip_prefix("/recording/").map(str::to_string)).collect())
}

/// Joints with a command and a position by their headings: name, heading of the command, heading of the position.
fn pairs(plain: &[&str]) -> Vec<(String, String, String)> {
    let mut out = Vec::new();
    for heading in plain {
        for (command, positions) in
            [(".command", [".position", ".state"]), ("_command", ["_position", "_state"]), (".action", [".state", ".position"])]
        {
            let Some(name) = heading.strip_suffix(command) else { continue };
            let position = positions.iter().map(|p| format!("{name}{p}")).find(|p| plain.contains(&p.as_str()));
            if let Some(position) = position.filter(|_| !name.is_empty()) {
                out.push((name.to_string(), (*heading).to_string(), position));
            }
        }
    }
    out
}

impl Problem {
    /// Reads a set; `model` replaces the set's own.
    ///
    /// # Errors
    /// Where a file cannot be read, a column, topic or field is missing, or a unit is none of an angle or a length.
    pub fn open(set: &RecordingSet, model: Option<&Path>) -> Result<Problem, ServoError> {
        let mut set = set.clone();
        let model = match model.or(set.model.as_deref()) {
            Some(path) => Model::load(path)?,
            None => Model { name: "servo".to_string(), ..Model::default() },
        };
        let columns = joints_of(&mut set)?;
        let coordinates: Vec<String> = model.arm.iter().flat_map(|arm| arm.tree.coordinates()).map(|c| c.name.clone()).collect();
        if let (Some(_), Some(odd)) = (&model.arm, columns.iter().find(|j| !coordinates.contains(&j.name))) {
            let file = set.folder.join("set.toml").display().to_string();
            return Err(ServoError::wrong(
                file,
                format!("[joints.{}]: the robot has no such moving joint; it has {}", odd.name, coordinates.join(", ")),
            ));
        }
        let read =
            |files: &[String]| -> Result<Vec<Recording>, ServoError> { files.iter().map(|f| read_file(&set, f, &columns)).collect() };
        let (fit, held_out) = (read(&set.fit)?, read(&set.held_out)?);
        let all_there = !coordinates.is_empty() && coordinates.iter().all(|c| columns.iter().any(|j| j.name == *c));
        let mut notes = Vec::new();
        if model.arm.is_some() && !all_there {
            let missing: Vec<&str> = coordinates.iter().filter(|c| columns.iter().all(|j| j.name != **c)).map(String::as_str).collect();
            notes.push(format!(
                "no position of {} is named, so the torque of gravity is unknown, and droop is fitted as a sine of each joint's own angle",
                missing.join(", ")
            ));
        }
        let joints = columns
            .par_iter()
            .map(|joint| {
                let records = |all: &[Recording], names: &[String]| -> Result<Vec<Record>, ServoError> {
                    all.iter().zip(names).map(|(r, name)| record_of(r, name, joint, &model, all_there)).collect()
                };
                Ok(Joint {
                    name: joint.name.clone(),
                    fit: records(&fit, &set.fit)?,
                    held_out: records(&held_out, &set.held_out)?,
                    given: model.servos.iter().find(|s| s.joint == joint.name).map(|s| s.numbers),
                    is_weighed: all_there,
                })
            })
            .collect::<Result<Vec<Joint>, ServoError>>()?;
        Ok(Problem { model, joints, notes })
    }
}

fn record_of(recording: &Recording, name: &str, joint: &JointColumns, model: &Model, weighed: bool) -> Result<Record, ServoError> {
    let column = |signal: String| recording.need_signal(&signal).map(<[f64]>::to_vec);
    let gravity = match &model.arm {
        Some(arm) if weighed => {
            let names: Vec<&str> = arm.tree.coordinates().iter().map(|c| c.name.as_str()).collect();
            let positions = names.iter().map(|n| column(format!("{n}.position"))).collect::<Result<Vec<_>, _>>()?;
            let views: Vec<&[f64]> = positions.iter().map(Vec::as_slice).collect();
            let own = names.iter().position(|n| *n == joint.name).unwrap_or(0);
            gravity::columns(&arm.tree, &views, own)
        }
        _ => Vec::new(),
    };
    Ok(Record {
        name: name.to_string(),
        t: recording.t.clone(),
        command: column(joint.command())?,
        position: column(joint.position())?,
        gravity,
    })
}

/// Where each joint stands: from the set, else by headings such as `NAME.command` and `NAME.position`.
fn joints_of(set: &mut RecordingSet) -> Result<Vec<JointColumns>, ServoError> {
    let file = set.folder.join("set.toml").display().to_string();
    if !set.joints.is_empty() {
        if let Some(without) = set.joints.iter().find(|j| !j.has_command) {
            return Err(ServoError::wrong(
                file,
                format!("[joints.{}] has no command, but others have: add command = \"HEADING\", or leave the joint out", without.name),
            ));
        }
        return Ok(set.joints.clone());
    }
    let first = set.fit.iter().chain(&set.held_out).next().cloned().unwrap_or_default();
    let mut columns = Columns::new();
    if set.is_bag(&first) {
        let field = |axis: usize| format!("position[{axis}]");
        let joints: Vec<JointColumns> = device_joints(set, &first)
            .into_iter()
            .map(|(name, command, position, axis)| {
                let joint = JointColumns::of_servo(&name, &command, &position, &mut Columns::new());
                for (signal, topic) in [(joint.command(), command), (joint.position(), position)] {
                    columns.push((signal, ColumnRule::of(Source::Topic { topic, field: field(axis) })));
                }
                joint
            })
            .collect();
        if !joints.is_empty() {
            set.columns.extend(columns);
            return Ok(joints);
        }
    }
    let headings = names_in(set, &first)?;
    let plain: Vec<&str> = headings.iter().map(|h| split(h).0).collect();
    let joints =
        pairs(&plain).iter().map(|(name, command, position)| JointColumns::of_servo(name, command, position, &mut columns)).collect();
    set.columns.extend(columns);
    let usual = plain.iter().find(|h| ["time", "time_s", "timestamp"].contains(h));
    if let Some(time) = usual.filter(|_| !set.columns.iter().any(|c| c.0 == "t") && !plain.contains(&"t")) {
        set.columns.push(("t".to_string(), ColumnRule::of(Source::Column((*time).to_string()))));
    }
    Ok(joints)
}

fn read_file(set: &RecordingSet, file: &str, joints: &[JointColumns]) -> Result<Recording, ServoError> {
    let signals: Vec<String> = joints.iter().flat_map(|j| [j.command(), j.position()]).collect();
    let names: Vec<&str> = signals.iter().map(String::as_str).collect();
    let piece = set.rules_of(file).piece;
    let recording = match set.is_bag(file) {
        false => set.table(file).read(Some(&names), &set.columns, &piece)?,
        true => recording(&Reader::open(&set.path_of(file))?, Some(&names), &set.columns, &piece, &|_| Hold::Zero)?,
    };
    let odd =
        recording.units.iter().find(|(name, unit)| names.contains(&name.as_str()) && !matches!(unit.kind, Kind::Angle | Kind::Length));
    if let Some((signal, unit)) = odd {
        let what = if matches!(unit.kind, Kind::AngularSpeed | Kind::Speed) {
            "a goal velocity is not a position command"
        } else {
            "expected an angle or a length"
        };
        return Err(ServoError::wrong(
            file,
            format!("\"{signal}\" is in {}: {what}; name the column of the position in [joints]", unit.name),
        ));
    }
    Ok(recording)
}
