//! Emulated MIT motors: they answer each frame with their state.

use super::servo::{Drive, Servo};
use super::speaker::Speaker;
use crate::mit::can::{CanFrame, FRAME_BITS, FRAME_BYTES};
use crate::mit::frame::{DISABLE, ENABLE, State, answer, command_of};
use std::time::{Duration, Instant};

/// Id of the frames that motors send: that of the master.
const MASTER_ID: u32 = 0x7f0;
/// Ends of position, velocity and torque.
const SPANS: [f64; 3] = [12.5, 30.0, 10.0];
/// A motor that hears nothing for this long turns itself off.
const PATIENCE: Duration = Duration::from_millis(100);

/// MIT motors on a wire.
pub struct MitMotors {
    servos: Vec<Servo>,
    on: Vec<bool>,
    heard_at: Instant,
}

impl MitMotors {
    /// As they come: off.
    pub fn new(servos: Vec<Servo>) -> MitMotors {
        MitMotors { on: vec![false; servos.len()], servos, heard_at: Instant::now() }
    }
}

impl Speaker for MitMotors {
    fn servos(&mut self) -> &mut [Servo] {
        if self.heard_at.elapsed() > PATIENCE && self.on.contains(&true) {
            self.on.fill(false);
            self.servos.iter_mut().for_each(|servo| servo.set(Drive::Off));
        }
        &mut self.servos
    }

    fn answers(&mut self, heard: &mut Vec<u8>) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        for bytes in heard.chunks(FRAME_BYTES) {
            let Some(frame) = CanFrame::of(bytes) else { continue };
            let Some(i) = self.servos.iter().position(|s| s.id() == frame.id) else { continue };
            self.heard_at = Instant::now();
            let servo = &mut self.servos[i];
            match frame.data {
                ENABLE => self.on[i] = true,
                DISABLE => {
                    self.on[i] = false;
                    servo.set(Drive::Off);
                }
                data if self.on[i] => servo.set(Drive::Impedance(command_of(&data, &SPANS))),
                _ => {}
            }
            let ((position, velocity), present) = (servo.seen_motion(), servo.present());
            let (id, status) = ((frame.id & 0xf) as u8, u8::from(self.on[i]));
            let state = State { id, status, position, velocity, torque: present.effort, temperature: present.temperature };
            out.push(CanFrame { id: MASTER_ID, data: answer(&state, &SPANS) }.bytes().to_vec());
        }
        heard.clear();
        out
    }

    fn of_another(&self, answer: &mut [u8]) {
        answer[8] = (answer[8] & 0xf0) | ((answer[8] + 7) & 0xf);
    }

    fn spoilt(&self, _answer: &mut [u8]) -> bool {
        false
    }

    fn bits_per_byte(&self) -> f64 {
        FRAME_BITS / FRAME_BYTES as f64
    }
}
