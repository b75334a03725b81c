//! What was refused on a topic: how often, of whom first, and when it is reported.

use super::identity::{Run, Why};
use crate::transport::TransportError;
use backdrive_msgs::topic::{Kind, Topic};
use rustdds::GUID;
use std::time::{Duration, Instant};

/// How often it is reported again.
const AGAIN: Duration = Duration::from_secs(1);

/// Of a run on several hosts a name that is not known may be that of a host that has just begun: this long it is only refused.
const BEGINS: Duration = Duration::from_secs(2);

/// What was refused on a topic.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    count: u64,
    said: u64,
    /// The first that is not reported yet: who sent it, and what was wrong with it.
    first: Option<(Option<GUID>, Why)>,
    /// A run that may be of a host that has just begun, and since when.
    unknown: Option<(Run, Instant)>,
    /// Whether there was one that cannot be.
    certain: bool,
    said_at: Option<Instant>,
}

impl Refusals {
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Another one. `several`: who is unknown may be a host that has just begun.
    pub fn add(&mut self, from: Option<GUID>, why: Why, several: bool) {
        self.count += 1;
        self.first.get_or_insert((from, why));
        let is_certain = match why {
            Why::Unknown(run) if several => {
                let (_, since) = *self.unknown.insert(self.unknown.filter(|(r, _)| *r == run).unwrap_or((run, Instant::now())));
                since.elapsed() >= BEGINS
            }
            _ => true,
        };
        if is_certain && !self.certain {
            (self.certain, self.first) = (true, Some((from, why)));
        }
    }

    /// Before the start: hosts are still being found, and what was not certain is forgotten.
    pub fn forgive(&mut self) {
        if !self.certain {
            (self.first, self.unknown, self.said) = (None, None, self.count);
        }
    }

    /// What there is to say now.
    pub fn complaint(&mut self, topic: &Topic) -> Option<TransportError> {
        let is_due = self.count > self.said && self.said_at.is_none_or(|at| at.elapsed() >= AGAIN);
        let (from, why) = self.first.filter(|_| is_due && self.certain)?;
        (self.said, self.said_at, self.first) = (self.count, Some(Instant::now()), None);
        Some(TransportError::Stranger {
            topic: topic.name.clone(),
            who: who(from, why),
            refused: self.count,
            // Health and events move nothing.
            moves: matches!(topic.kind, Kind::Sample | Kind::Gains),
        })
    }
}

/// Who it is, as far as it can be known: the name of a run is what its messages say, a GID is what `ros2 topic info --verbose` shows.
fn who(from: Option<GUID>, why: Why) -> String {
    let gid = from.map(|guid| {
        let bytes: Vec<String> = guid.to_bytes()[..12].iter().map(|b| format!("{b:02x}")).collect();
        format!(" (GID {})", bytes.join("."))
    });
    let gid = gid.unwrap_or_default();
    match why {
        Why::Unknown(run) => format!("run {run} sends on this topic too"),
        Why::Untagged => format!("a program outside the run sends on this topic{gid}"),
        Why::Forged => format!("a stranger forges tags{gid}"),
        Why::Replayed => format!("a stranger plays a recording{gid}"),
        Why::Unreadable => "a program outside the run sends on this topic, in an unknown encoding".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic() -> Topic {
        Topic { name: "/master/servo_jf".to_string(), kind: Kind::Sample }
    }

    #[test]
    fn a_stranger_is_said_once_a_second_with_the_count() {
        let mut refusals = Refusals::default();
        assert!(refusals.complaint(&topic()).is_none());
        for _ in 0..3 {
            refusals.add(Some(GUID::from_bytes([1; 16])), Why::Untagged, false);
        }
        let told = refusals.complaint(&topic()).unwrap().to_string();
        assert!(
            told.contains("/master/servo_jf: a program outside the run sends on this topic (GID 01.01.") && told.contains("refused: 3"),
            "{told}"
        );
        assert!(told.len() <= 128, "{} bytes: {told}", told.len());
        refusals.add(None, Why::Replayed, false);
        assert!(refusals.complaint(&topic()).is_none());
        assert_eq!(refusals.count(), 4);
    }

    #[test]
    fn a_host_that_has_just_begun_is_refused_and_not_accused() {
        let (mut refusals, unknown) = (Refusals::default(), Why::Unknown(Run::new("6925b1f2001a2b3c4d5e")));
        refusals.add(None, unknown, true);
        assert!(refusals.complaint(&topic()).is_none());
        refusals.forgive();
        assert_eq!(refusals.count(), 1);
        refusals.add(None, unknown, true);
        refusals.unknown = refusals.unknown.and_then(|(run, since)| Some((run, since.checked_sub(BEGINS)?)));
        refusals.add(None, unknown, true);
        let told = refusals.complaint(&topic()).unwrap().to_string();
        assert!(told.contains("run 6925b1f2001a2b3c4d5e sends on this topic too"), "{told}");
        // Somebody else is, at once.
        let mut refusals = Refusals::default();
        refusals.add(None, unknown, true);
        refusals.add(None, Why::Forged, true);
        assert!(refusals.complaint(&topic()).unwrap().to_string().contains("forges tags"));
        // And in a run on one host no host has just begun.
        let mut refusals = Refusals::default();
        refusals.add(None, unknown, false);
        assert!(refusals.complaint(&topic()).is_some());
    }
}
