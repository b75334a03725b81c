//! Lengths inside the body of a record, checked before the body is parsed: the crate `mcap` allocates the stated length before it reads.

use mcap::records::op;

/// What stands in a record up to its last counted part, field by field.
enum Field {
    /// This number of bytes.
    Fixed(usize),
    /// A length of four bytes, and that number of bytes.
    Counted,
    /// The same, and in it pairs of counted strings.
    Pairs,
}

/// The fields of a record of this type (MCAP specification, version 0); empty where nothing in it is counted.
fn fields(opcode: u8) -> &'static [Field] {
    use Field::{Counted, Fixed, Pairs};
    match opcode {
        op::HEADER => &[Counted, Counted],
        op::SCHEMA => &[Fixed(2), Counted, Counted, Counted],
        op::CHANNEL => &[Fixed(4), Counted, Counted, Pairs],
        op::CHUNK => &[Fixed(28), Counted],
        op::MESSAGE_INDEX => &[Fixed(2), Counted],
        op::CHUNK_INDEX => &[Fixed(32), Counted, Fixed(8), Counted],
        op::ATTACHMENT => &[Fixed(16), Counted, Counted],
        op::ATTACHMENT_INDEX => &[Fixed(40), Counted, Counted],
        op::STATISTICS => &[Fixed(42), Counted],
        op::METADATA => &[Counted, Pairs],
        op::METADATA_INDEX => &[Fixed(16), Counted],
        _ => &[],
    }
}

/// Whether every length in the body of a record stays within it.
pub(crate) fn within(opcode: u8, body: &[u8]) -> bool {
    let mut rest = body;
    fields(opcode).iter().all(|field| {
        let part = match field {
            Field::Fixed(len) => take(&mut rest, *len),
            Field::Counted | Field::Pairs => counted(&mut rest),
        };
        match (part, field) {
            (Some(mut pairs), Field::Pairs) => {
                while !pairs.is_empty() {
                    if counted(&mut pairs).is_none() {
                        return false;
                    }
                }
                true
            }
            (part, _) => part.is_some(),
        }
    })
}

fn take<'a>(rest: &mut &'a [u8], len: usize) -> Option<&'a [u8]> {
    let (part, after) = rest.split_at_checked(len)?;
    *rest = after;
    Some(part)
}

fn counted<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let len = u32::from_le_bytes(take(rest, 4)?.try_into().ok()?);
    take(rest, len as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_beyond_the_record_is_seen_wherever_it_stands() {
        // A channel 1 of schema 1: topic "t", encoding "", one pair "k": "v".
        let whole = [1u8, 0, 1, 0, 1, 0, 0, 0, b't', 0, 0, 0, 0, 10, 0, 0, 0, 1, 0, 0, 0, b'k', 1, 0, 0, 0, b'v'];
        assert!(within(op::CHANNEL, &whole));
        for at in [4, 9, 13, 17, 22] {
            let mut damaged = whole;
            damaged[at + 3] = 0xff;
            assert!(!within(op::CHANNEL, &damaged), "length at {at}");
        }
        assert!(!within(op::CHANNEL, &whole[..3]));
        assert!(within(op::MESSAGE, &[]));
    }
}
