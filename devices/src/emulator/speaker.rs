//! What is behind the wire: servos that understand the frames of one protocol.

use super::servo::Servo;

/// Servos that speak a protocol.
pub trait Speaker: Send {
    /// The servos.
    fn servos(&mut self) -> &mut [Servo];

    /// Takes whole frames out of the bytes that have arrived, and gives their answers in the order in which they are sent.
    fn answers(&mut self, heard: &mut Vec<u8>) -> Vec<Vec<u8>>;

    /// The same answer from somebody else, with a checksum that fits.
    fn of_another(&self, answer: &mut [u8]);

    /// The same answer with a wrong checksum; `false` where it is not carried at all then, because the wire itself checks it.
    fn spoilt(&self, answer: &mut [u8]) -> bool;

    /// Bits on the wire for a byte of a frame.
    fn bits_per_byte(&self) -> f64;
}
