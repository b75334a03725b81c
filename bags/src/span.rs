//! From when to when a topic speaks: beside the bag's statistics, so that it is known without its messages.

use mcap::records::Metadata;
use std::collections::BTreeMap;

/// Name of the metadata record: for each channel number `FIRST LAST`, log times in ns.
pub(crate) const SPANS: &str = "backdrive.times";

/// Least and greatest log time by channel, ns.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Spans(pub(crate) BTreeMap<u16, (u64, u64)>);

impl Spans {
    pub(crate) fn see(&mut self, channel: u16, log_time: u64) {
        let span = self.0.entry(channel).or_insert((log_time, log_time));
        *span = (span.0.min(log_time), span.1.max(log_time));
    }

    pub(crate) fn to_metadata(&self) -> Metadata {
        let metadata = self.0.iter().map(|(channel, (first, last))| (channel.to_string(), format!("{first} {last}"))).collect();
        Metadata { name: SPANS.to_owned(), metadata }
    }

    /// `None` where it cannot be read.
    pub(crate) fn from_metadata(record: &Metadata) -> Option<Spans> {
        let span = |text: &String| text.split_once(' ').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
        let found = record.metadata.iter().map(|(channel, text)| Some((channel.parse().ok()?, span(text)?)));
        found.collect::<Option<_>>().map(Spans)
    }
}
