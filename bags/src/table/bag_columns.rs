//! Which columns a table of a bag has.

use super::mapping::{Quantity, topic_of};
use crate::header::Clock;
use crate::signals::TIME_TOPIC;
use crate::{BagError, Reader, Signal};
use backdrive_msgs::{MAX_AXES, Message};
use backdrive_plant::model::Hold;

/// The signals of all topics that have numbers: those of ours that were measured at least once, of others every number.
///
/// # Errors
/// When the bag cannot be read.
pub fn columns_of(reader: &Reader, topics: Option<&[String]>) -> Result<Vec<Signal>, BagError> {
    let listed = |name: &str| topics.is_none_or(|topics| topics.iter().any(|topic| topic == name));
    let count = reader.topics().len();
    let mut measured = vec![[[false; MAX_AXES]; 3]; count];
    let mut foreign: Vec<Option<Vec<String>>> = vec![None; count];
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
            None if foreign[index].is_none() => {
                let numbers = entry.topic.parse_schema().ok().and_then(|schema| schema.numbers(&entry.payload).ok());
                foreign[index] = Some(numbers.unwrap_or_default());
            }
            None => {}
        }
    }
    let mut wanted = Vec::new();
    for topic in reader.topics() {
        for (quantity, seen) in Quantity::ALL.iter().zip(&measured[topic.index]) {
            for axis in (0..MAX_AXES).filter(|axis| seen[*axis]) {
                let name = topic.axes.get(axis).cloned().unwrap_or_else(|| format!("axis{axis}"));
                let field = format!("{}[{axis}]", quantity.field());
                // A column that was imported is called as it was in its table.
                let own = was_table(reader) && axis == 0 && *quantity == Quantity::Position && topic.name == topic_of(&name);
                let shown = if own { name } else { format!("{}.{}.{name}", topic.name, quantity.field()) };
                wanted.push(Signal::new(&shown, &topic.name, &field));
            }
        }
        for field in ["mu", "lambda"].iter().filter(|_| gains[topic.index]) {
            wanted.push(Signal { hold: Hold::Zero, ..Signal::new(&format!("{}.{field}", topic.name), &topic.name, field) });
        }
        for field in foreign[topic.index].iter().flatten().filter(|field| !field.starts_with("header.")) {
            wanted.push(Signal::new(&format!("{}.{field}", topic.name), &topic.name, field));
        }
    }
    Ok(wanted)
}

/// Whether a bag was made of a table.
pub(crate) fn was_table(reader: &Reader) -> bool {
    reader.header().is_some_and(|header| header.clock == Clock::Imported)
}
