//! Who sent a message on the wire: ` run=RUN life=LIFE tag=TAG` at the end of the text that carries what standard messages have no field for.
//!
//! The type of the message is unchanged, so that any ROS tool reads it, and the tag travels in the message that it belongs to. Computing and checking
//! tags is no matter of this crate: it only states where in the CDR their digits are.

use super::RosError;
use crate::topic::Kind;
use std::fmt;
use std::ops::Range;

/// Hexadecimal digits of a tag.
pub const TAG_DIGITS: usize = 32;

/// Longest name of a run.
pub const LONGEST_RUN: usize = 32;

/// Which run a message is of, and which life of its publisher.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mark<'a> {
    /// Name of the run: at most [`LONGEST_RUN`] letters and digits.
    pub run: &'a str,
    /// Grows when the publisher begins to count its messages from 0.
    pub life: u64,
}

impl fmt::Display for Mark<'_> {
    /// With zeros in place of the tag.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, " run={} life={:x} tag={:0>width$}", self.run, self.life, "", width = TAG_DIGITS)
    }
}

/// A mark that was found in a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Marked<'a> {
    /// Its content.
    pub mark: Mark<'a>,
    /// Where in the CDR the digits of the tag are.
    pub digits: Range<usize>,
}

/// The mark at the end of a message's text; `None` where it has none, or is too short to be such a message.
pub fn marked(kind: Kind, little_endian: bool, cdr: &[u8]) -> Option<Marked<'_>> {
    let range = text(kind, little_endian, cdr)?;
    let words = std::str::from_utf8(cdr.get(range.clone())?).ok()?;
    let (words, tag) = words.rsplit_once(" tag=")?;
    let (words, life) = words.rsplit_once(" life=")?;
    let (_, run) = words.rsplit_once(" run=")?;
    let is_name = (1..=LONGEST_RUN).contains(&run.len()) && run.bytes().all(|b| b.is_ascii_alphanumeric());
    let is_tag = tag.len() == TAG_DIGITS && tag.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
    let life = u64::from_str_radix(life, 16).ok()?;
    (is_name && is_tag).then_some(Marked { mark: Mark { run, life }, digits: range.end - TAG_DIGITS..range.end })
}

/// Where the text of a message is that holds what its type has no field for: `header.frame_id`, or `file` of a `Log`.
fn text(kind: Kind, little_endian: bool, cdr: &[u8]) -> Option<Range<usize>> {
    // A stamp of two 32-bit numbers comes first; a Log then has a byte, and two strings before the one that is looked for.
    let (mut at, skipped) = if kind == Kind::Event { (9, 2) } else { (8, 0) };
    for _ in 0..skipped {
        at = string(little_endian, cdr, at)?.end.checked_add(1)?;
    }
    string(little_endian, cdr, at)
}

/// A string that begins at the next multiple of 4 from `at`, without its final zero.
fn string(little_endian: bool, cdr: &[u8], at: usize) -> Option<Range<usize>> {
    let at = at.checked_next_multiple_of(4)?;
    let length: [u8; 4] = cdr.get(at..at.checked_add(4)?)?.try_into().ok()?;
    let length = if little_endian { u32::from_le_bytes(length) } else { u32::from_be_bytes(length) } as usize;
    let (begin, end) = (at + 4, (at + 4).checked_add(length.checked_sub(1)?)?);
    (*cdr.get(end)? == 0).then_some(begin..end)
}

/// A run's name that cannot be one would change what its messages say.
///
/// # Errors
/// It is empty, too long, or has other characters than letters and digits.
pub fn check_run(run: &str) -> Result<(), RosError> {
    let valid = (1..=LONGEST_RUN).contains(&run.len()) && run.bytes().all(|b| b.is_ascii_alphanumeric());
    if valid { Ok(()) } else { Err(RosError::Inconsistent { what: format!("`{run}` cannot name a run") }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::live;
    use crate::text::Text;
    use crate::{Event, LAYOUT, Message, Sample};

    const MARK: Mark<'_> = Mark { run: "6925b1f2001a2b3c4d5e", life: u64::MAX };

    fn messages() -> [Message; 2] {
        let (kind, text) = (Text::new("stale_input"), Text::new("a sentence tag=1"));
        let event =
            Event { layout: LAYOUT, source: 1, step: 2, sequence: 3, stamp_ns: 4, severity: 1, reserved: 0, value: 0.5, kind, text };
        // The longest text that there is.
        let sample = Sample { step: u64::MAX, sequence: u64::MAX, source: u32::MAX, flags: u32::MAX, stamp_ns: i64::MIN, ..Sample::new(8) };
        [Message::Event(event), Message::Sample(Sample { layout: u32::MAX, ..sample })]
    }

    #[test]
    fn a_mark_is_found_again_and_the_message_reads_as_without_it() {
        for message in messages() {
            let (mut with, mut without) = (Vec::new(), Vec::new());
            live::encode(&message, "slave", &[], Some(&MARK), &mut with).unwrap();
            live::encode(&message, "slave", &[], None, &mut without).unwrap();
            let found = marked(message.kind(), true, &with).unwrap();
            assert_eq!((found.mark, found.digits.len()), (MARK, TAG_DIGITS));
            assert!(with[found.digits].iter().all(|b| *b == b'0'));
            assert_eq!(marked(message.kind(), true, &without), None);
            let read = |cdr: &[u8]| format!("{:?}", live::decode(message.kind(), true, cdr).unwrap());
            assert_eq!(read(&with), read(&without));
        }
    }

    #[test]
    fn what_is_cut_off_or_not_text_has_no_mark() {
        for message in messages() {
            let mut cdr = Vec::new();
            live::encode(&message, "slave", &[], Some(&MARK), &mut cdr).unwrap();
            let end = marked(message.kind(), true, &cdr).unwrap().digits.end;
            for cut in 0..=end {
                assert_eq!(marked(message.kind(), true, &cdr[..cut]), None, "{cut}");
            }
            assert_eq!(marked(message.kind(), false, &cdr), None);
            for at in 0..cdr.len() {
                let mut changed = cdr.clone();
                changed[at] ^= 0xff;
                // Whatever is found is inside.
                if let Some(found) = marked(message.kind(), true, &changed) {
                    assert!(found.digits.end < changed.len() && found.digits.len() == TAG_DIGITS);
                }
            }
        }
    }
}
