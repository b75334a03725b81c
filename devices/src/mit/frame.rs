//! Frames of MIT motors: position, velocity, stiffness, damping and torque as unsigned numbers over fixed spans.

/// Highest stiffness that a frame carries, N m/rad.
pub const MOST_STIFFNESS: f64 = 500.0;
/// Highest damping, N m s/rad.
pub const MOST_DAMPING: f64 = 5.0;

/// Motor on.
pub const ENABLE: [u8; 8] = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xfc];
/// Motor off.
pub const DISABLE: [u8; 8] = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xfd];

/// Ends of position (rad), velocity (rad/s) and torque (N m).
pub type Spans = [f64; 3];

/// What a motor shall do: position rad, velocity rad/s, stiffness N m/rad, damping N m s/rad, torque N m.
pub type Command = [f64; 5];

/// What a motor answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Low four bits of its address.
    pub id: u8,
    /// 0 off, 1 on, above 7 an error.
    pub status: u8,
    /// rad.
    pub position: f64,
    /// rad/s.
    pub velocity: f64,
    /// N m.
    pub torque: f64,
    /// Degrees Celsius, of the rotor.
    pub temperature: f64,
}

fn packed(value: f64, low: f64, high: f64, bits: u32) -> u32 {
    let most = f64::from((1u32 << bits) - 1);
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    (share * most).round() as u32
}

fn unpacked(counts: u32, low: f64, high: f64, bits: u32) -> f64 {
    low + (high - low) * f64::from(counts) / f64::from((1u32 << bits) - 1)
}

/// The bytes of a command. Values beyond their span are cut; what is no number is 0.
pub fn command(command: &Command, spans: &Spans) -> [u8; 8] {
    let [p, v, kp, kd, t] = command.map(|x| if x.is_finite() { x } else { 0.0 });
    let p = packed(p, -spans[0], spans[0], 16);
    let v = packed(v, -spans[1], spans[1], 12);
    let kp = packed(kp, 0.0, MOST_STIFFNESS, 12);
    let kd = packed(kd, 0.0, MOST_DAMPING, 12);
    let t = packed(t, -spans[2], spans[2], 12);
    let byte = |x: u32| (x & 0xff) as u8;
    [byte(p >> 8), byte(p), byte(v >> 4), byte((v & 0xf) << 4 | kp >> 8), byte(kp), byte(kd >> 4), byte((kd & 0xf) << 4 | t >> 8), byte(t)]
}

/// The command of some bytes.
pub fn command_of(b: &[u8; 8], spans: &Spans) -> Command {
    let [b0, b1, b2, b3, b4, b5, b6, b7] = b.map(u32::from);
    [
        unpacked(b0 << 8 | b1, -spans[0], spans[0], 16),
        unpacked(b2 << 4 | b3 >> 4, -spans[1], spans[1], 12),
        unpacked((b3 & 0xf) << 8 | b4, 0.0, MOST_STIFFNESS, 12),
        unpacked(b5 << 4 | b6 >> 4, 0.0, MOST_DAMPING, 12),
        unpacked((b6 & 0xf) << 8 | b7, -spans[2], spans[2], 12),
    ]
}

/// The bytes of an answer.
pub fn answer(state: &State, spans: &Spans) -> [u8; 8] {
    let p = packed(state.position, -spans[0], spans[0], 16);
    let v = packed(state.velocity, -spans[1], spans[1], 12);
    let t = packed(state.torque, -spans[2], spans[2], 12);
    let byte = |x: u32| (x & 0xff) as u8;
    let temperature = state.temperature.clamp(0.0, 255.0) as u8;
    let first = (state.id & 0xf) | (state.status << 4);
    [first, byte(p >> 8), byte(p), byte(v >> 4), byte((v & 0xf) << 4 | t >> 8), byte(t), temperature, temperature]
}

/// The state that an answer carries.
pub fn state_of(b: &[u8; 8], spans: &Spans) -> State {
    let n = b.map(u32::from);
    State {
        id: b[0] & 0xf,
        status: b[0] >> 4,
        position: unpacked(n[1] << 8 | n[2], -spans[0], spans[0], 16),
        velocity: unpacked(n[3] << 4 | n[4] >> 4, -spans[1], spans[1], 12),
        torque: unpacked((n[4] & 0xf) << 8 | n[5], -spans[2], spans[2], 12),
        temperature: f64::from(b[7]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPANS: Spans = [12.5, 30.0, 10.0];

    #[test]
    fn commands_and_states_go_there_and_back_to_half_a_count() {
        let sent = [1.25, -3.0, 40.0, 1.5, -2.5];
        let ends = [12.5 / 65_535.0, 30.0 / 4095.0, 250.0 / 4095.0, 2.5 / 4095.0, 10.0 / 4095.0];
        let back = command_of(&command(&sent, &SPANS), &SPANS);
        for ((sent, back), half) in sent.iter().zip(back).zip(ends) {
            assert!((sent - back).abs() <= half * 1.000001, "{sent} {back}");
        }
        let state = State { id: 3, status: 1, position: -2.0, velocity: 4.0, torque: 0.5, temperature: 41.0 };
        let back = state_of(&answer(&state, &SPANS), &SPANS);
        assert_eq!((back.id, back.status, back.temperature), (3, 1, 41.0));
        assert!((back.position + 2.0).abs() < 2e-4 && (back.velocity - 4.0).abs() < 8e-3 && (back.torque - 0.5).abs() < 3e-3);
    }

    #[test]
    fn the_middle_and_the_ends_are_those_of_the_makers() {
        // The makers' float_to_uint: 0 of a symmetric span is half of 2^16 - 1, and a value beyond the span is its end.
        assert_eq!(command(&[-12.5, -30.0, 0.0, 0.0, -10.0], &SPANS), [0; 8]);
        assert_eq!(command(&[99.0, 99.0, 999.0, 99.0, 99.0], &SPANS), [0xff; 8]);
        assert_eq!(command(&[f64::NAN; 5], &SPANS), command(&[0.0; 5], &SPANS));
    }
}
