//! A bus of Feetech servos: one synchronous write and one synchronous read a cycle.

use super::frame::{BROADCAST, Found, Frame, OVERHEAD, instruction, take};
use super::registers::{AMPERE, GOAL, MODE, MODEL, Order, PRESENT, PRESENT_BYTES, PRESENT_BYTES_SCS, TORQUE, signed, unsigned};
use crate::bus::{Abilities, Bus, BusError, Counts, Goal, Identity, Reading};
use crate::file::{DeviceFile, Joint, Protocol, Takes};
use crate::serial::{Port, wire_time};
use std::time::{Duration, Instant};

/// A bus of Feetech servos.
pub struct Feetech {
    port: Port,
    joints: Vec<Joint>,
    order: Order,
    /// Whether the servos know the synchronous read.
    reads_together: bool,
    timeout: Duration,
    retries: u32,
    counts: Counts,
    bytes: Vec<u8>,
}

impl Feetech {
    /// Opens the port of a device's file.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub fn open(file: &DeviceFile) -> Result<Feetech, BusError> {
        let sts = file.protocol == Protocol::FeetechSts;
        Ok(Feetech {
            port: Port::open(&file.port, file.baud)?,
            joints: file.joints.clone(),
            order: if sts { Order::LittleEnd } else { Order::BigEnd },
            reads_together: sts,
            timeout: Duration::from_secs_f64(file.timeout_s),
            retries: file.retries,
            counts: Counts::default(),
            bytes: Vec::new(),
        })
    }

    fn present_bytes(&self) -> u8 {
        if self.reads_together { PRESENT_BYTES } else { PRESENT_BYTES_SCS }
    }

    fn send(&mut self, id: u8, code: u8, parameters: Vec<u8>) -> Result<(), BusError> {
        self.port.send(&Frame { id, code, parameters }.bytes())
    }

    /// The next frame until the deadline; everything else is counted.
    fn next(&mut self, deadline: Instant) -> Result<Option<Frame>, BusError> {
        loop {
            match take(&mut self.bytes) {
                Found::Frame(frame) => return Ok(Some(frame)),
                Found::Corrupt => self.counts.corrupt += 1,
                Found::Noise(bytes) => self.counts.noise += bytes as u64,
                Found::Nothing => {
                    if !self.port.receive(&mut self.bytes, deadline)? {
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// What came before a question is the answer to none: an answer that was late, or a second one.
    fn clear(&mut self) -> Result<(), BusError> {
        self.port.receive(&mut self.bytes, Instant::now())?;
        while !self.bytes.is_empty() {
            match take(&mut self.bytes) {
                Found::Frame(_) => self.counts.strange += 1,
                Found::Corrupt => self.counts.corrupt += 1,
                Found::Noise(bytes) => self.counts.noise += bytes as u64,
                Found::Nothing => {
                    self.counts.noise += self.bytes.len() as u64;
                    self.bytes.clear();
                }
            }
        }
        Ok(())
    }

    /// One question to one servo, asked again where nobody answers.
    fn ask(&mut self, id: u8, code: u8, parameters: &[u8], answer: usize) -> Result<Option<Frame>, BusError> {
        for attempt in 0..=self.retries {
            self.clear()?;
            self.counts.asked += 1;
            self.counts.retries += u64::from(attempt > 0);
            self.send(id, code, parameters.to_vec())?;
            let on_wire = wire_time(2 * OVERHEAD + parameters.len() + answer, self.port.baud());
            let deadline = Instant::now() + on_wire + self.timeout;
            while let Some(frame) = self.next(deadline)? {
                if frame.id == id && frame.parameters.len() == answer {
                    self.counts.answered += 1;
                    return Ok(Some(frame));
                }
                self.counts.strange += 1;
            }
        }
        self.counts.silent += 1;
        Ok(None)
    }

    /// Reads all servos with one question; which answered.
    fn read_together(&mut self, readings: &mut [Reading]) -> Result<(), BusError> {
        let mut parameters = vec![PRESENT, PRESENT_BYTES];
        parameters.extend(self.joints.iter().map(|joint| joint.id as u8));
        self.clear()?;
        self.counts.asked += self.joints.len() as u64;
        let answers = self.joints.len() * (OVERHEAD + usize::from(PRESENT_BYTES));
        let on_wire = wire_time(OVERHEAD + parameters.len() + answers, self.port.baud());
        self.send(BROADCAST, instruction::SYNC_READ, parameters)?;
        let deadline = Instant::now() + on_wire + self.timeout;
        let mut left = self.joints.len();
        while left > 0 {
            let Some(frame) = self.next(deadline)? else { break };
            let asked = self.joints.iter().position(|joint| joint.id == u32::from(frame.id));
            match asked.filter(|i| frame.parameters.len() == usize::from(PRESENT_BYTES) && readings[*i].position.is_none()) {
                Some(index) => {
                    self.counts.answered += 1;
                    readings[index] = self.reading(index, &frame);
                    left -= 1;
                }
                None => self.counts.strange += 1,
            }
        }
        Ok(())
    }

    fn reading(&self, index: usize, frame: &Frame) -> Reading {
        let (joint, p) = (&self.joints[index], &frame.parameters);
        let word = |at: usize| self.order.word([p[at], p[at + 1]]);
        let current = (p.len() >= usize::from(PRESENT_BYTES)).then(|| {
            let counts = signed(word(13), 15);
            f64::from(if joint.current_signed { counts } else { counts.abs() }) * AMPERE
        });
        let effort = current.zip(joint.torque_constant).filter(|_| joint.current_signed);
        Reading {
            position: Some(joint.position(f64::from(signed(word(0), 15)))),
            velocity: Some(f64::from(signed(word(2), 15)) * joint.per_count),
            effort: effort.map(|(current, constant)| current * constant * joint.per_count.signum()),
            current,
            temperature: Some(f64::from(p[7])),
            status: u32::from(frame.code),
        }
    }

    fn set(&mut self, joint: usize, register: u8, values: &[u8]) -> Result<bool, BusError> {
        let mut parameters = vec![register];
        parameters.extend_from_slice(values);
        Ok(self.ask(self.joints[joint].id as u8, instruction::WRITE, &parameters, 0)?.is_some())
    }

    fn goal_bytes(&self, joint: usize, position: f64) -> [u8; 2] {
        let joint = &self.joints[joint];
        let count = joint.count(position.clamp(joint.range[0], joint.range[1])).round();
        self.order.bytes(unsigned(count as i32, 15))
    }

    fn silent(&self, joint: usize) -> BusError {
        BusError::Silent { port: self.port.name().to_string(), id: self.joints[joint].id }
    }
}

impl Bus for Feetech {
    fn joints(&self) -> usize {
        self.joints.len()
    }

    fn abilities(&self, joint: usize) -> Abilities {
        let joint = &self.joints[joint];
        Abilities { takes_position: joint.takes == Takes::Position, takes_effort: false, current_is_signed: joint.current_signed }
    }

    fn identify(&mut self, joint: usize) -> Result<Identity, BusError> {
        let id = self.joints[joint].id;
        let answer = self.ask(id as u8, instruction::READ, &[MODEL, 2], 2)?.ok_or_else(|| self.silent(joint))?;
        let model = self.order.word([answer.parameters[0], answer.parameters[1]]);
        Ok(Identity { id, model: Some(u32::from(model)) })
    }

    fn read(&mut self, readings: &mut [Reading]) -> Result<(), BusError> {
        readings.fill(Reading::default());
        if self.reads_together {
            self.read_together(readings)?;
        }
        for index in 0..self.joints.len() {
            if readings[index].position.is_some() {
                continue;
            }
            // One that was silent in the synchronous read is asked once more alone.
            if self.reads_together && self.retries == 0 {
                self.counts.silent += 1;
                continue;
            }
            self.counts.retries += u64::from(self.reads_together);
            let (id, bytes) = (self.joints[index].id as u8, self.present_bytes());
            let kept = self.retries;
            self.retries = if self.reads_together { kept - 1 } else { kept };
            let answer = self.ask(id, instruction::READ, &[PRESENT, bytes], usize::from(bytes));
            self.retries = kept;
            if let Some(frame) = answer? {
                readings[index] = self.reading(index, &frame);
            }
        }
        Ok(())
    }

    fn write(&mut self, goals: &[Goal]) -> Result<(), BusError> {
        let mut parameters = vec![GOAL, 2];
        for (index, goal) in goals.iter().enumerate().take(self.joints.len()) {
            if let (Goal::Position(position), Takes::Position) = (goal, self.joints[index].takes)
                && position.is_finite()
            {
                parameters.push(self.joints[index].id as u8);
                parameters.extend(self.goal_bytes(index, *position));
            }
        }
        if parameters.len() > 2 { self.send(BROADCAST, instruction::SYNC_WRITE, parameters) } else { Ok(()) }
    }

    fn engage(&mut self, present: &[Reading]) -> Result<(), BusError> {
        for index in 0..self.joints.len() {
            if self.joints[index].takes != Takes::Position {
                // A hand shall move it: its motor is off.
                if !self.set(index, TORQUE, &[0])? {
                    return Err(self.silent(index));
                }
                continue;
            }
            let Some(position) = present.get(index).and_then(|r| r.position) else { return Err(self.silent(index)) };
            let mode = self.ask(self.joints[index].id as u8, instruction::READ, &[MODE, 1], 1)?.ok_or_else(|| self.silent(index))?;
            if self.reads_together && mode.parameters[0] != 0 {
                return Err(BusError::Cannot(format!(
                    "{}: id {} is in mode {}, not a position servo (0); set register {MODE} to 0 with the maker's tool",
                    self.port.name(),
                    self.joints[index].id,
                    mode.parameters[0]
                )));
            }
            let goal = self.goal_bytes(index, position);
            if !(self.set(index, GOAL, &goal)? && self.set(index, TORQUE, &[1])?) {
                return Err(self.silent(index));
            }
        }
        Ok(())
    }

    fn release(&mut self) -> Result<(), BusError> {
        for index in 0..self.joints.len() {
            self.set(index, TORQUE, &[0])?;
        }
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn wire_time(&self) -> Duration {
        let (n, baud) = (self.joints.len(), self.port.baud());
        let goals = self.joints.iter().filter(|joint| joint.takes == Takes::Position).count();
        let write = if goals > 0 { OVERHEAD + 2 + 3 * goals } else { 0 };
        let answers = n * (OVERHEAD + usize::from(self.present_bytes()));
        let questions = if self.reads_together { OVERHEAD + 2 + n } else { n * (OVERHEAD + 2) };
        wire_time(write + questions + answers, baud)
    }
}
