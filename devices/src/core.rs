//! A device as a node of a graph: the newest readings as a sample, and the graph's command or force as goals.

use crate::bus::{Goal, Reading};
use crate::driver::{Driver, Health};
use crate::file::{DeviceFile, Takes};
use crate::side::Side;
use crate::start::{Source, started};
use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_control::freshness::{Authority, Freshness, bridged_steps};
use backdrive_msgs::{MAX_AXES, NOT_MEASURED, Sample, flag};
use std::time::Duration;

/// Names of the numbers that a device reports of its bus. Times in s; counts since the start of the run: requests that found the bus busy, questions
/// that were asked again, questions without an answer, and frames or bytes that were broken or of somebody else.
pub const BUS_NUMBERS: [&str; MAX_AXES] =
    ["rate_hz", "jitter_p99_s", "round_trip_p50_s", "round_trip_p99_s", "missed", "retries", "silent", "broken"];

/// A device on a graph.
pub struct DeviceCore {
    file: DeviceFile,
    side: Side,
    source: Source,
    driver: Option<Driver>,
    stale_after_s: f64,
    authority: Authority,
    force: Freshness,
    command: Freshness,
    hold_steps: u64,
    asked: [f64; MAX_AXES],
    target: [Option<f64>; MAX_AXES],
    present: [Option<f64>; MAX_AXES],
    newest: [Reading; MAX_AXES],
    silent_steps: u64,
    begun_at: Option<f64>,
    was_decaying: bool,
    was_holding: bool,
    was_silent: bool,
    told_gone: bool,
    stopped: Option<&'static str>,
}

impl DeviceCore {
    /// A device that is opened when its node begins. Of torque nothing is left within `2 * stale_after_s` after the last good sample.
    pub fn new(file: DeviceFile, side: Side, source: Source, stale_after_s: f64, period_s: f64) -> DeviceCore {
        DeviceCore {
            file,
            side,
            source,
            driver: None,
            stale_after_s,
            authority: Authority::new(stale_after_s, period_s),
            force: Freshness::default(),
            command: Freshness::default(),
            hold_steps: bridged_steps(stale_after_s, period_s),
            asked: [0.0; MAX_AXES],
            target: [None; MAX_AXES],
            present: [None; MAX_AXES],
            newest: [Reading::default(); MAX_AXES],
            silent_steps: 0,
            begun_at: None,
            was_decaying: false,
            was_holding: false,
            was_silent: false,
            told_gone: false,
            stopped: None,
        }
    }

    fn axes(&self) -> usize {
        self.file.joints.len().min(MAX_AXES)
    }

    /// The torque of each joint at this step, and what limited it.
    fn efforts(&mut self, tick: &Tick, port: &Port, goals: &mut [Goal; MAX_AXES], events: &mut Events) -> u32 {
        if let Some(force) = self.force.new_sample(port, |s| s.effort[0]) {
            for axis in 0..self.axes() {
                self.asked[axis] = if force.effort[axis].is_finite() { force.effort[axis] } else { 0.0 };
            }
        }
        // A joint that is not seen gets no torque, whatever is asked.
        let stale = if self.force.begun() { self.force.stale_steps } else { 0 }.max(self.silent_steps);
        let share = self.authority.share(stale);
        let decaying = self.authority.is_decaying();
        if decaying && !self.was_decaying {
            events.push("device_force_stale", stale as f64, 1);
        } else if !decaying && self.was_decaying {
            events.push("device_force_back", NOT_MEASURED, 0);
        }
        self.was_decaying = decaying;
        let mut flags = if decaying { flag::STALE } else { 0 };
        let begun = *self.begun_at.get_or_insert(tick.time_s);
        let ramp = if self.file.ramp_s > 0.0 { ((tick.time_s - begun) / self.file.ramp_s).clamp(0.0, 1.0) } else { 1.0 };
        for axis in 0..self.axes() {
            let most = self.file.joints[axis].effort.unwrap_or(0.0);
            let wanted = share * ramp * self.asked[axis];
            let effort = wanted.clamp(-most, most);
            flags |= if effort == wanted { 0 } else { flag::LIMITED };
            goals[axis] = Goal::Effort(effort);
        }
        flags
    }

    /// The goal of each joint at this step, and what limited it.
    fn positions(&mut self, tick: &Tick, port: &Port, goals: &mut [Goal; MAX_AXES], events: &mut Events) -> u32 {
        let mut flags = 0;
        let fresh = self.command.new_sample(port, |s| s.position[0]).copied();
        for axis in 0..self.axes() {
            let Some(wanted) = fresh.as_ref().map(|s| s.position[axis]).filter(|p| p.is_finite()) else { continue };
            let joint = &self.file.joints[axis];
            let mut target = wanted.clamp(joint.range[0], joint.range[1]);
            // The first goal is reached from where the joint stands.
            let Some(before) = self.target[axis].or(self.present[axis]) else { continue };
            if let Some(speed) = joint.speed {
                target = target.clamp(before - speed * tick.period_s, before + speed * tick.period_s);
            }
            flags |= if target == wanted { 0 } else { flag::LIMITED };
            self.target[axis] = Some(target);
            goals[axis] = Goal::Position(target);
        }
        let holding = self.command.begun() && self.command.stale_steps > self.hold_steps;
        if holding && !self.was_holding {
            events.push("slave_holds", self.command.stale_steps as f64, 1);
        } else if !holding && self.was_holding {
            events.push("slave_follows", 0.0, 0);
        }
        self.was_holding = holding;
        flags | if holding { flag::STALE } else { 0 }
    }

    /// Stops the device where a limit of its file is passed.
    fn guard(&mut self, events: &mut Events) {
        let beyond = |value: Option<f64>, limit: Option<f64>| value.zip(limit).is_some_and(|(value, limit)| value.abs() > limit);
        for (joint, reading) in self.file.joints.iter().zip(&self.newest) {
            let (kind, value) = if beyond(reading.temperature, joint.temperature_limit) {
                ("device_too_hot", reading.temperature)
            } else if beyond(reading.current, joint.current_limit) {
                ("device_current_limit", reading.current)
            } else {
                continue;
            };
            events.push(kind, value.unwrap_or(NOT_MEASURED), 2);
            self.stopped = Some(kind);
        }
    }

    fn heard(&mut self, readings: Option<[Reading; MAX_AXES]>, is_there: bool, events: &mut Events) {
        let axes = self.axes();
        let complete = readings.is_some_and(|read| read[..axes].iter().all(|r| r.position.is_some()));
        self.newest = readings.unwrap_or_default();
        for (kept, read) in self.present.iter_mut().zip(&self.newest) {
            *kept = read.position.or(*kept);
        }
        self.silent_steps = if complete { 0 } else { self.silent_steps + 1 };
        let silent = self.silent_steps > self.hold_steps;
        if silent && !self.was_silent {
            let (kind, severity) = if is_there { ("device_silent", 1) } else { ("device_gone", 2) };
            events.push(kind, self.silent_steps as f64, severity);
            self.told_gone = !is_there;
        } else if silent && !is_there && !self.told_gone {
            // Silence comes first where a cable is pulled.
            events.push("device_gone", self.silent_steps as f64, 2);
            self.told_gone = true;
        } else if !silent && self.was_silent {
            events.push("device_answers", NOT_MEASURED, 0);
        }
        self.was_silent = silent;
    }
}

impl Core for DeviceCore {
    fn begin(&mut self) -> Result<Vec<String>, String> {
        let (bus, present, notes) = started(&self.file, self.side, &self.source)?;
        self.present.iter_mut().zip(&present).for_each(|(kept, read)| *kept = read.position);
        self.driver = Some(Driver::start(bus, &present, Duration::from_secs_f64(2.0 * self.stale_after_s)));
        Ok(notes)
    }

    fn step(&mut self, tick: &Tick, inputs: &[Port], outputs: &mut [Sample], events: &mut Events) {
        let mut goals = [Goal::Keep; MAX_AXES];
        let flags = match (self.file.takes(), self.side, inputs) {
            (Takes::Effort, _, [_, force, ..]) => self.efforts(tick, force, &mut goals, events),
            (Takes::Position, Side::Slave, [command, ..]) => self.positions(tick, command, &mut goals, events),
            _ => 0,
        };
        let Some(driver) = &mut self.driver else { return };
        if self.stopped.is_some() {
            goals.fill(Goal::Keep);
        }
        let newest = driver.exchange(&goals);
        self.heard(newest.readings, newest.is_there, events);
        if self.stopped.is_none() {
            self.guard(events);
            if self.stopped.is_some() {
                // Dropped outside of a lock: the thread turns the motors off.
                self.driver = None;
            }
        }
        let axes = self.axes();
        let Some(measured) = outputs.first_mut() else { return };
        for axis in 0..axes {
            let reading = &self.newest[axis];
            measured.position[axis] = reading.position.unwrap_or(NOT_MEASURED);
            measured.velocity[axis] = reading.velocity.unwrap_or(NOT_MEASURED);
            measured.effort[axis] = match (self.side, goals[axis], reading.effort) {
                // A master's effort is the force applied from this step to the next; a torque was asked of the motor, so it is known.
                (Side::Master, Goal::Effort(effort), _) => effort,
                // The environment's force on a slave at rest is minus its motor's.
                (Side::Slave, _, Some(effort)) => -effort,
                _ => NOT_MEASURED,
            };
        }
        measured.flags = flags | if self.was_silent { flag::STALE } else { 0 };
    }

    fn report(&self, list: usize) -> Option<[f64; MAX_AXES]> {
        let mut values = [NOT_MEASURED; MAX_AXES];
        match list {
            0 => {
                let health = self.driver.as_ref().map_or_else(Health::fresh, Driver::health);
                let counts = &health.counts;
                let broken = counts.corrupt + counts.strange + counts.noise;
                values = [
                    health.rate_hz,
                    health.jitter_p99_s,
                    health.round_trip_p50_s,
                    health.round_trip_p99_s,
                    health.missed as f64,
                    counts.retries as f64,
                    counts.silent as f64,
                    broken as f64,
                ];
            }
            1 => values.iter_mut().zip(&self.newest).for_each(|(value, read)| *value = read.current.unwrap_or(NOT_MEASURED)),
            _ => values.iter_mut().zip(&self.newest).for_each(|(value, read)| *value = read.temperature.unwrap_or(NOT_MEASURED)),
        }
        Some(values)
    }
}
