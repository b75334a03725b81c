//! A recording in windows of a fixed number of steps, one after the other, so that memory does not grow with its length.

use super::recorded::Recorded;
use backdrive_bags::{BagError, Reader};
use backdrive_msgs::{Gains, Message};

/// One window.
pub(crate) struct Window {
    /// Step of the recording's first row.
    pub(crate) origin: u64,
    /// Its samples; `first` is the step of its own first row.
    pub(crate) recorded: Recorded,
    /// Gains that were in force, by topic, read so far.
    pub(crate) gains: Vec<(String, Gains)>,
}

/// A step that lies farther ahead than this many times the messages read so far is no step of this recording.
const FARTHEST: u64 = 4;

/// Hands each window of `most` steps to `look`, in order. The last one has up to half as many again: a short remainder shows little by itself. Messages that
/// come up to half a window late are in their place; later ones are missing there, which is a gap.
///
/// # Errors
/// The bag cannot be read.
pub(crate) fn in_windows(reader: &Reader, most: u64, mut look: impl FnMut(&Window)) -> Result<(), BagError> {
    let mut window = Window { origin: 0, recorded: Recorded::default(), gains: Vec::new() };
    // Where the track of each topic is.
    let mut places: Vec<Option<usize>> = vec![None; reader.topics().len()];
    let mut samples = 0_u64;
    for entry in reader.messages()? {
        let entry = entry?;
        match entry.message(reader.path())? {
            Some(Message::Sample(sample)) => {
                if samples == 0 {
                    (window.origin, window.recorded.first) = (sample.step, sample.step);
                }
                samples += 1;
                if sample.step.saturating_sub(window.origin) > FARTHEST * samples + most {
                    continue;
                }
                while sample.step.saturating_sub(window.recorded.first) >= most + most / 2 {
                    let rest = window.recorded.split_off(most as usize);
                    look(&window);
                    window.recorded = rest;
                }
                window.recorded.put(&mut places, entry.topic.index, &entry.topic.name, &sample);
            }
            Some(Message::Gains(gains)) => window.gains.push((entry.topic.name.clone(), gains)),
            _ => {}
        }
    }
    window.recorded.level();
    if samples > 0 {
        look(&window);
    }
    Ok(())
}
