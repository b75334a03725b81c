//! From when to when a topic speaks: beside the bag's statistics, so that it is known without its messages.

use mcap::records::Metadata;
use std::collections::BTreeMap;

/// Name of the metadata record: for each channel number `FIRST LAST`, log times in ns; and the byte at which it stands.
pub(crate) const SPANS: &str = "backdrive.times";

/// Key of the byte at which the record stands.
const AT: &str = "at";

/// Least and greatest log time by channel, ns.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Spans(pub(crate) BTreeMap<u16, (u64, u64)>);

impl Spans {
    pub(crate) fn see(&mut self, channel: u16, log_time: u64) {
        let span = self.0.entry(channel).or_insert((log_time, log_time));
        *span = (span.0.min(log_time), span.1.max(log_time));
    }

    /// As a record that stands at byte `at`: a program that writes the bag again puts it somewhere else, which shows that the rest may have changed too.
    pub(crate) fn to_metadata(&self, at: u64) -> Metadata {
        let spans = self.0.iter().map(|(channel, (first, last))| (channel.to_string(), format!("{first} {last}")));
        Metadata { name: SPANS.to_owned(), metadata: spans.chain([(AT.to_owned(), at.to_string())]).collect() }
    }

    /// Whether a record that was found at byte `at` stands where its writer put it. Those of earlier versions do not say.
    pub(crate) fn are_in_place(record: &Metadata, at: u64) -> bool {
        record.metadata.get(AT).is_none_or(|text| *text == at.to_string())
    }

    /// `None` where it cannot be read.
    pub(crate) fn from_metadata(record: &Metadata) -> Option<Spans> {
        let span = |text: &String| text.split_once(' ').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
        let found = record.metadata.iter().filter(|(key, _)| *key != AT).map(|(channel, text)| Some((channel.parse().ok()?, span(text)?)));
        found.collect::<Option<_>>().map(Spans)
    }
}
