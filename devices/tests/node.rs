//! A device as a node: its samples, and how fast its torque is gone when something stops.

mod common;

use backdrive_control::core::{Core, Events, Port, Tick};
use backdrive_devices::core::{BUS_NUMBERS, DeviceCore};
use backdrive_devices::side::Side;
use backdrive_devices::start::Source;
use backdrive_msgs::{Sample, measured};
use common::{Running, device};
use std::time::{Duration, Instant};

const RATE_HZ: f64 = 200.0;
const STALE_AFTER_S: f64 = 0.01;

struct Loop {
    core: DeviceCore,
    step: u64,
    begun: Instant,
    outputs: Vec<Sample>,
    events: Vec<&'static str>,
}

impl Loop {
    fn new(core: DeviceCore) -> Loop {
        Loop { core, step: 0, begun: Instant::now(), outputs: Vec::new(), events: Vec::new() }
    }

    /// One step in real time with this input on the second port (force) or the first (command).
    fn step(&mut self, command: Option<f64>, force: Option<f64>) -> Sample {
        let due = self.begun + Duration::from_secs_f64(self.step as f64 / RATE_HZ);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        let sample = |position: Option<f64>, effort: Option<f64>| {
            let mut sample = Sample::new(1);
            sample.step = self.step;
            sample.position[0] = position.unwrap_or(f64::NAN);
            sample.effort[0] = effort.unwrap_or(f64::NAN);
            Port { sample: position.or(effort).map(|_| sample), age_steps: 0 }
        };
        let inputs = [sample(command, None), sample(None, force)];
        let tick = Tick { step: self.step, time_s: self.step as f64 / RATE_HZ, period_s: 1.0 / RATE_HZ };
        let (mut outputs, mut events) = ([Sample::new(1), Sample::new(1)], Events::default());
        self.core.step(&tick, &inputs, &mut outputs, &mut events);
        self.events.extend(events.drain().map(|(kind, ..)| kind));
        self.step += 1;
        self.outputs.push(outputs[0]);
        outputs[0]
    }
}

fn core(emulator: &Running, protocol: &str, takes: &str, side: Side) -> DeviceCore {
    let file = device(protocol, &emulator.port, 1, takes, "");
    DeviceCore::new(file, side, Source::Port, STALE_AFTER_S, 1.0 / RATE_HZ)
}

#[test]
fn a_force_that_stops_is_gone_within_twenty_milliseconds() {
    for protocol in ["dynamixel2", "mit"] {
        let emulator = Running::start(protocol, 1, &[]);
        let mut node = Loop::new(core(&emulator, protocol, "effort", Side::Master));
        assert!(node.core.begin().unwrap().is_empty(), "{protocol}: it gives force, so nothing is to note");
        node.begun = Instant::now();
        // A busy machine may hold readings up, and then there is no force.
        let works = |node: &Loop| node.outputs.iter().rev().take(10).filter(|s| s.effort[0] == 0.02).count() == 10;
        while !works(&node) && node.step < 4000 {
            node.step(None, Some(0.02));
        }
        assert!(works(&node), "{protocol}: {:?}", node.outputs.last());
        let stopped = node.step - 1;
        for _ in 0..20 {
            node.step(None, None);
        }
        let zero = node.outputs.iter().skip(stopped as usize).position(|s| s.effort[0] == 0.0).expect("it ends") as f64;
        assert!(zero / RATE_HZ <= 2.0 * STALE_AFTER_S, "{protocol}: zero {} s after the last force", zero / RATE_HZ);
        assert!(node.events.contains(&"device_force_stale"), "{protocol}: {:?}", node.events);
    }
}

#[test]
fn a_pulled_cable_makes_positions_absent_and_takes_the_force_away() {
    let emulator = Running::start("mit", 1, &["closed@0.6"]);
    let mut node = Loop::new(core(&emulator, "mit", "effort", Side::Master));
    node.core.begin().unwrap();
    node.begun = Instant::now();
    while !node.events.contains(&"device_gone") && node.step < 2000 {
        node.step(None, Some(0.02));
    }
    for _ in 0..20 {
        node.step(None, Some(0.02));
    }
    let last_good = node.outputs.iter().rposition(|s| measured(s.position[0]).is_some()).expect("it worked once");
    let zero = node.outputs.iter().skip(last_good).position(|s| s.effort[0] == 0.0).expect("the force ends") as f64;
    assert!(zero / RATE_HZ <= 2.0 * STALE_AFTER_S, "zero {} s after the last good sample", zero / RATE_HZ);
    assert!(node.outputs[last_good + 6..].iter().all(|s| s.effort[0] == 0.0), "and stays away");
    assert!(node.events.contains(&"device_gone"), "{:?}", node.events);
}

#[test]
fn a_servo_that_takes_positions_is_a_unilateral_master_without_an_effort() {
    let emulator = Running::start("feetech_sts", 1, &[]);
    let mut node = Loop::new(core(&emulator, "feetech_sts", "position", Side::Master));
    let notes = node.core.begin().unwrap();
    assert!(notes.iter().any(|note| note.starts_with("unilateral")), "{notes:?}");
    node.begun = Instant::now();
    let seen = |node: &Loop| node.outputs.iter().filter(|s| measured(s.position[0]).is_some()).count();
    while seen(&node) < 20 && node.step < 2000 {
        node.step(None, Some(0.5));
    }
    assert_eq!(seen(&node), 20);
    assert!(node.outputs.iter().all(|s| measured(s.effort[0]).is_none()), "a force that nobody gives is absent");
}

#[test]
fn a_slave_follows_and_reports_its_bus() {
    let emulator = Running::start("feetech_sts", 1, &[]);
    let mut node = Loop::new(core(&emulator, "feetech_sts", "position", Side::Slave));
    node.core.begin().unwrap();
    node.begun = Instant::now();
    let stands = |node: &Loop| node.outputs.last().is_some_and(|s| (s.position[0] - 0.3).abs() < 0.02);
    while !(stands(&node) && node.step > 400) && node.step < 4000 {
        node.step(Some(0.3 * (node.step as f64 / 60.0).min(1.0)), None);
    }
    assert!(stands(&node), "{:?}", node.outputs.last());
    let numbers = node.core.report(0).unwrap();
    let number = |name: &str| numbers[BUS_NUMBERS.iter().position(|known| *known == name).unwrap()];
    // No faster than it is asked, and no faster than its wire.
    assert!(number("rate_hz") > 1.0 && number("rate_hz") < 1.1 * RATE_HZ, "{numbers:?}");
    assert!(number("round_trip_p50_s") > 0.0003 && number("round_trip_p99_s") >= number("round_trip_p50_s"), "{numbers:?}");
    assert!(node.core.report(2).unwrap()[0] == 32.0, "its temperature");
}

#[test]
fn a_joint_out_of_range_or_of_another_model_does_not_start() {
    let emulator = Running::start("feetech_sts", 1, &[]);
    let refused = |change: &dyn Fn(&mut backdrive_devices::file::DeviceFile)| {
        let mut file = device("feetech_sts", &emulator.port, 1, "position", "");
        change(&mut file);
        DeviceCore::new(file, Side::Slave, Source::Port, STALE_AFTER_S, 1.0 / RATE_HZ).begin().unwrap_err()
    };
    assert!(refused(&|file| file.joints[0].range = [1.0, 2.0]).contains("outside of its range"));
    assert!(refused(&|file| file.joints[0].model = Some(12)).contains("is of model 777, the file states 12"));
    assert!(refused(&|file| file.joints[0].id = 9).contains("id 9 does not answer"));
}
