//! Schemas and channels as they turn up.

use super::entry::TopicRef;
use crate::header::BagHeader;
use backdrive_msgs::ros;
use mcap::records::Record;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Schemas and channels as they turn up.
#[derive(Default)]
pub(crate) struct Channels {
    pub(crate) schemas: BTreeMap<u16, (String, String, Vec<u8>)>,
    pub(crate) channels: BTreeMap<u16, mcap::records::Channel>,
}

impl Channels {
    /// Takes notice of a schema or a channel; the first of a number counts.
    pub(crate) fn see(&mut self, record: Record) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.entry(header.id).or_insert_with(|| (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            _ => {}
        }
    }

    /// Whether a channel states which step samples are of.
    pub(crate) fn says_steps(&self, channel: &mcap::records::Channel) -> bool {
        channel.message_encoding == "cdr" && self.schemas.get(&channel.schema_id).is_some_and(|schema| schema.0 == ros::STEPS.0)
    }

    /// The channels that say which step samples are of.
    pub(crate) fn steps(&self) -> Vec<u16> {
        self.channels.values().filter(|channel| self.says_steps(channel)).map(|channel| channel.id).collect()
    }

    pub(super) fn topics(mut self, run: Option<&BagHeader>) -> Vec<Arc<TopicRef>> {
        for steps in self.steps() {
            self.channels.remove(&steps);
        }
        let place = |name: &str| run.and_then(|run| run.topic(name));
        let mut channels: Vec<_> = self.channels.into_values().collect();
        channels.sort_by_key(|channel| (place(&channel.topic).unwrap_or(usize::MAX), channel.id));
        let refer = |(index, channel): (usize, mcap::records::Channel)| {
            let (type_name, schema_encoding, schema) = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
            let axes = place(&channel.topic).and_then(|place| run.map(|run| run.topics[place].axes.clone())).unwrap_or_default();
            let kind = if channel.message_encoding == "cdr" { ros::kind_of(&type_name) } else { None };
            Arc::new(TopicRef {
                index,
                channel: channel.id,
                kind,
                type_name,
                encoding: channel.message_encoding,
                schema_encoding,
                schema,
                axes,
                name: channel.topic,
                metadata: channel.metadata,
            })
        };
        channels.into_iter().enumerate().map(refer).collect()
    }
}
