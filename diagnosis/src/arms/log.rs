//! Logs: position, perhaps velocity, and torque of every joint, at the times that were logged.

use crate::arms::error::ArmError;
use backdrive_bags::{BagError, Reader, recording, topic_of};
use backdrive_plant::model::Hold;
use backdrive_plant::recording::units::{Kind, split};
use backdrive_plant::recording::{Columns, JointColumns, Piece, Recording, Source};
use backdrive_plant::robot::{Coordinate, JointKind, Payload};
use backdrive_plant::set::RecordingSet;

/// A log in SI units, joints in the order of the robot's coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// The file, as the set names it.
    pub name: String,
    /// Times of the samples as they were logged, s; rising.
    pub t: Vec<f64>,
    /// Coordinates, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Rates from the drive, rad/s or m/s; `None` where they were not logged.
    pub velocity: Vec<Option<Vec<f64>>>,
    /// Torques or forces of the motors seen at the joints, N m or N.
    pub torque: Vec<Vec<f64>>,
    /// A known mass that the arm carried, with the index of the link that it hung on.
    pub payload: Option<(usize, Payload)>,
}

/// Where each joint is in the files: from the set, else by headings that are usual.
///
/// # Errors
/// Where the set names a joint that the robot does not have, leaves one out, or no usual heading is there.
pub fn joints_of(set: &mut RecordingSet, coordinates: &[Coordinate], first: &str) -> Result<Vec<JointColumns>, ArmError> {
    let names: Vec<&str> = coordinates.iter().map(|c| c.name.as_str()).collect();
    if !set.joints.is_empty() {
        let fault = |message: String| ArmError::Log { log: set.folder.join("set.toml").display().to_string(), message };
        if let Some(extra) = set.joints.iter().find(|j| !names.contains(&j.name.as_str())) {
            return Err(fault(format!("[joints.{}]: the robot has no such moving joint; it has {}", extra.name, names.join(", "))));
        }
        let of = |name: &&str| set.joints.iter().find(|j| j.name == **name).cloned();
        return names
            .iter()
            .map(|n| {
                let joint =
                    of(n).ok_or_else(|| fault(format!("does not describe joint \"{n}\": add [joints.{n}] with position and torque")))?;
                match joint.has_torque || joint.is_passive {
                    true => Ok(joint),
                    false => {
                        Err(fault(format!("[joints.{n}] has no torque, and other joints have: name the torque of all of them, or of none")))
                    }
                }
            })
            .collect();
    }
    if set.is_bag(first) {
        let (one, all) = (names.first().copied().unwrap_or("NAME"), names.join(", "));
        return Err(ArmError::Log {
            log: first.to_string(),
            message: format!(
                "is a bag: state in set.toml which topics hold each of {all}, such as [joints.{one}] position = {{ topic = \
                 \"/joint_states\", field = \"position[0]\" }}, torque = {{ topic = \"/joint_states\", field = \"effort[0]\" }}"
            ),
        });
    }
    let headings = set.table(first).headings()?;
    let plain: Vec<&str> = headings.iter().map(|h| split(h).0).collect();
    let mut found = Vec::new();
    let mut columns = Columns::new();
    for (index, name) in names.iter().enumerate() {
        let number = index + 1;
        let pick = |what: &[&str]| {
            let mut tried = Vec::new();
            for w in what {
                tried.extend([
                    format!("{name}.{w}"),
                    format!("{name}_{w}"),
                    format!("{w}_{name}"),
                    format!("{w}{number}"),
                    format!("{w}_{number}"),
                ]);
            }
            tried.into_iter().find(|t| plain.contains(&t.as_str()))
        };
        let position = pick(&["position", "pos", "q"]);
        let torque = pick(&["torque", "tau", "effort", "force"]);
        let velocity = pick(&["velocity", "vel", "dq", "qd"]);
        match (position, torque) {
            (Some(p), Some(t)) => found.push(JointColumns::of_headings(name, &p, velocity.as_deref(), &t, &mut columns)),
            (p, _) => {
                let what = if p.is_none() { "position" } else { "torque" };
                return Err(ArmError::Log {
                    log: first.to_string(),
                    message: format!(
                        "no column looks like the {what} of joint \"{name}\" (such as \"{name}.{what}\"); it has {}; state in set.toml \
                         which one: [joints.{name}] position = \"...\", torque = \"...\"",
                        headings.join(", ")
                    ),
                });
            }
        }
    }
    set.columns.extend(columns);
    let usual = plain.iter().find(|h| ["time", "time_s", "timestamp"].contains(h));
    if let Some(time) = usual.filter(|_| !set.columns.iter().any(|c| c.0 == "t") && !plain.contains(&"t")) {
        let rule = backdrive_plant::recording::ColumnRule::of(Source::Column((*time).to_string()));
        set.columns.push(("t".to_string(), rule));
    }
    Ok(found)
}

/// Reads a log of a set.
///
/// # Errors
/// Where the file cannot be read, a column, topic or field is missing, or a unit is none that the joint can have.
pub fn read_log(set: &RecordingSet, file: &str, joints: &[JointColumns], coordinates: &[Coordinate]) -> Result<Log, ArmError> {
    let recording = read_signals(set, file, joints)?;
    check_units(file, &recording, joints, coordinates)?;
    let column = |name: String| recording.need_signal(&name).map(<[f64]>::to_vec);
    let (mut position, mut velocity, mut torque) = (Vec::new(), Vec::new(), Vec::new());
    for joint in joints {
        position.push(column(joint.position())?);
        torque.push(if joint.is_passive { vec![0.0; recording.t.len()] } else { column(joint.torque())? });
        velocity.push(if joint.has_velocity { Some(column(joint.velocity())?) } else { None });
    }
    Ok(Log { name: file.to_string(), t: recording.t.clone(), position, velocity, torque, payload: None })
}

/// Reads the joints' signals of a file, CSV or bag; errors name the joint's key in the set.
fn read_signals(set: &RecordingSet, file: &str, joints: &[JointColumns]) -> Result<Recording, ArmError> {
    let signals: Vec<(String, String)> = joints.iter().flat_map(keys_of).collect();
    let names: Vec<&str> = signals.iter().map(|(signal, _)| signal.as_str()).collect();
    let piece: Piece = set.rules_of(file).piece;
    if !set.is_bag(file) {
        return Ok(set.table(file).read(Some(&names), &set.columns, &piece).map_err(|mut e| {
            for (signal, key) in &signals {
                e.key = e.key.replace(&format!("[columns] {signal}"), key);
                e.message = e.message.replace(&format!("[columns] takes \"{signal}\""), &format!("{key} is taken"));
            }
            e
        })?);
    }
    let reader = Reader::open_begun(&set.path_of(file)).map_err(|e| ArmError::Bag(e.to_string()))?;
    recording(&reader, Some(&names), &set.columns, &piece, &|_| Hold::Linear).map_err(|e| {
        let of = |wanted: &str, part: Option<&str>| {
            let is_there = |signal: &str| {
                let rule = set.columns.iter().find(|(name, _)| name == signal).map(|(_, rule)| &rule.source);
                match rule {
                    Some(Source::Topic { topic, field }) => topic == wanted && part.is_none_or(|p| p == field),
                    Some(Source::Column(heading)) => topic_of(heading) == wanted,
                    None => false,
                }
            };
            signals.iter().find(|(signal, _)| is_there(signal)).map(|(_, key)| key.clone())
        };
        let key = match &e {
            BagError::NoTopic { topic, .. } => of(topic, None),
            BagError::Field { topic, field, .. } => of(topic, Some(field)),
            _ => None,
        };
        match key {
            Some(key) => ArmError::Log { log: file.to_string(), message: format!("{key}: {e}") },
            None => ArmError::Bag(e.to_string()),
        }
    })
}

/// Names of a joint's signals, and the keys of the set that say where they stand.
fn keys_of(joint: &JointColumns) -> Vec<(String, String)> {
    let of_torque = if joint.torque_constant.is_some() { "current" } else { "torque" };
    let key = |what: &str| format!("[joints.{}] {what}", joint.name);
    let mut out = vec![(joint.position(), key("position"))];
    if !joint.is_passive {
        out.push((joint.torque(), key(of_torque)));
    }
    if joint.has_velocity {
        out.push((joint.velocity(), key("velocity")));
    }
    out
}

fn check_units(file: &str, recording: &Recording, joints: &[JointColumns], coordinates: &[Coordinate]) -> Result<(), ArmError> {
    for (joint, coordinate) in joints.iter().zip(coordinates) {
        let slides = coordinate.kind == JointKind::Prismatic;
        let pick = |turning: Kind, sliding: Kind| if slides { sliding } else { turning };
        let expected = [
            (joint.position(), pick(Kind::Angle, Kind::Length)),
            (joint.velocity(), pick(Kind::AngularSpeed, Kind::Speed)),
            (joint.torque(), pick(Kind::Torque, Kind::Force)),
        ];
        for (signal, kind) in expected {
            let Some((_, unit)) = recording.units.iter().find(|(name, unit)| *name == signal && unit.kind != kind) else { continue };
            let message = format!(
                "\"{signal}\" is in {}, {}; expected {}: name another column or unit, or set scale in [joints.{}]",
                unit.name,
                unit.kind.text(),
                kind.text(),
                joint.name
            );
            return Err(ArmError::Log { log: file.to_string(), message });
        }
    }
    Ok(())
}
