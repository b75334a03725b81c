//! A bus of MIT motors: each is sent its goal and answers with its state, one after the other.

use super::can::{Can, CanFrame, FRAME_BITS};
use super::frame::{Command, DISABLE, ENABLE, State, command, state_of};
use crate::bus::{Abilities, Bus, BusError, Counts, Goal, Identity, Reading};
use crate::file::{DeviceFile, Joint, Takes};
use std::time::{Duration, Instant};

/// A bus of MIT motors.
pub struct Mit {
    can: Can,
    joints: Vec<Joint>,
    commands: Vec<Command>,
    bit_rate: f64,
    timeout: Duration,
    retries: u32,
    counts: Counts,
}

impl Mit {
    /// Opens the interface or socket of a device's file.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(file: &DeviceFile) -> Result<Mit, BusError> {
        Ok(Mit {
            can: Can::open(&file.port)?,
            commands: vec![[0.0; 5]; file.joints.len()],
            joints: file.joints.clone(),
            bit_rate: f64::from(file.baud),
            timeout: Duration::from_secs_f64(file.timeout_s),
            retries: file.retries,
            counts: Counts::default(),
        })
    }

    /// Sends a frame to a motor; its state.
    fn ask(&mut self, joint: usize, data: [u8; 8]) -> Result<Option<State>, BusError> {
        let (id, spans) = (self.joints[joint].id, self.joints[joint].spans);
        for attempt in 0..=self.retries {
            while self.can.receive(Instant::now())?.is_some() {
                self.counts.strange += 1;
            }
            self.counts.asked += 1;
            self.counts.retries += u64::from(attempt > 0);
            self.can.send(&CanFrame { id, data })?;
            let deadline = Instant::now() + Duration::from_secs_f64(2.0 * FRAME_BITS / self.bit_rate) + self.timeout;
            while let Some(frame) = self.can.receive(deadline)? {
                let state = state_of(&frame.data, &spans);
                // Its address stands in the data; the id of the frame is that of the master.
                if u32::from(state.id) == id & 0xf && frame.id != id {
                    self.counts.answered += 1;
                    return Ok(Some(state));
                }
                self.counts.strange += 1;
            }
        }
        self.counts.silent += 1;
        Ok(None)
    }

    fn reading(&self, joint: usize, state: &State) -> Reading {
        let joint = &self.joints[joint];
        let direction = joint.per_count.signum();
        Reading {
            position: Some(joint.position(state.position)),
            velocity: Some(state.velocity * joint.per_count),
            effort: Some(state.torque * direction),
            current: None,
            temperature: Some(state.temperature),
            // 0 off and 1 on are no errors.
            status: if state.status > 1 { u32::from(state.status) } else { 0 },
        }
    }

    fn silent(&self, joint: usize) -> BusError {
        BusError::Silent { port: self.can.name().to_string(), id: self.joints[joint].id }
    }
}

impl Bus for Mit {
    fn joints(&self) -> usize {
        self.joints.len()
    }

    fn abilities(&self, joint: usize) -> Abilities {
        let takes = self.joints[joint].takes;
        Abilities { takes_position: takes == Takes::Position, takes_effort: takes == Takes::Effort, current_is_signed: true }
    }

    fn identify(&mut self, joint: usize) -> Result<Identity, BusError> {
        let nothing = command(&[0.0; 5], &self.joints[joint].spans);
        match self.ask(joint, nothing)? {
            Some(_) => Ok(Identity { id: self.joints[joint].id, model: None }),
            None => Err(self.silent(joint)),
        }
    }

    fn read(&mut self, readings: &mut [Reading]) -> Result<(), BusError> {
        for joint in 0..self.joints.len() {
            let data = command(&self.commands[joint], &self.joints[joint].spans);
            let state = self.ask(joint, data)?;
            readings[joint] = state.map_or(Reading::default(), |state| self.reading(joint, &state));
        }
        Ok(())
    }

    /// Goals are sent with the next reading: a motor answers each of them.
    fn write(&mut self, goals: &[Goal]) -> Result<(), BusError> {
        for ((goal, joint), command) in goals.iter().zip(&self.joints).zip(&mut self.commands) {
            match (goal, joint.takes) {
                (Goal::Position(position), Takes::Position) if position.is_finite() => {
                    let at = joint.count(position.clamp(joint.range[0], joint.range[1]));
                    *command = [at, 0.0, joint.stiffness.unwrap_or(0.0), joint.damping.unwrap_or(0.0), 0.0];
                }
                (Goal::Effort(effort), Takes::Effort) if effort.is_finite() => {
                    let most = joint.effort.unwrap_or(0.0);
                    *command = [0.0, 0.0, 0.0, 0.0, effort.clamp(-most, most) * joint.per_count.signum()];
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn engage(&mut self, present: &[Reading]) -> Result<(), BusError> {
        for joint in 0..self.joints.len() {
            let Some(position) = present.get(joint).and_then(|read| read.position) else { return Err(self.silent(joint)) };
            self.commands[joint] = [0.0; 5];
            if self.joints[joint].takes == Takes::Nothing {
                continue;
            }
            if self.ask(joint, ENABLE)?.is_none() {
                return Err(self.silent(joint));
            }
            if self.joints[joint].takes == Takes::Position {
                let mut goals = vec![Goal::Keep; self.joints.len()];
                goals[joint] = Goal::Position(position);
                self.write(&goals)?;
            }
        }
        Ok(())
    }

    fn release(&mut self) -> Result<(), BusError> {
        self.commands.fill([0.0; 5]);
        for joint in 0..self.joints.len() {
            self.ask(joint, DISABLE)?;
        }
        Ok(())
    }

    fn counts(&self) -> Counts {
        self.counts
    }

    fn wire_time(&self) -> Duration {
        Duration::from_secs_f64(2.0 * FRAME_BITS * self.joints.len() as f64 / self.bit_rate)
    }
}
