//! A bag's records of the clocks of several hosts.

use std::fmt;

/// Kind of the events that hold it; their text is a [`ClockOffset`].
pub const CLOCK_OFFSET: &str = "clock_offset";

/// Wall clock of one host against another's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClockOffset {
    /// Whose clock.
    pub of: String,
    /// Against whose.
    pub against: String,
    /// By how much it is ahead, ns.
    pub offset_ns: i64,
    /// How wrong that may be, ns.
    pub uncertainty_ns: i64,
    /// The shortest round trip, on one clock, ns.
    pub round_trip_ns: i64,
}

impl ClockOffset {
    /// By how much it is ahead, s.
    pub fn offset_s(&self) -> f64 {
        self.offset_ns as f64 * 1e-9
    }

    /// Reads the text of an event of kind [`CLOCK_OFFSET`].
    pub fn parse(text: &str) -> Option<ClockOffset> {
        let find = |key: &str| text.split_ascii_whitespace().find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
        Some(ClockOffset {
            of: find("of")?.to_string(),
            against: find("against")?.to_string(),
            offset_ns: find("offset_ns")?.parse().ok()?,
            uncertainty_ns: find("uncertainty_ns")?.parse().ok()?,
            round_trip_ns: find("round_trip_ns")?.parse().ok()?,
        })
    }
}

impl fmt::Display for ClockOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ClockOffset { of, against, offset_ns, uncertainty_ns, round_trip_ns } = self;
        write!(f, "of={of} against={against} offset_ns={offset_ns} uncertainty_ns={uncertainty_ns} round_trip_ns={round_trip_ns}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_text_is_read_back() {
        let offset = ClockOffset { of: "robot".into(), against: "desk".into(), offset_ns: -12, uncertainty_ns: 34, round_trip_ns: 56 };
        assert_eq!(ClockOffset::parse(&offset.to_string()), Some(offset));
        assert_eq!(ClockOffset::parse("of=robot"), None);
    }
}
