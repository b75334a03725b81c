//! Registers of the X series, and the units of their values.

/// Model number, 2 bytes.
pub const MODEL: u16 = 0;
/// Operating mode: 0 current, 3 position.
pub const MODE: u16 = 11;
/// Torque on (1) or off (0).
pub const TORQUE: u16 = 64;
/// Time without an instruction after which the servo stops by itself, 20 ms each; 0 for never.
pub const WATCHDOG: u16 = 98;
/// Goal current, 2 bytes, signed.
pub const GOAL_CURRENT: u16 = 102;
/// Goal position, 4 bytes, signed.
pub const GOAL_POSITION: u16 = 116;
/// First of the registers that a cycle reads.
pub const PRESENT: u16 = 126;
/// Bytes that a cycle reads: current 2, velocity 4, position 4, trajectories 8, voltage 2, temperature.
pub const PRESENT_BYTES: u16 = 21;

/// Position control.
pub const MODE_POSITION: u8 = 3;
/// Current control.
pub const MODE_CURRENT: u8 = 0;

/// rad/s of one count of velocity: 0.229 revolutions a minute.
pub const RAD_PER_S: f64 = 0.229 * std::f64::consts::TAU / 60.0;

/// A of one count of current, by model number: XL330 and XC330 count mA, XM and XH 2.69 mA.
pub fn ampere(model: Option<u32>) -> f64 {
    match model {
        Some(1190..=1250) => 1e-3,
        _ => 2.69e-3,
    }
}
