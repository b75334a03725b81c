//! Registers of Feetech servos, and how their values are written.

/// Model number, 2 bytes.
pub const MODEL: u8 = 3;
/// Address.
pub const ID: u8 = 5;
/// 0: position servo.
pub const MODE: u8 = 33;
/// Torque on (1) or off (0).
pub const TORQUE: u8 = 40;
/// Goal position, 2 bytes.
pub const GOAL: u8 = 42;
/// First of the registers that a cycle reads.
pub const PRESENT: u8 = 56;
/// Bytes that a cycle reads: position 2, speed 2, load 2, voltage, temperature, written, status, moving, reserved 2, current 2.
pub const PRESENT_BYTES: u8 = 15;
/// The same of an SCS servo, which has no current: position 2, speed 2, load 2, voltage, temperature.
pub const PRESENT_BYTES_SCS: u8 = 8;

/// A of one count of the current register.
pub const AMPERE: f64 = 0.0065;

/// The end that comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// STS and SMS.
    LittleEnd,
    /// SCS.
    BigEnd,
}

impl Order {
    /// A word of two bytes.
    pub fn word(self, bytes: [u8; 2]) -> u16 {
        match self {
            Order::LittleEnd => u16::from_le_bytes(bytes),
            Order::BigEnd => u16::from_be_bytes(bytes),
        }
    }

    /// The bytes of a word.
    pub fn bytes(self, word: u16) -> [u8; 2] {
        match self {
            Order::LittleEnd => word.to_le_bytes(),
            Order::BigEnd => word.to_be_bytes(),
        }
    }
}

/// A magnitude with its sign in bit `sign`: how position, speed (15) and load (10) are written.
pub fn signed(word: u16, sign: u32) -> i32 {
    let magnitude = i32::from(word & ((1 << sign) - 1));
    if word & (1 << sign) != 0 { -magnitude } else { magnitude }
}

/// The word of a number; beyond the magnitude's bits it is cut.
pub fn unsigned(value: i32, sign: u32) -> u16 {
    let most = (1u32 << sign) - 1;
    let magnitude = value.unsigned_abs().min(most) as u16;
    if value < 0 { magnitude | (1 << sign) } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnitudes_with_a_sign_go_there_and_back() {
        for sign in [10, 15] {
            for value in [-1000, -1, 0, 1, 1000] {
                assert_eq!(signed(unsigned(value, sign), sign), value);
            }
        }
        assert_eq!(unsigned(-5, 15), 0x8005, "no two's complement");
        assert_eq!(unsigned(40_000, 15), 0x7fff);
    }
}
