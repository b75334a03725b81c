//! Which messages a chunk holds, in few bytes: it stands behind every chunk of ours instead of MCAP's message index.
//!
//! MCAP's own index takes 16 bytes a message, half of a lockstep bag whose messages compress to as much. The information needed here, the log time of
//! every message by channel and place, grows nearly evenly. Most of its second differences are zero in lockstep, and the others take two or three
//! bytes in real time. They stand in a record of type [`COMPACT_INDEX`], which the format reserves for applications and other readers pass over
//! (<https://mcap.dev/spec>, "Opcodes 0x80-0xFF"). [`crate::recover()`] reads it when a chunk is damaged.
//!
//! Body: a version byte, then for each channel its number (u16), how many messages (u32), bytes that follow (u32), and there the second differences.
//! These are zigzag (<https://protobuf.dev/programming-guides/encoding>) in base 128; a zero is followed by how many more come after it.

use std::collections::BTreeMap;

/// Op code of the record.
pub(crate) const COMPACT_INDEX: u8 = 0x80;

const VERSION: u8 = 1;

/// Most messages that a chunk of ours may hold; what claims more is damaged.
const MOST: u32 = 1 << 20;

/// Log times by channel, in the order of the chunk.
pub(crate) type Index = BTreeMap<u16, Vec<u64>>;

/// The body of the record.
pub(crate) fn encode(index: &Index) -> Vec<u8> {
    let mut body = vec![VERSION];
    let mut bytes = Vec::new();
    for (channel, times) in index.iter().filter(|(_, times)| !times.is_empty()) {
        bytes.clear();
        let (mut last, mut step, mut zeros) = (0_u64, 0_u64, None::<u64>);
        for time in times {
            let next = time.wrapping_sub(last);
            let bend = next.wrapping_sub(step) as i64;
            (last, step) = (*time, next);
            if bend == 0 {
                zeros = Some(zeros.map_or(0, |zeros| zeros + 1));
                continue;
            }
            end_zeros(&mut zeros, &mut bytes);
            put(((bend << 1) ^ (bend >> 63)) as u64, &mut bytes);
        }
        end_zeros(&mut zeros, &mut bytes);
        body.extend(channel.to_le_bytes());
        body.extend((times.len() as u32).to_le_bytes());
        body.extend((bytes.len() as u32).to_le_bytes());
        body.extend(&bytes);
    }
    body
}

fn end_zeros(zeros: &mut Option<u64>, bytes: &mut Vec<u8>) {
    if let Some(more) = zeros.take() {
        put(0, bytes);
        put(more, bytes);
    }
}

/// Reads what [`encode`] wrote; `None` where it is damaged or of another version.
pub(crate) fn decode(body: &[u8]) -> Option<Index> {
    let (version, mut rest) = body.split_first()?;
    let mut index = Index::new();
    let mut all = 0_u32;
    while *version == VERSION && !rest.is_empty() {
        let (head, behind) = rest.split_at_checked(10)?;
        let channel = u16::from_le_bytes(head[..2].try_into().ok()?);
        let count = u32::from_le_bytes(head[2..6].try_into().ok()?);
        let len = u32::from_le_bytes(head[6..].try_into().ok()?);
        let (mut bytes, behind) = behind.split_at_checked(len as usize)?;
        rest = behind;
        all = all.checked_add(count).filter(|all| *all <= MOST)?;
        let (mut times, mut last, mut step) = (Vec::new(), 0_u64, 0_u64);
        while !bytes.is_empty() {
            let zigzag = take(&mut bytes)?;
            let repeats = if zigzag == 0 { take(&mut bytes)? } else { 0 };
            if repeats >= u64::from(count) {
                return None;
            }
            for _ in 0..=repeats {
                step = step.wrapping_add(((zigzag >> 1) as i64 ^ -((zigzag & 1) as i64)) as u64);
                last = last.wrapping_add(step);
                times.push(last);
            }
            if times.len() > count as usize {
                return None;
            }
        }
        if times.len() != count as usize {
            return None;
        }
        index.entry(channel).or_default().extend(times);
    }
    (*version == VERSION).then_some(index)
}

fn put(mut value: u64, bytes: &mut Vec<u8>) {
    while value > 0x7f {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn take(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for shift in (0..64).step_by(7) {
        let (byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_comes_back() {
        let even: Vec<u64> = (0..1000).map(|k| k * 100_000).collect();
        let uneven: Vec<u64> = (0..500).map(|k| 1_700_000_000_000_000_000 + k * 1_000_000 + (k * 7919) % 54_321).collect();
        let odd = vec![u64::MAX, 0, 0, 0, u64::MAX, 1 << 63, 5, 5, 4];
        let index = Index::from([(1, even), (2, uneven), (7, odd), (u16::MAX, vec![0])]);
        let body = encode(&index);
        assert_eq!(decode(&body), Some(index));
        assert!(body.len() < 2_000, "1510 times in {} bytes", body.len());
        assert_eq!(encode(&Index::from([(3, (0..10_000).map(|k| k * 100_000).collect())])).len(), 1 + 10 + 8, "even times cost nothing");
    }

    #[test]
    fn what_is_damaged_is_refused_and_asks_for_no_memory() {
        let body = encode(&Index::from([(1, (0..300).map(|k| k * k).collect()), (2, vec![9, 9, 9])]));
        for cut in 0..body.len() {
            assert!(decode(&body[..cut]).is_none_or(|index| index.len() < 2), "cut at {cut}");
        }
        for at in 0..body.len() {
            for bit in 0..8 {
                let mut wrong = body.clone();
                wrong[at] ^= 1 << bit;
                let _ = decode(&wrong);
            }
        }
        let mut huge = vec![VERSION, 1, 0];
        huge.extend(u32::MAX.to_le_bytes());
        huge.extend(11_u32.to_le_bytes());
        huge.push(0);
        put(u64::from(u32::MAX) - 1, &mut huge);
        assert_eq!(decode(&huge), None);
        assert_eq!(decode(&[9]), None, "another version");
    }
}
