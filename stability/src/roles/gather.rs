//! The wanted signals, read from the bags in one pass.

use super::file::{Located, Roles, is_required};
use crate::grid::Series;
use crate::rosbag::mcap_files;
use crate::signal_role::{SessionError, SignalRole};
use backdrive_bags::{FieldPath, Reader, Schema};
use backdrive_plant::tomlfile::unknown;
use std::collections::HashMap;
use std::path::Path;

/// How the wanted fields of a topic are read.
struct Plan {
    schema: Schema,
    /// Where its messages say when they were made, if they do.
    stamp: Option<FieldPath>,
    fields: Vec<(usize, FieldPath)>,
    /// The joints of the first message, where a field is one of them by its place.
    joints: Option<Vec<String>>,
}

impl Plan {
    /// A place is that of one joint only as long as the messages have the same joints in the same order.
    fn check_joints(&mut self, payload: &[u8]) -> Result<(), String> {
        let Some(before) = &mut self.joints else { return Ok(()) };
        let joints = self.schema.joint_names(payload)?;
        if before.is_empty() {
            *before = joints;
        } else if !joints.is_empty() && joints != *before {
            let first = before.first().map_or("", String::as_str);
            let what = format!("has the joints {}, messages before it {}", joints.join(", "), before.join(", "));
            return Err(format!("{what}: name them in place of numbers, as in position[{first}]"));
        }
        Ok(())
    }
}

/// Reads every wanted signal in one pass over each file.
pub(super) fn gather(path: &Path, roles: &Roles, wanted: &[(SignalRole, &Located)]) -> Result<(Vec<Series>, bool), SessionError> {
    let mut closed = true;
    if let Some((_, located)) = wanted.iter().find(|(_, l)| l.signal.topic.is_empty()) {
        let what = format!("{} is the column of a table, but {} is none: name \"TOPIC.FIELD\"", located.place(), path.display());
        return Err(roles.at(located, what));
    }
    let mut series: Vec<Series> = wanted.iter().map(|_| Series { stamped: true, ..Series::default() }).collect();
    let mut available: Vec<String> = Vec::new();
    let mut seen = vec![false; wanted.len()];
    for file in mcap_files(path)? {
        let reader = Reader::open(&file)?;
        closed &= reader.ended_cleanly();
        available.extend(reader.topics().iter().map(|t| t.name.clone()));
        let mut plans = plan(&reader, roles, wanted, &mut seen)?;
        for entry in reader.messages()? {
            let entry = entry?;
            let Some(plan) = plans.get_mut(&entry.topic.index) else { continue };
            let first = plan.fields.first().and_then(|(place, _)| wanted.get(*place));
            let damaged = |what: String| match first {
                Some((_, located)) => roles.at(located, format!("{}, byte {}: {what}", file.display(), entry.offset)),
                None => SessionError::Rows { path: file.clone(), what },
            };
            plan.check_joints(&entry.payload).map_err(&damaged)?;
            let read = |field: &FieldPath| plan.schema.read(field, &entry.payload).map_err(&damaged);
            let logged = entry.log_time_ns as i64;
            let stamp = plan.stamp.as_ref().map(|path| plan.schema.read_time_ns(path, &entry.payload)).transpose().map_err(&damaged)?;
            // A stamp that was not filled in is 0.
            let stamp = stamp.flatten().filter(|ns| *ns != 0);
            for (place, field) in &plan.fields {
                // A message without the named joint has no value for it.
                let value = match read(field)? {
                    None if field.is_by_name() => continue,
                    value => value.unwrap_or(f64::NAN),
                };
                let (Some(series), Some((_, located))) = (series.get_mut(*place), wanted.get(*place)) else { continue };
                series.stamped &= stamp.is_some();
                series.stamps.push(stamp.unwrap_or(logged));
                series.logged.push(logged);
                series.values.push(located.signal.scale * value + located.signal.offset);
            }
        }
    }
    available.sort();
    available.dedup();
    for (((role, located), series), seen) in wanted.iter().zip(&mut series).zip(&seen) {
        let topic = &located.signal.topic;
        if !seen {
            let what = unknown("topic", topic, available.iter().map(String::as_str));
            return Err(roles.at(located, format!("{what}; the bag has {}", available.join(", "))));
        }
        if series.values.is_empty() && is_required(*role) {
            return Err(roles.at(located, format!("{topic} has no message; without it {}", role.without())));
        }
        // Stamps of some messages only would mix two clocks.
        if !series.stamped {
            series.stamps.clone_from(&series.logged);
        }
    }
    Ok((series, closed))
}

fn plan(
    reader: &Reader,
    roles: &Roles,
    wanted: &[(SignalRole, &Located)],
    seen: &mut [bool],
) -> Result<HashMap<usize, Plan>, SessionError> {
    let mut plans: HashMap<usize, Plan> = HashMap::new();
    for (place, (_, located)) in wanted.iter().enumerate() {
        let Some(topic) = reader.topics().iter().find(|t| t.name == located.signal.topic) else { continue };
        if let Some(seen) = seen.get_mut(place) {
            *seen = true;
        }
        let plan = match plans.entry(topic.index) {
            std::collections::hash_map::Entry::Occupied(plan) => plan.into_mut(),
            std::collections::hash_map::Entry::Vacant(vacant) => {
                let schema = topic.parse_schema().map_err(|e| roles.at(located, e.to_string()))?;
                vacant.insert(Plan { stamp: schema.stamp(), schema, fields: Vec::new(), joints: None })
            }
        };
        let field = plan.schema.find(&located.signal.field);
        let field = field.map_err(|what| roles.at(located, format!("{} ({}): {what}", topic.name, topic.type_name)))?;
        // Where the bag states the axes, they are the same in every message.
        if topic.axes.is_empty() && field.is_by_place() {
            plan.joints.get_or_insert_default();
        }
        plan.fields.push((place, field));
    }
    Ok(plans)
}
