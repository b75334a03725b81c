//! A bag without some of its topics: those that were not measured, or are to be hidden.

use crate::{BagError, BagHeader, Reader, Recorder, RecorderOptions, WhenFull};
use std::path::Path;

/// Copies a bag of ours to a new file except for the topics that `leave_out` names; `change` may remove the same information from the header. The
/// copy has a verdict of its own about what it holds. The number of messages in it.
///
/// # Errors
/// `from` cannot be read or is no bag of ours, `to` exists or cannot be written.
pub fn without(from: &Path, to: &Path, leave_out: &dyn Fn(&str) -> bool, change: &dyn Fn(&mut BagHeader)) -> Result<u64, BagError> {
    let reader = Reader::open(from)?;
    let Some(header) = reader.header() else {
        let what = "is not there, so the bag is none of a run".to_string();
        return Err(BagError::Metadata { path: from.to_owned(), record: crate::header::RUN, key: "topics", what });
    };
    let mut header = header.clone();
    header.topics.retain(|info| !leave_out(&info.topic.name));
    change(&mut header);
    let options = RecorderOptions { when_full: WhenFull::Wait, whole: true, ..RecorderOptions::default() };
    let mut recorder = Recorder::create(to, &header, &options)?;
    let mut count = 0;
    for entry in reader.messages()? {
        let entry = entry?;
        let Some(topic) = header.topic(&entry.topic.name) else { continue };
        if let Some(message) = entry.message(from)? {
            recorder.push(topic, message, entry.log_time_ns as i64)?;
            count += 1;
        }
    }
    recorder.finish()?;
    Ok(count)
}
