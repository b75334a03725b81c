//! What every bus does, over every protocol, on emulators that speak its bytes.

mod common;

use backdrive_devices::bus::{Bus, BusError, Goal, Identity, Reading};
use backdrive_devices::start::{checked, open};
use common::{BUSES, Running, device};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Cycles, 200 a second, with one goal for all joints, until all readings are as wanted: at most 20 s, for a machine may be busy.
fn cycle(bus: &mut dyn Bus, goal: Goal, wanted: &dyn Fn(&Reading) -> bool) -> Result<(), Vec<Reading>> {
    let mut readings = vec![Reading::default(); bus.joints()];
    let goals = vec![goal; bus.joints()];
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(20) {
        bus.write(&goals).unwrap();
        bus.read(&mut readings).unwrap();
        if readings.iter().all(wanted) {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Err(readings)
}

fn stands_at(position: f64) -> impl Fn(&Reading) -> bool {
    move |reading| reading.position.is_some_and(|p| (p - position).abs() < 0.02) && reading.velocity.is_some_and(|v| v.abs() < 0.05)
}

fn read(bus: &mut dyn Bus) -> Vec<Reading> {
    let mut readings = vec![Reading::default(); bus.joints()];
    bus.read(&mut readings).unwrap();
    readings
}

#[test]
fn joints_say_who_they_are_and_where_they_stand() {
    for (protocol, _) in BUSES {
        let emulator = Running::start(protocol, 3, &[]);
        let file = device(protocol, &emulator.port, 3, "nothing", "");
        let mut bus = open(&file).unwrap();
        let model = BTreeMap::from([("feetech_sts", 777), ("feetech_scs", 1029), ("dynamixel2", 1200)]).get(protocol).copied();
        for joint in 0..3 {
            assert_eq!(bus.identify(joint).unwrap(), Identity { id: joint as u32 + 1, model }, "{protocol}");
        }
        let present = checked(bus.as_mut(), &file).unwrap();
        for reading in present {
            assert!(reading.position.is_some_and(|p| p.abs() < 0.01), "{protocol}: {reading:?}");
            assert_eq!(reading.temperature, Some(32.0), "{protocol}");
        }
        let counts = bus.counts();
        assert_eq!((counts.corrupt, counts.noise), (0, 0), "{protocol}: {counts:?}");
        assert!(bus.wire_time() > Duration::from_micros(100), "{protocol}");
    }
}

#[test]
fn positions_are_reached_in_the_files_sign_and_a_released_joint_stays() {
    for (protocol, takes) in BUSES.iter().filter(|(_, takes)| takes.contains(&"position")) {
        let emulator = Running::start(protocol, 2, &[]);
        let mut bus = open(&device(protocol, &emulator.port, 2, takes[0], "sign = -1")).unwrap();
        let present = read(bus.as_mut());
        bus.engage(&present).unwrap();
        assert_eq!(cycle(bus.as_mut(), Goal::Position(0.4), &stands_at(0.4)), Ok(()), "{protocol}");
        // The same in counts of the other sign.
        let mirrored = device(protocol, &emulator.port, 2, takes[0], "sign = 1");
        drop(bus);
        let mut bus = open(&mirrored).unwrap();
        assert_eq!(cycle(bus.as_mut(), Goal::Keep, &stands_at(-0.4)), Ok(()), "{protocol}");
        bus.release().unwrap();
        for _ in 0..40 {
            bus.write(&[Goal::Position(0.4); 2]).unwrap();
            let still = read(bus.as_mut());
            assert!(still.iter().all(|r| r.position.is_none_or(|p| (p + 0.4).abs() < 0.03)), "{protocol}: off, and moves: {still:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

#[test]
fn a_torque_accelerates_as_newton_says() {
    for (protocol, _) in BUSES.iter().filter(|(_, takes)| takes.contains(&"effort")) {
        let emulator = Running::start(protocol, 1, &[]);
        let mut bus = open(&device(protocol, &emulator.port, 1, "effort", "")).unwrap();
        let present = read(bus.as_mut());
        bus.engage(&present).unwrap();
        // 0.05 N m on 0.01 kg m^2 with 0.1 N m s/rad: a speed of 0.5 rad/s, with a time constant of 0.1 s.
        let wanted =
            |read: &Reading| read.velocity.is_some_and(|v| (v - 0.5).abs() < 0.03) && read.effort.is_some_and(|e| (e - 0.05).abs() < 0.006);
        assert_eq!(cycle(bus.as_mut(), Goal::Effort(0.05), &wanted), Ok(()), "{protocol}");
        // And never gets faster. On a busy machine it may be slower: a servo's watchdog takes the torque away where nobody speaks to it for 20 ms.
        let mut speeds = Vec::new();
        for _ in 0..200 {
            bus.write(&[Goal::Effort(0.05)]).unwrap();
            speeds.extend(read(bus.as_mut())[0].velocity);
            std::thread::sleep(Duration::from_millis(5));
        }
        let means = speeds.chunks_exact(20).map(|some| some.iter().sum::<f64>() / 20.0);
        assert!(means.clone().all(|mean| mean < 0.58), "{protocol}: {:?} rad/s", means.collect::<Vec<_>>());
        bus.release().unwrap();
    }
}

#[test]
fn an_effort_without_a_sign_is_absent_and_not_zero() {
    let emulator = Running::start("feetech_sts", 1, &[]);
    let mut bus = open(&device("feetech_sts", &emulator.port, 1, "position", "")).unwrap();
    let present = read(bus.as_mut());
    assert_eq!(present[0].effort, None);
    assert!(present[0].current.is_some());
    let emulator = Running::start("feetech_scs", 1, &[]);
    let mut bus = open(&device("feetech_scs", &emulator.port, 1, "position", "")).unwrap();
    assert_eq!(read(bus.as_mut())[0].current, None, "an SCS servo measures no current");
}

#[test]
fn who_is_not_there_is_named_within_a_bounded_time() {
    for (protocol, _) in BUSES {
        let emulator = Running::start(protocol, 1, &[]);
        let mut bus = open(&device(protocol, &emulator.port, 2, "nothing", "")).unwrap();
        let begun = Instant::now();
        let error = bus.identify(1).unwrap_err();
        assert!(matches!(error, BusError::Silent { id: 2, .. }), "{protocol}: {error}");
        let readings = read(bus.as_mut());
        assert!(readings[0].position.is_some() && readings[1] == Reading::default(), "{protocol}: {readings:?}");
        assert!(begun.elapsed() < Duration::from_secs(3), "{protocol}: {:?}", begun.elapsed());
    }
}

/// Of each fault: bytes that are wrong never become a reading that is, the bus counts what happened, and goes on afterwards.
#[test]
fn faults_are_counted_and_give_no_wrong_reading() {
    for (protocol, _) in BUSES {
        for fault in ["silent", "corrupt", "late", "twice", "other_id", "checksum"] {
            let mut emulator = Running::start(protocol, 2, &[&format!("{fault}=0.3@0..0.5")]);
            let mut file = device(protocol, &emulator.port, 2, "nothing", "");
            // Less than what is late is late by.
            file.timeout_s = 0.012;
            let mut bus = open(&file).unwrap();
            let (begun, mut whole) = (Instant::now(), 0);
            while begun.elapsed() < Duration::from_millis(600) {
                for reading in read(bus.as_mut()) {
                    if let Some(position) = reading.position {
                        whole += 1;
                        assert!(position.abs() < 0.01, "{protocol}, {fault}: {position} rad from bytes that were wrong");
                    }
                }
                std::thread::sleep(Duration::from_millis(4));
            }
            // What was late has come by now.
            std::thread::sleep(Duration::from_millis(30));
            let back = cycle(bus.as_mut(), Goal::Keep, &|read| read.position.is_some());
            assert!(back.is_ok(), "{protocol}, {fault}: does not come back");
            let counts = bus.counts();
            let happened = emulator.end().iter().map(|(_, n)| n).sum::<u64>();
            let seen = counts.retries + counts.silent + counts.corrupt + counts.strange + counts.noise;
            assert!(happened > 0 && seen > 0 && whole > 0, "{protocol}, {fault}: {happened} happened, {counts:?}, {whole} whole");
            if fault == "silent" || fault == "other_id" || fault == "checksum" {
                // Each of them costs its question.
                assert!(counts.retries + counts.silent >= happened, "{protocol}, {fault}: {happened} happened, {counts:?}");
            }
        }
    }
}

#[test]
fn a_pulled_cable_is_an_error_that_names_the_port() {
    for (protocol, _) in BUSES {
        let emulator = Running::start(protocol, 1, &["closed@0.2"]);
        let mut bus = open(&device(protocol, &emulator.port, 1, "nothing", "")).unwrap();
        let (begun, mut readings) = (Instant::now(), [Reading::default()]);
        let error = loop {
            assert!(begun.elapsed() < Duration::from_secs(3), "{protocol}: nobody notices");
            if let Err(error) = bus.read(&mut readings) {
                break error.to_string();
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        assert!(error.contains("gone") && error.contains("port"), "{protocol}: {error}");
        assert!(begun.elapsed() < Duration::from_secs(3), "{protocol}: {:?}", begun.elapsed());
    }
}

#[test]
fn two_programs_do_not_share_a_port() {
    let emulator = Running::start("feetech_sts", 1, &[]);
    let file = device("feetech_sts", &emulator.port, 1, "nothing", "");
    let _first = open(&file).unwrap();
    let second = open(&file).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(second.contains("another program has it"), "{second}");
}
