//! The registers of emulated Feetech servos: which answer a frame has.

use super::servo::{Drive, Servo};
use super::speaker::Speaker;
use crate::feetech::frame::{BROADCAST, Found, Frame, checksum, instruction, take};
use crate::feetech::registers::{AMPERE, GOAL, ID, MODE, MODEL, Order, PRESENT, TORQUE, signed, unsigned};
use crate::file::Protocol;

/// The registers of a servo that a user has written.
#[derive(Debug, Clone)]
struct Registers {
    written: [u8; 256],
    order: Order,
}

impl Registers {
    /// As a servo comes: its motor off, its goal at the middle.
    fn new(order: Order) -> Registers {
        Registers { written: [0; 256], order }
    }

    fn write(&mut self, servo: &mut Servo, address: u8, values: &[u8]) {
        for (at, value) in (usize::from(address)..256).zip(values) {
            self.written[at] = *value;
        }
        let touched = |first: u8, count: u8| address < first + count && usize::from(first) < usize::from(address) + values.len();
        if !(touched(GOAL, 2) || touched(TORQUE, 1)) {
            return;
        }
        let goal = self.order.word([self.written[usize::from(GOAL)], self.written[usize::from(GOAL) + 1]]);
        let on = self.written[usize::from(TORQUE)] == 1;
        servo.set(if on { Drive::Position(f64::from(signed(goal, 15))) } else { Drive::Off });
    }

    fn read(&self, servo: &Servo, address: u8, count: u8) -> Vec<u8> {
        let mut all = self.written;
        let mut put = |at: u8, bytes: [u8; 2]| all[usize::from(at)..usize::from(at) + 2].copy_from_slice(&bytes);
        let present = servo.present();
        put(MODEL, self.order.bytes(servo.file().model_number as u16));
        put(PRESENT, self.order.bytes(unsigned(present.position, 15)));
        put(PRESENT + 2, self.order.bytes(unsigned(present.velocity.round() as i32, 15)));
        let load = 1000.0 * present.effort / servo.file().torque_limit;
        put(PRESENT + 4, self.order.bytes(unsigned(load.round() as i32, 10)));
        // As the real one: a magnitude.
        put(PRESENT + 13, self.order.bytes((present.current.abs() / AMPERE).round().min(32_767.0) as u16));
        all[usize::from(ID)] = servo.id() as u8;
        all[usize::from(MODE)] = 0;
        all[usize::from(PRESENT) + 6] = 74;
        all[usize::from(PRESENT) + 7] = present.temperature.clamp(0.0, 255.0) as u8;
        let end = (usize::from(address) + usize::from(count)).min(256);
        all[usize::from(address)..end].to_vec()
    }
}

/// The answers to a frame, in the order in which they are sent.
fn answers(frame: &Frame, servos: &mut [Servo], registers: &mut [Registers], reads_together: bool) -> Vec<Frame> {
    let p = frame.parameters.as_slice();
    let mut out = Vec::new();
    match (frame.code, p) {
        (instruction::SYNC_WRITE, [address, count, rest @ ..]) if *count > 0 => {
            for each in rest.chunks_exact(usize::from(*count) + 1) {
                if let Some(i) = servos.iter().position(|s| s.id() == u32::from(each[0])) {
                    registers[i].write(&mut servos[i], *address, &each[1..]);
                }
            }
        }
        (instruction::SYNC_READ, [address, count, ids @ ..]) if reads_together => {
            for id in ids {
                if let Some(i) = servos.iter().position(|s| s.id() == u32::from(*id)) {
                    out.push(Frame { id: *id, code: 0, parameters: registers[i].read(&servos[i], *address, *count) });
                }
            }
        }
        (code, p) => {
            for i in 0..servos.len() {
                if servos[i].id() != u32::from(frame.id) && frame.id != BROADCAST {
                    continue;
                }
                let id = servos[i].id() as u8;
                let parameters = match (code, p) {
                    (instruction::PING, _) => Some(Vec::new()),
                    (instruction::READ, [address, count]) => Some(registers[i].read(&servos[i], *address, *count)),
                    (instruction::WRITE, [address, values @ ..]) => {
                        registers[i].write(&mut servos[i], *address, values);
                        Some(Vec::new())
                    }
                    _ => None,
                };
                // Nobody answers a broadcast, except a ping.
                let answers = frame.id != BROADCAST || code == instruction::PING;
                out.extend(parameters.filter(|_| answers).map(|parameters| Frame { id, code: 0, parameters }));
            }
        }
    }
    out
}

/// Feetech servos on a wire.
pub struct FeetechServos {
    servos: Vec<Servo>,
    registers: Vec<Registers>,
    reads_together: bool,
}

impl FeetechServos {
    /// Servos of the STS or the SCS series.
    pub fn new(servos: Vec<Servo>, protocol: Protocol) -> FeetechServos {
        let sts = protocol == Protocol::FeetechSts;
        let registers = Registers::new(if sts { Order::LittleEnd } else { Order::BigEnd });
        FeetechServos { registers: vec![registers; servos.len()], servos, reads_together: sts }
    }
}

impl Speaker for FeetechServos {
    fn servos(&mut self) -> &mut [Servo] {
        &mut self.servos
    }

    fn answers(&mut self, heard: &mut Vec<u8>) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        loop {
            match take(heard) {
                Found::Frame(frame) => {
                    let all = answers(&frame, &mut self.servos, &mut self.registers, self.reads_together);
                    out.extend(all.iter().map(Frame::bytes));
                }
                Found::Corrupt | Found::Noise(_) => {}
                Found::Nothing => return out,
            }
        }
    }

    fn of_another(&self, answer: &mut [u8]) {
        let last = answer.len() - 1;
        answer[2] = answer[2].wrapping_add(101);
        answer[last] = checksum(&answer[2..last]);
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
