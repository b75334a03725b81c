//! A bus of Dynamixel servos: one synchronous write and one synchronous read a cycle.

use super::frame::{ANSWER_OVERHEAD, BROADCAST, Found, Frame, OVERHEAD, instruction, take};
use super::registers as r;
use crate::bus::{Abilities, Bus, BusError, Counts, Goal, Identity, Reading};
use crate::file::{DeviceFile, Joint, Takes};
use crate::serial::{Port, wire_time};
use std::time::{Duration, Instant};

/// Time without an instruction after which a servo stops by itself, in its unit of 20 ms.
const WATCHDOG_COUNTS: u8 = 1;

/// A bus of Dynamixel servos.
pub struct Dynamixel {
    port: Port,
    joints: Vec<Joint>,
    timeout: Duration,
    retries: u32,
    counts: Counts,
    bytes: Vec<u8>,
}

impl Dynamixel {
    /// Opens the port of a device's file.
    ///
    /// # Errors
    /// The port cannot be opened.
    pub fn open(file: &DeviceFile) -> Result<Dynamixel, BusError> {
        Ok(Dynamixel {
            port: Port::open(&file.port, file.baud)?,
            joints: file.joints.clone(),
            timeout: Duration::from_secs_f64(file.timeout_s),
            retries: file.retries,
            counts: Counts::default(),
            bytes: Vec::new(),
        })
    }

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

    /// What came before a question is the answer to none.
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

    fn send(&mut self, id: u8, code: u8, parameters: Vec<u8>) -> Result<usize, BusError> {
        let bytes = Frame { id, code, parameters }.bytes();
        self.port.send(&bytes)?;
        Ok(bytes.len())
    }

    /// One question to one servo; the answer without its error byte, and that byte.
    fn ask(&mut self, id: u8, code: u8, parameters: &[u8], answer: usize) -> Result<Option<(Vec<u8>, u8)>, BusError> {
        for attempt in 0..=self.retries {
            self.clear()?;
            self.counts.asked += 1;
            self.counts.retries += u64::from(attempt > 0);
            let sent = self.send(id, code, parameters.to_vec())?;
            let deadline = Instant::now() + wire_time(sent + ANSWER_OVERHEAD + answer, self.port.baud()) + self.timeout;
            while let Some(mut frame) = self.next(deadline)? {
                if frame.id == id && frame.code == instruction::STATUS && frame.parameters.len() == answer + 1 {
                    self.counts.answered += 1;
                    let error = frame.parameters.remove(0);
                    return Ok(Some((frame.parameters, error)));
                }
                self.counts.strange += 1;
            }
        }
        self.counts.silent += 1;
        Ok(None)
    }

    fn set(&mut self, joint: usize, register: u16, values: &[u8]) -> Result<(), BusError> {
        let mut parameters = register.to_le_bytes().to_vec();
        parameters.extend_from_slice(values);
        match self.ask(self.joints[joint].id as u8, instruction::WRITE, &parameters, 0)? {
            None => Err(self.silent(joint)),
            // The high bit is an alert about the hardware, which reading reports.
            Some((_, error)) if error & 0x7f != 0 => Err(BusError::Cannot(format!(
                "{}: id {} refuses to write register {register} (error {error}); does it know this mode? \
                 a mode is changed with torque off",
                self.port.name(),
                self.joints[joint].id
            ))),
            Some(_) => Ok(()),
        }
    }

    fn silent(&self, joint: usize) -> BusError {
        BusError::Silent { port: self.port.name().to_string(), id: self.joints[joint].id }
    }

    fn reading(&self, index: usize, p: &[u8], error: u8) -> Reading {
        let joint = &self.joints[index];
        let long = |at: usize| i32::from_le_bytes([p[at], p[at + 1], p[at + 2], p[at + 3]]);
        let counts = f64::from(i16::from_le_bytes([p[0], p[1]]));
        // Its unit depends on the model: without one the current is not known.
        let current = joint.model.map(|model| counts * r::ampere(Some(model)));
        let direction = joint.per_count.signum();
        // Per count of position a turn is `per_count` times its counts; its velocity counts are of the shaft.
        let per_rad = joint.per_count.abs() * 4096.0 / std::f64::consts::TAU;
        Reading {
            position: Some(joint.position(f64::from(long(6)))),
            velocity: Some(f64::from(long(2)) * r::RAD_PER_S * direction * per_rad),
            effort: joint
                .torque_constant
                .filter(|_| joint.current_signed)
                .zip(current)
                .map(|(constant, current)| constant * current * direction),
            current: current.map(|current| if joint.current_signed { current } else { current.abs() }),
            temperature: Some(f64::from(p[20])),
            status: u32::from(error),
        }
    }

    /// The registers and the bytes of a goal.
    fn goal(&self, index: usize, goal: Goal) -> Option<Vec<u8>> {
        let joint = &self.joints[index];
        match (goal, joint.takes) {
            (Goal::Position(position), Takes::Position) if position.is_finite() => {
                let count = joint.count(position.clamp(joint.range[0], joint.range[1])).round();
                Some((count as i32).to_le_bytes().to_vec())
            }
            (Goal::Effort(effort), Takes::Effort) if effort.is_finite() => {
                let most = joint.effort.unwrap_or(0.0);
                let constant = joint.torque_constant.unwrap_or(f64::INFINITY) * joint.per_count.signum();
                let counts = (effort.clamp(-most, most) / constant / r::ampere(joint.model)).round();
                Some((counts as i16).to_le_bytes().to_vec())
            }
            _ => None,
        }
    }

    fn takes(&self) -> Takes {
        self.joints.first().map_or(Takes::Nothing, |joint| joint.takes)
    }
}

impl Bus for Dynamixel {
    fn joints(&self) -> usize {
        self.joints.len()
    }

    fn abilities(&self, joint: usize) -> Abilities {
        let joint = &self.joints[joint];
        Abilities {
            takes_position: joint.takes == Takes::Position,
            takes_effort: joint.takes == Takes::Effort,
            current_is_signed: joint.current_signed,
        }
    }

    fn identify(&mut self, joint: usize) -> Result<Identity, BusError> {
        let id = self.joints[joint].id;
        let (found, _) = self.ask(id as u8, instruction::PING, &[], 3)?.ok_or_else(|| self.silent(joint))?;
        let model = Some(u32::from(u16::from_le_bytes([found[0], found[1]])));
        // The unit of its current depends on it.
        self.joints[joint].model = self.joints[joint].model.or(model);
        Ok(Identity { id, model })
    }

    fn read(&mut self, readings: &mut [Reading]) -> Result<(), BusError> {
        readings.fill(Reading::default());
        let block = usize::from(r::PRESENT_BYTES);
        let mut parameters = r::PRESENT.to_le_bytes().to_vec();
        parameters.extend(r::PRESENT_BYTES.to_le_bytes());
        parameters.extend(self.joints.iter().map(|joint| joint.id as u8));
        self.clear()?;
        self.counts.asked += self.joints.len() as u64;
        let sent = self.send(BROADCAST, instruction::SYNC_READ, parameters)?;
        let answers = self.joints.len() * (ANSWER_OVERHEAD + block);
        let deadline = Instant::now() + wire_time(sent + answers, self.port.baud()) + self.timeout;
        let mut left = self.joints.len();
        while left > 0 {
            let Some(frame) = self.next(deadline)? else { break };
            let asked = self.joints.iter().position(|joint| joint.id == u32::from(frame.id));
            let fits = frame.code == instruction::STATUS && frame.parameters.len() == block + 1;
            match asked.filter(|i| fits && readings[*i].position.is_none()) {
                Some(index) => {
                    self.counts.answered += 1;
                    readings[index] = self.reading(index, &frame.parameters[1..], frame.parameters[0]);
                    left -= 1;
                }
                None => self.counts.strange += 1,
            }
        }
        // One that was silent is asked once more alone.
        let mut question = r::PRESENT.to_le_bytes().to_vec();
        question.extend(r::PRESENT_BYTES.to_le_bytes());
        for index in 0..self.joints.len() {
            if readings[index].position.is_some() {
                continue;
            }
            if self.retries == 0 {
                self.counts.silent += 1;
                continue;
            }
            self.counts.retries += 1;
            let kept = std::mem::replace(&mut self.retries, 0);
            let answer = self.ask(self.joints[index].id as u8, instruction::READ, &question, block);
            self.retries = kept;
            if let Some((values, error)) = answer? {
                readings[index] = self.reading(index, &values, error);
            }
        }
        Ok(())
    }

    fn write(&mut self, goals: &[Goal]) -> Result<(), BusError> {
        let (register, bytes) = match self.takes() {
            Takes::Position => (r::GOAL_POSITION, 4u16),
            Takes::Effort => (r::GOAL_CURRENT, 2),
            Takes::Nothing => return Ok(()),
        };
        let mut parameters = register.to_le_bytes().to_vec();
        parameters.extend(bytes.to_le_bytes());
        for (index, goal) in goals.iter().enumerate().take(self.joints.len()) {
            if let Some(values) = self.goal(index, *goal) {
                parameters.push(self.joints[index].id as u8);
                parameters.extend(values);
            }
        }
        if parameters.len() > 4 { self.send(BROADCAST, instruction::SYNC_WRITE, parameters).map(|_| ()) } else { Ok(()) }
    }

    fn engage(&mut self, present: &[Reading]) -> Result<(), BusError> {
        for index in 0..self.joints.len() {
            if self.joints[index].model.is_none() {
                self.identify(index)?;
            }
            // A mode is changed with torque off, and a watchdog that has barked is reset by 0.
            self.set(index, r::TORQUE, &[0])?;
            self.set(index, r::WATCHDOG, &[0])?;
            let Some(position) = present.get(index).and_then(|read| read.position) else { return Err(self.silent(index)) };
            match self.joints[index].takes {
                Takes::Nothing => continue,
                Takes::Position => {
                    self.set(index, r::MODE, &[r::MODE_POSITION])?;
                    let goal = self.goal(index, Goal::Position(position)).unwrap_or_default();
                    self.set(index, r::GOAL_POSITION, &goal)?;
                    self.set(index, r::TORQUE, &[1])?;
                }
                Takes::Effort => {
                    self.set(index, r::MODE, &[r::MODE_CURRENT])?;
                    self.set(index, r::GOAL_CURRENT, &[0, 0])?;
                    self.set(index, r::TORQUE, &[1])?;
                    // The servo itself takes the torque away where this process dies.
                    self.set(index, r::WATCHDOG, &[WATCHDOG_COUNTS])?;
                }
            }
        }
        Ok(())
    }

    fn release(&mut self) -> Result<(), BusError> {
        let mut failed = Ok(());
        for index in 0..self.joints.len() {
            for register in [r::WATCHDOG, r::TORQUE] {
                // One that is silent does not keep the others on.
                if let Err(error @ BusError::Port { .. }) = self.set(index, register, &[0]) {
                    failed = Err(error);
                }
            }
        }
        failed
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn wire_time(&self) -> Duration {
        let n = self.joints.len();
        let write = match self.takes() {
            Takes::Position => OVERHEAD + 4 + 5 * n,
            Takes::Effort => OVERHEAD + 4 + 3 * n,
            Takes::Nothing => 0,
        };
        let read = OVERHEAD + 4 + n + n * (ANSWER_OVERHEAD + usize::from(r::PRESENT_BYTES));
        wire_time(write + read, self.port.baud())
    }
}
