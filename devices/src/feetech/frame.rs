//! Frames of the Feetech protocol: `FF FF id length instruction-or-error parameters checksum`.

/// Instructions.
pub mod instruction {
    /// Who is there.
    pub const PING: u8 = 1;
    /// Read registers: address, count.
    pub const READ: u8 = 2;
    /// Write registers: address, values.
    pub const WRITE: u8 = 3;
    /// Read the same registers of several servos: address, count, ids. Each answers in the order of the ids.
    pub const SYNC_READ: u8 = 0x82;
    /// Write the same registers of several servos, without an answer: address, count, then id and values of each.
    pub const SYNC_WRITE: u8 = 0x83;
}

/// The address that all servos hear and none answers.
pub const BROADCAST: u8 = 0xfe;

/// Bytes of a frame beside its parameters.
pub const OVERHEAD: usize = 6;

/// A frame. `code` is the instruction, or the error bits of an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Address.
    pub id: u8,
    /// Instruction, or error bits of an answer.
    pub code: u8,
    /// Parameters.
    pub parameters: Vec<u8>,
}

/// Complement of the sum of all bytes from the id on.
pub fn checksum(bytes: &[u8]) -> u8 {
    !bytes.iter().fold(0u8, |sum, b| sum.wrapping_add(*b))
}

impl Frame {
    /// Its bytes. Parameters beyond 250 bytes do not fit and are cut.
    pub fn bytes(&self) -> Vec<u8> {
        let parameters = &self.parameters[..self.parameters.len().min(250)];
        let mut bytes = vec![0xff, 0xff, self.id, parameters.len() as u8 + 2, self.code];
        bytes.extend_from_slice(parameters);
        bytes.push(checksum(&bytes[2..]));
        bytes
    }
}

/// What the bytes at hand begin with.
#[derive(Debug, PartialEq, Eq)]
pub enum Found {
    /// A whole frame.
    Frame(Frame),
    /// A frame whose checksum is wrong.
    Corrupt,
    /// This many bytes of no frame.
    Noise(usize),
    /// Not enough bytes.
    Nothing,
}

/// Takes the first thing out of the bytes that have arrived.
pub fn take(bytes: &mut Vec<u8>) -> Found {
    let start = bytes.windows(2).position(|pair| pair == [0xff, 0xff]);
    let start = start.unwrap_or_else(|| if bytes.last() == Some(&0xff) { bytes.len() - 1 } else { bytes.len() });
    if start > 0 {
        bytes.drain(..start);
        return Found::Noise(start);
    }
    // A third FF is no id: the frame begins one later.
    if bytes.get(2) == Some(&0xff) {
        bytes.remove(0);
        return Found::Noise(1);
    }
    let Some(length) = bytes.get(3).map(|l| usize::from(*l)) else { return Found::Nothing };
    if length < 2 {
        bytes.drain(..2);
        return Found::Noise(2);
    }
    let Some(frame) = bytes.get(..length + 4) else { return Found::Nothing };
    if checksum(&frame[2..length + 3]) != frame[length + 3] {
        // The next header may lie within: only this one is dropped.
        bytes.drain(..2);
        return Found::Corrupt;
    }
    let found = Frame { id: frame[2], code: frame[4], parameters: frame[5..length + 3].to_vec() };
    bytes.drain(..length + 4);
    Found::Frame(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_of_the_makers_manual() {
        // Ping of id 1 and its answer, and a read of the position of id 1 with 2072 as its answer: from the STS manual, chapter 1.3.
        assert_eq!(Frame { id: 1, code: instruction::PING, parameters: vec![] }.bytes(), [0xff, 0xff, 1, 2, 1, 0xfb]);
        assert_eq!(Frame { id: 1, code: 2, parameters: vec![0x38, 2] }.bytes(), [0xff, 0xff, 1, 4, 2, 0x38, 2, 0xbe]);
        let mut answer = vec![0xff, 0xff, 1, 4, 0, 0x18, 5, 0xdd];
        assert_eq!(take(&mut answer), Found::Frame(Frame { id: 1, code: 0, parameters: vec![0x18, 5] }));
        assert!(answer.is_empty());
    }

    #[test]
    fn broken_bytes_cost_no_more_than_their_frame() {
        let good = Frame { id: 2, code: 0, parameters: vec![1, 2, 3] };
        let mut bytes = vec![7, 8];
        let mut bad = good.bytes();
        bad[6] ^= 0x10;
        bytes.extend(bad);
        bytes.extend(good.bytes());
        let (mut frames, mut corrupt) = (0, 0);
        loop {
            match take(&mut bytes) {
                Found::Frame(frame) => {
                    assert_eq!(frame, good);
                    frames += 1;
                }
                Found::Corrupt => corrupt += 1,
                Found::Noise(n) => assert!(n > 0),
                Found::Nothing => break,
            }
        }
        assert_eq!((frames, corrupt), (1, 1));
    }

    #[test]
    fn any_bytes_come_to_an_end() {
        let mut state = 1u32;
        for _ in 0..200 {
            let mut bytes: Vec<u8> = (0..64)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    let byte = (state >> 24) as u8;
                    if byte < 90 { 0xff } else { byte }
                })
                .collect();
            for _ in 0..200 {
                if take(&mut bytes) == Found::Nothing {
                    break;
                }
            }
            assert_eq!(take(&mut bytes), Found::Nothing);
        }
    }
}
