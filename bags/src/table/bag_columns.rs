//! Which columns a table of a bag has.

use super::mapping::{Quantity, topic_of};
use crate::cdr::Schema;
use crate::header::Clock;
use crate::signals::TIME_TOPIC;
use crate::{BagError, Reader, Signal};
use backdrive_msgs::{MAX_AXES, Message};
use backdrive_plant::model::Hold;
use std::collections::BTreeSet;

/// The signals of all topics that have numbers: those of ours that were measured at least once, of others every number.
///
/// # Errors
/// When the bag cannot be read.
pub fn columns_of(reader: &Reader, topics: Option<&[String]>) -> Result<Vec<Signal>, BagError> {
    let listed = |name: &str| topics.is_none_or(|topics| topics.iter().any(|topic| topic == name));
    let count = reader.topics().len();
    let mut measured = vec![[[false; MAX_AXES]; 3]; count];
    let mut foreign: Vec<Option<Foreign>> = vec![None; count];
    let mut gains = vec![false; count];
    for entry in reader.messages()? {
        let entry = entry?;
        let index = entry.topic.index;
        if !listed(&entry.topic.name) || entry.topic.name == TIME_TOPIC {
            continue;
        }
        match entry.message(reader.path())? {
            Some(Message::Sample(sample)) => {
                for (seen, values) in measured[index].iter_mut().zip([&sample.position, &sample.velocity, &sample.effort]) {
                    seen.iter_mut().zip(values).for_each(|(seen, value)| *seen |= !value.is_nan());
                }
            }
            Some(Message::Gains(_)) => gains[index] = true,
            Some(Message::Event(_) | Message::Status(_) | Message::Margin(_)) => {}
            // A topic whose fields cannot be read has no columns.
            None => foreign[index].get_or_insert_with(|| Foreign::new(entry.topic.parse_schema().ok())).see(&entry.payload),
        }
    }
    let mut wanted = Vec::new();
    for topic in reader.topics() {
        for (quantity, seen) in Quantity::ALL.iter().zip(&measured[topic.index]) {
            for axis in (0..MAX_AXES).filter(|axis| seen[*axis]) {
                let name = topic.axes.get(axis).cloned().unwrap_or_else(|| format!("axis{axis}"));
                let field = format!("{}[{axis}]", quantity.field());
                // An imported column has the name that it had in its table.
                let own = was_table(reader) && axis == 0 && *quantity == Quantity::Position && topic.name == topic_of(&name);
                let shown = if own { name } else { format!("{}.{}.{name}", topic.name, quantity.field()) };
                wanted.push(Signal::new(&shown, &topic.name, &field));
            }
        }
        for field in ["mu", "lambda"].iter().filter(|_| gains[topic.index]) {
            wanted.push(Signal { hold: Hold::Zero, ..Signal::new(&format!("{}.{field}", topic.name), &topic.name, field) });
        }
        for field in foreign[topic.index].iter().flat_map(Foreign::fields) {
            wanted.push(Signal::new(&format!("{}.{field}", topic.name), &topic.name, &field));
        }
    }
    Ok(wanted)
}

/// The numbers of somebody else's topic, as its messages show them.
#[derive(Debug, Clone, Default)]
struct Foreign {
    schema: Option<Schema>,
    /// Sizes of messages that were looked at: those of another size may have longer lists.
    sizes: BTreeSet<usize>,
    numbers: Vec<String>,
    /// Joints of all messages, and whether some message has others, or in other places, than the first.
    joints: Vec<String>,
    first: Vec<String>,
    changes: bool,
}

/// Messages of this number of sizes are examined; text in them makes every one of another size.
const MOST_SIZES: usize = 64;

impl Foreign {
    fn new(schema: Option<Schema>) -> Foreign {
        Foreign { schema, ..Foreign::default() }
    }

    fn see(&mut self, payload: &[u8]) {
        let Some(schema) = &self.schema else { return };
        if self.sizes.len() < MOST_SIZES && self.sizes.insert(payload.len()) {
            let found = schema.numbers(payload).unwrap_or_default();
            let new: Vec<String> = found.into_iter().filter(|field| !self.numbers.contains(field)).collect();
            self.numbers.extend(new);
        }
        if schema.name_list().is_none() {
            return;
        }
        let joints = schema.joint_names(payload).unwrap_or_default();
        if self.first.is_empty() {
            self.first.clone_from(&joints);
        }
        if joints != self.first {
            self.changes |= !joints.is_empty();
        } else if !self.joints.is_empty() {
            return;
        }
        let new: Vec<String> = joints.into_iter().filter(|joint| !self.joints.contains(joint)).collect();
        self.joints.extend(new);
    }

    /// Its fields; entries of lists by the names of the joints, where their places change.
    fn fields(&self) -> Vec<String> {
        // What stands before and behind a place in a list of joints, such as `joints[` and `].position`.
        let around = |field: &String| {
            let (list, rest) = field.split_once('[').filter(|(list, _)| self.changes && !list.contains('.'))?;
            Some((list.to_owned(), rest.split_once(']')?.1.to_owned()))
        };
        // When a message was made is no signal.
        let stamp = self.schema.as_ref().and_then(Schema::stamp).map(|path| format!("{path}."));
        let is_stamp =
            |field: &String| field.starts_with("header.") || stamp.as_ref().is_some_and(|stamp| field.starts_with(stamp.as_str()));
        let mut fields: Vec<String> = Vec::new();
        let mut known: BTreeSet<(String, String)> = BTreeSet::new();
        for field in self.numbers.iter().filter(|field| !is_stamp(field)) {
            match around(field) {
                None => fields.push(field.clone()),
                Some((list, behind)) => {
                    if known.insert((list.clone(), behind.clone())) {
                        fields.extend(self.joints.iter().map(|joint| format!("{list}[{joint}]{behind}")));
                    }
                }
            }
        }
        fields
    }
}

/// Whether a bag was made of a table.
pub(crate) fn was_table(reader: &Reader) -> bool {
    reader.header().is_some_and(|header| header.clock == Clock::Imported)
}
