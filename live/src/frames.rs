//! What goes over the WebSocket besides JSON: intervals of curves, little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 1 | 1: newest intervals; 2: an answer to a request for a range |
//! | 1 | number of the recording, 0 or 1; 0 of a run |
//! | 2 | curves in each interval |
//! | 4 | intervals |
//! | 8 | number of the request that it answers, or 0 |
//! | 8, then 8 per curve, per interval | time of its beginning, s (f64), and least and greatest value (f32 each); NaN where there is none |

use crate::decimate::{Interval, PER_S, Range};

/// Newest intervals.
pub(crate) const NEWEST: u8 = 1;

/// A range that was asked for.
pub(crate) const ASKED: u8 = 2;

/// Intervals of 1/60 s as a frame.
pub(crate) fn newest(intervals: &[Interval]) -> Vec<u8> {
    let curves = intervals.iter().map(|i| i.ranges.len()).max().unwrap_or(0);
    let mut frame = header(NEWEST, 0, curves, intervals.len(), 0);
    for interval in intervals {
        row(&mut frame, interval.number as f64 / PER_S, &interval.ranges, curves);
    }
    frame
}

/// The head of a frame.
pub(crate) fn header(kind: u8, recording: u8, curves: usize, intervals: usize, request: u64) -> Vec<u8> {
    let mut frame = vec![kind, recording];
    frame.extend((curves as u16).to_le_bytes());
    frame.extend((intervals as u32).to_le_bytes());
    frame.extend(request.to_le_bytes());
    frame
}

/// One interval of a frame.
pub(crate) fn row(frame: &mut Vec<u8>, time_s: f64, ranges: &[Range], curves: usize) {
    frame.extend(time_s.to_le_bytes());
    for curve in 0..curves {
        let [low, high] = ranges.get(curve).copied().unwrap_or([f32::NAN; 2]);
        frame.extend(low.to_le_bytes());
        frame.extend(high.to_le_bytes());
    }
}
