//! A file of a rosbag2 in sqlite3.

use super::definitions;
use super::target::{Form, Target};
use crate::BagError;
use rusqlite::{Connection, OpenFlags};
use std::collections::HashMap;
use std::path::Path;

/// Copies the messages of a file, in the order of their times.
pub(crate) fn copy(file: &Path, target: &mut Target) -> Result<(), BagError> {
    let wrong = |what: String| BagError::File { path: file.to_owned(), what };
    let failed = |error: rusqlite::Error| wrong(format!("cannot be read as a rosbag2: {error}"));
    backdrive_plant::input_file::open(file).map_err(BagError::io(file))?;
    let database = Connection::open_with_flags(file, OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX).map_err(failed)?;
    let definitions = definitions_of(&database);
    let mut topics = HashMap::new();
    let mut query =
        database.prepare("SELECT id, name, type, serialization_format, offered_qos_profiles FROM topics ORDER BY id").or_else(|_| {
            // Before ROS 2 Foxy there was no quality of service.
            database.prepare("SELECT id, name, type, serialization_format, '' FROM topics ORDER BY id")
        });
    let query = query.as_mut().map_err(|error| wrong(format!("is not a rosbag2: {error}")))?;
    let mut rows = query.query([]).map_err(failed)?;
    while let Some(row) = rows.next().map_err(failed)? {
        let text = |column: usize| row.get::<_, Option<String>>(column).map(Option::unwrap_or_default).map_err(failed);
        let (id, name, type_name, encoding, qos) = (row.get::<_, i64>(0).map_err(failed)?, text(1)?, text(2)?, text(3)?, text(4)?);
        // ROS 2 Crystal left /msg/ out.
        let type_name = if type_name.contains("/msg/") { type_name } else { type_name.replacen('/', "/msg/", 1) };
        let known = definitions.get(&type_name).cloned().or_else(|| definitions::of(&type_name));
        let note = match &known {
            Some(_) if encoding == "cdr" => None,
            Some(_) => Some(format!("its messages are in the form {encoding:?}, which is not decoded; they are kept unchanged")),
            None => Some(format!("the bag has no definition of {type_name}, so it is not decoded; its messages are kept unchanged")),
        };
        let schema_encoding = if known.is_some() { "ros2msg" } else { "" };
        let definition = known.unwrap_or_default();
        let form = Form { type_name: &type_name, schema_encoding, definition: &definition, encoding: &encoding, qos: &qos };
        topics.insert(id, target.topic(&name, &form, note)?);
    }
    let mut query = database.prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp, id").map_err(failed)?;
    let mut rows = query.query([]).map_err(failed)?;
    while let Some(row) = rows.next().map_err(failed)? {
        let (id, time) = (row.get::<_, i64>(0).map_err(failed)?, row.get::<_, i64>(1).map_err(failed)?);
        let topic = topics.get(&id).ok_or_else(|| wrong(format!("a message at {time} ns is of the topic {id}, which there is none of")))?;
        let data = row.get_ref(2).map_err(failed)?;
        let data = data.as_blob().map_err(|_| wrong(format!("a message at {time} ns holds no bytes")))?;
        target.push(*topic, time, data)?;
    }
    Ok(())
}

/// The bag's own definitions of its types; since ROS 2 Iron.
fn definitions_of(database: &Connection) -> HashMap<String, String> {
    let read = || -> rusqlite::Result<HashMap<String, String>> {
        let mut query =
            database.prepare("SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'")?;
        let pairs = query.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
        pairs.collect()
    };
    let mut found = read().unwrap_or_default();
    found.retain(|_, definition: &mut String| !definition.trim().is_empty());
    found
}
