//! The text of a JointState on the wire: what its type has no field for.

use super::mark::Mark;
use super::time::Time;
use crate::Sample;
use std::io::Write;

/// The text, on the stack.
pub(super) struct FrameId {
    bytes: [u8; 320],
    len: usize,
}

impl FrameId {
    pub(super) fn of(sample: &Sample, mark: Option<&Mark<'_>>) -> FrameId {
        let mut bytes = [0; 320];
        let mut rest = &mut bytes[..];
        // The longest text is 20 + 20 + 8 + 1 + 10 + 10 digits, 20 more for the stamp, and 47 for the keys; a mark has 32 + 16 + 32 and 16: it fits.
        let _ = write!(
            rest,
            "step={} seq={} src={:08x} axes={} flags={} layout={}",
            sample.step,
            sample.sequence,
            sample.source,
            sample.len(),
            sample.flags,
            sample.layout
        );
        // A stamp that the header cannot hold.
        if Time::from_ns(sample.stamp_ns).to_ns() != sample.stamp_ns {
            let _ = write!(rest, " stamp={}", sample.stamp_ns);
        }
        if let Some(mark) = mark {
            let _ = write!(rest, "{mark}");
        }
        let len = 320 - rest.len();
        FrameId { bytes, len }
    }

    pub(super) fn as_str(&self) -> &str {
        std::str::from_utf8(&self.bytes[..self.len]).unwrap_or("")
    }
}
