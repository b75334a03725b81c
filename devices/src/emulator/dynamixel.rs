//! The registers of emulated Dynamixel servos, and their answers.

use super::servo::{Drive, Servo};
use super::speaker::Speaker;
use crate::dynamixel::frame::{BROADCAST, Found, Frame, crc, instruction, take};
use crate::dynamixel::registers as r;
use std::time::{Duration, Instant};

/// Error of an access that is not possible.
const ACCESS_ERROR: u8 = 7;

struct Registers {
    written: [u8; 256],
    /// When the last instruction came.
    heard_at: Instant,
}

/// Dynamixel servos on a wire.
pub struct DynamixelServos {
    servos: Vec<Servo>,
    registers: Vec<Registers>,
}

impl DynamixelServos {
    /// As they come: motors off, position mode.
    pub fn new(servos: Vec<Servo>) -> DynamixelServos {
        let fresh = || {
            let mut written = [0; 256];
            written[usize::from(r::MODE)] = r::MODE_POSITION;
            Registers { written, heard_at: Instant::now() }
        };
        DynamixelServos { registers: servos.iter().map(|_| fresh()).collect(), servos }
    }

    /// Writes registers; the error of the answer.
    fn write(&mut self, i: usize, address: u16, values: &[u8]) -> u8 {
        let (registers, servo) = (&mut self.registers[i], &mut self.servos[i]);
        let at = usize::from(address);
        let Some(place) = registers.written.get_mut(at..at + values.len()) else { return ACCESS_ERROR };
        if address == r::MODE && place != values && !servo.is_off() {
            return ACCESS_ERROR;
        }
        place.copy_from_slice(values);
        let written = &registers.written;
        let on = written[usize::from(r::TORQUE)] == 1;
        let word = |at: u16| [written[usize::from(at)], written[usize::from(at) + 1]];
        let touched = |first: u16, count: u16| address < first + count && usize::from(first) < at + values.len();
        match written[usize::from(r::MODE)] {
            _ if !on && !servo.is_off() => servo.set(Drive::Off),
            _ if !on => {}
            r::MODE_CURRENT if touched(r::GOAL_CURRENT, 2) || touched(r::TORQUE, 1) => {
                let counts = i16::from_le_bytes(word(r::GOAL_CURRENT));
                let current = f64::from(counts) * r::ampere(Some(servo.file().model_number));
                servo.set(Drive::Effort(current * servo.file().torque_constant));
            }
            r::MODE_POSITION if touched(r::GOAL_POSITION, 4) || touched(r::TORQUE, 1) => {
                let (low, high) = (word(r::GOAL_POSITION), word(r::GOAL_POSITION + 2));
                servo.set(Drive::Position(f64::from(i32::from_le_bytes([low[0], low[1], high[0], high[1]]))));
            }
            _ => {}
        }
        0
    }

    fn read(&self, i: usize, address: u16, count: u16) -> Option<Vec<u8>> {
        let servo = &self.servos[i];
        let mut all = self.registers[i].written;
        let mut put = |at: u16, bytes: &[u8]| all[usize::from(at)..usize::from(at) + bytes.len()].copy_from_slice(bytes);
        let present = servo.present();
        put(r::MODEL, &(servo.file().model_number as u16).to_le_bytes());
        let counts = (present.current / r::ampere(Some(servo.file().model_number))).round();
        put(r::PRESENT, &(counts as i16).to_le_bytes());
        let speed = present.velocity * std::f64::consts::TAU / servo.file().counts_per_turn / r::RAD_PER_S;
        put(r::PRESENT + 2, &(speed.round() as i32).to_le_bytes());
        put(r::PRESENT + 6, &present.position.to_le_bytes());
        put(r::PRESENT + 18, &74u16.to_le_bytes());
        put(r::PRESENT + 20, &[present.temperature.clamp(0.0, 255.0) as u8]);
        let from = usize::from(address);
        all.get(from..from + usize::from(count)).map(<[u8]>::to_vec)
    }

    /// A servo whose watchdog is on stops by itself where nobody speaks to it.
    fn watch(&mut self) {
        for (servo, registers) in self.servos.iter_mut().zip(&mut self.registers) {
            let counts = registers.written[usize::from(r::WATCHDOG)];
            if counts > 0 && registers.heard_at.elapsed() > Duration::from_millis(20) * u32::from(counts) && !servo.is_off() {
                servo.set(Drive::Off);
            }
        }
    }

    fn answer(&mut self, frame: &Frame) -> Vec<Frame> {
        let status = |id: u8, error: u8, values: &[u8]| {
            let mut parameters = vec![error];
            parameters.extend_from_slice(values);
            Frame { id, code: instruction::STATUS, parameters }
        };
        let at = |servos: &[Servo], id: u8| servos.iter().position(|s| s.id() == u32::from(id));
        self.registers.iter_mut().for_each(|registers| registers.heard_at = Instant::now());
        let mut out = Vec::new();
        let word = |low: &u8, high: &u8| u16::from_le_bytes([*low, *high]);
        match (frame.code, frame.parameters.as_slice()) {
            (instruction::SYNC_WRITE, [a, b, c, d, rest @ ..]) if word(c, d) > 0 => {
                for each in rest.chunks_exact(usize::from(word(c, d)) + 1) {
                    if let Some(i) = at(&self.servos, each[0]) {
                        self.write(i, word(a, b), &each[1..]);
                    }
                }
            }
            (instruction::SYNC_READ, [a, b, c, d, ids @ ..]) => {
                for id in ids {
                    let values = at(&self.servos, *id).and_then(|i| self.read(i, word(a, b), word(c, d)));
                    out.extend(values.map(|values| status(*id, 0, &values)));
                }
            }
            (code, p) => {
                for i in 0..self.servos.len() {
                    let id = self.servos[i].id() as u8;
                    if id != frame.id && frame.id != BROADCAST {
                        continue;
                    }
                    let answer = match (code, p) {
                        (instruction::PING, _) => {
                            let [low, high] = (self.servos[i].file().model_number as u16).to_le_bytes();
                            Some(status(id, 0, &[low, high, 45]))
                        }
                        (instruction::READ, [a, b, c, d]) => Some(match self.read(i, word(a, b), word(c, d)) {
                            Some(values) => status(id, 0, &values),
                            None => status(id, ACCESS_ERROR, &[]),
                        }),
                        (instruction::WRITE, [a, b, values @ ..]) => {
                            let error = self.write(i, word(a, b), values);
                            Some(status(id, error, &[]))
                        }
                        _ => None,
                    };
                    out.extend(answer.filter(|_| frame.id != BROADCAST || code == instruction::PING));
                }
            }
        }
        out
    }
}

impl Speaker for DynamixelServos {
    fn servos(&mut self) -> &mut [Servo] {
        self.watch();
        &mut self.servos
    }

    fn answers(&mut self, heard: &mut Vec<u8>) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        loop {
            match take(heard) {
                Found::Frame(frame) if frame.code != instruction::STATUS => {
                    out.extend(self.answer(&frame).iter().map(Frame::bytes));
                }
                Found::Frame(_) | Found::Corrupt | Found::Noise(_) => {}
                Found::Nothing => return out,
            }
        }
    }

    fn of_another(&self, answer: &mut [u8]) {
        let end = answer.len() - 2;
        answer[4] = answer[4].wrapping_add(101);
        let sum = crc(&answer[..end]).to_le_bytes();
        answer[end..].copy_from_slice(&sum);
    }

    fn spoilt(&self, answer: &mut [u8]) -> bool {
        if let Some(last) = answer.last_mut() {
            *last ^= 0xff;
        }
        true
    }

    fn bits_per_byte(&self) -> f64 {
        10.0
    }
}
