//! A zero that differs between recordings of one joint.

use super::motion::of;
use crate::advice;
use crate::finding::{Finding, FindingKind};
use crate::joints::Joint;
use crate::numeric::{median, robust_deviation, span};
use crate::recording::Recording;
use std::collections::BTreeMap;

/// Pieces of a recording over which its offset is evaluated.
const PIECES: usize = 10;
/// A zero is shifted where it is beyond the largest deviation within a recording by this factor, and beyond this share of the joint's range.
const DEVIATIONS: f64 = 2.0;
const OF_RANGE: f64 = 0.1;

/// The offset of a position from its command in a recording.
struct Offset<'a> {
    recording: &'a Recording,
    joint: &'a Joint,
    place: usize,
    middle: f64,
    spread: f64,
    range: f64,
}

/// Compares the offsets of all recordings, joint by joint.
pub fn zeros(all: &[(Recording, Vec<Joint>)], out: &mut Vec<Finding>) {
    let mut by_joint: BTreeMap<String, Vec<Offset>> = BTreeMap::new();
    for (recording, joints) in all {
        for joint in joints.iter().filter(|joint| !joint.is_led) {
            let (Some(command), Some(position), Some(place)) =
                (of(recording, joint.command), of(recording, joint.position), joint.position)
            else {
                continue;
            };
            let differences: Vec<f64> = position.even.iter().zip(&command.even).map(|(y, u)| y - u).collect();
            let size = (differences.len() / PIECES).max(1);
            let pieces: Vec<f64> = differences.chunks(size).map(median).collect();
            let middle = median(&differences);
            // What weight and friction make of it within the recording.
            let spread = pieces.iter().map(|piece| (piece - middle).abs()).fold(0.0, f64::max);
            let range = span(&command.even);
            by_joint.entry(format!("{} {}", joint.name, position.name)).or_default().push(Offset {
                recording,
                joint,
                place,
                middle,
                spread,
                range,
            });
        }
    }
    for offsets in by_joint.values().filter(|offsets| offsets.len() > 1) {
        let middles: Vec<f64> = offsets.iter().map(|offset| offset.middle).collect();
        // Of two recordings the first is taken for right; of more, what most of them have.
        let usual = if middles.len() == 2 { middles[0] } else { median(&middles) };
        let within = offsets.iter().map(|offset| offset.spread).fold(0.0, f64::max);
        let between = if middles.len() > 3 { robust_deviation(&middles) } else { 0.0 };
        let range = offsets.iter().map(|offset| offset.range).fold(0.0, f64::max);
        for offset in offsets {
            let shift = offset.middle - usual;
            if shift.abs() <= DEVIATIONS * within.max(2.5 * between) || shift.abs() <= OF_RANGE * range || range == 0.0 {
                continue;
            }
            let name = offset.recording.signals[offset.place].name.as_str();
            let message = format!(
                "the zero of {name:?} is shifted by {shift:.4} against the other recordings: the joint was homed at another \
                    position"
            );
            let entry = advice::entry(offset.recording, offset.joint, offset.place, &format!("offset = {:.4}", -shift));
            let finding = Finding::new(FindingKind::ZeroShifted, &offset.recording.file, &[name], message).at(&offset.joint.name);
            out.push(finding.todo(format!("in a separate set for this file:\n{entry}")));
        }
    }
}
