//! Frames of Dynamixel protocol 2: `FF FF FD 00 id length-low length-high instruction [error] parameters crc-low crc-high`.

/// Instructions.
pub mod instruction {
    /// Who is there; answers model number and firmware.
    pub const PING: u8 = 1;
    /// Read registers: address, count, two bytes each.
    pub const READ: u8 = 2;
    /// Write registers: address, values.
    pub const WRITE: u8 = 3;
    /// What an answer has in place of an instruction.
    pub const STATUS: u8 = 0x55;
    /// Read the same registers of several servos.
    pub const SYNC_READ: u8 = 0x82;
    /// Write the same registers of several servos, without an answer.
    pub const SYNC_WRITE: u8 = 0x83;
}

/// The address that all servos hear.
pub const BROADCAST: u8 = 0xfe;
/// Bytes of a question beside its parameters.
pub const OVERHEAD: usize = 10;
/// Bytes of an answer beside its parameters: it has an error byte.
pub const ANSWER_OVERHEAD: usize = 11;
/// Longest body that is believed: instruction, parameters and checksum.
const MOST: usize = 1024;

const HEADER: [u8; 4] = [0xff, 0xff, 0xfd, 0];

/// A frame. Of an answer the first parameter is its error byte.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// Address.
    pub id: u8,
    /// Instruction, or [`instruction::STATUS`].
    pub code: u8,
    /// Parameters, without stuffing.
    pub parameters: Vec<u8>,
}

/// CRC-16 with the polynomial 0x8005, from the high bit, beginning at 0 (CRC-16/UMTS).
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0u16, |crc, byte| {
        (0..8).fold(crc ^ (u16::from(*byte) << 8), |crc, _| if crc & 0x8000 != 0 { (crc << 1) ^ 0x8005 } else { crc << 1 })
    })
}

impl Frame {
    /// Its bytes. A header within the parameters gets a further FD, as the protocol asks.
    pub fn bytes(&self) -> Vec<u8> {
        let mut body = vec![self.code];
        for byte in &self.parameters {
            body.push(*byte);
            if body.ends_with(&HEADER[..3]) {
                body.push(0xfd);
            }
        }
        let length = (body.len() + 2) as u16;
        let mut bytes = HEADER.to_vec();
        bytes.push(self.id);
        bytes.extend(length.to_le_bytes());
        bytes.extend(body);
        bytes.extend(crc(&bytes).to_le_bytes());
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
    let start = bytes.windows(4).position(|four| four == HEADER);
    // A header may just be arriving.
    let begun = (1..4).rev().find(|n| bytes.ends_with(&HEADER[..*n])).unwrap_or(0);
    let start = start.unwrap_or(bytes.len() - begun);
    if start > 0 {
        bytes.drain(..start);
        return Found::Noise(start);
    }
    let (Some(low), Some(high)) = (bytes.get(5), bytes.get(6)) else { return Found::Nothing };
    let length = usize::from(u16::from_le_bytes([*low, *high]));
    if !(3..=MOST).contains(&length) {
        bytes.drain(..4);
        return Found::Noise(4);
    }
    let Some(frame) = bytes.get(..length + 7) else { return Found::Nothing };
    if crc(&frame[..length + 5]).to_le_bytes() != frame[length + 5..] {
        bytes.drain(..4);
        return Found::Corrupt;
    }
    let (id, code) = (frame[4], frame[7]);
    let mut parameters: Vec<u8> = Vec::with_capacity(length);
    let mut before = vec![code];
    let mut skip = false;
    for byte in &frame[8..length + 5] {
        if skip {
            // The FD that was stuffed in.
            skip = false;
            continue;
        }
        before.push(*byte);
        parameters.push(*byte);
        skip = before.ends_with(&HEADER[..3]);
    }
    bytes.drain(..length + 7);
    Found::Frame(Frame { id, code, parameters })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_of_the_makers_manual() {
        // From the protocol's e-manual: a ping of id 1 and its answer, and a read of 4 bytes at 132.
        let ping = Frame { id: 1, code: instruction::PING, parameters: vec![] };
        assert_eq!(ping.bytes(), [0xff, 0xff, 0xfd, 0, 1, 3, 0, 1, 0x19, 0x4e]);
        let read = Frame { id: 1, code: instruction::READ, parameters: vec![0x84, 0, 4, 0] };
        assert_eq!(read.bytes(), [0xff, 0xff, 0xfd, 0, 1, 7, 0, 2, 0x84, 0, 4, 0, 0x1d, 0x15]);
        let mut answer = vec![0xff, 0xff, 0xfd, 0, 1, 7, 0, 0x55, 0, 6, 4, 0x26, 0x65, 0x5d];
        let found = take(&mut answer);
        assert_eq!(found, Found::Frame(Frame { id: 1, code: instruction::STATUS, parameters: vec![0, 6, 4, 0x26] }));
    }

    #[test]
    fn a_header_in_the_parameters_is_stuffed_and_comes_back() {
        for parameters in [vec![0xff, 0xff, 0xfd, 0, 1], vec![9, 0xff, 0xff, 0xfd], vec![0xff, 0xff, 0xfd, 0xfd, 0xff]] {
            let sent = Frame { id: 3, code: instruction::WRITE, parameters };
            let mut bytes = sent.bytes();
            assert_eq!(take(&mut bytes), Found::Frame(sent));
            assert!(bytes.is_empty());
        }
    }

    #[test]
    fn any_bytes_come_to_an_end() {
        let mut state = 7u32;
        for _ in 0..300 {
            let mut bytes: Vec<u8> = (0..80)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    [0xff, 0xff, 0xfd, 0, (state >> 16) as u8, 3][(state >> 28) as usize % 6]
                })
                .collect();
            for _ in 0..300 {
                if take(&mut bytes) == Found::Nothing {
                    break;
                }
            }
            assert_eq!(take(&mut bytes), Found::Nothing);
        }
    }
}
