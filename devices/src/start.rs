//! Start of a device: its port or an emulator, and the checks before its motors go on.

use crate::bus::{Bus, BusError, Reading};
use crate::dynamixel::Dynamixel;
use crate::feetech::Feetech;
use crate::file::{DeviceFile, Protocol, Takes};
use crate::mit::Mit;
use crate::side::Side;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Where a device's bus is.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// At the port of its file.
    Port,
    /// In an emulator that is started for it: the emulator's file.
    Emulator(PathBuf),
}

/// How far a joint may move in the time of the check, rad or m, at the start: a few counts of its encoder.
const RESTS_WITHIN: f64 = 0.02;
/// Time over which it is looked whether joints rest.
const RESTS_FOR: Duration = Duration::from_millis(100);

/// Opens the bus that a file describes.
///
/// # Errors
/// The port cannot be opened.
pub fn open(file: &DeviceFile) -> Result<Box<dyn Bus>, BusError> {
    match file.protocol {
        Protocol::FeetechSts | Protocol::FeetechScs => Ok(Box::new(Feetech::open(file)?)),
        Protocol::Dynamixel2 => Ok(Box::new(Dynamixel::open(file)?)),
        Protocol::Mit => Ok(Box::new(Mit::open(file)?)),
    }
}

/// A process that ends with its owner.
struct Ending(Child);

impl Drop for Ending {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A bus whose emulator ends after it.
struct Emulated {
    bus: Box<dyn Bus>,
    _child: Ending,
}

/// A device that is ready: its bus with motors on where they take goals, where its joints stand, and what a person should know.
pub type Started = (Box<dyn Bus>, Vec<Reading>, Vec<String>);

/// Opens the bus of a device, checks every joint, and turns its motors on.
///
/// # Errors
/// One sentence: the port, an id that does not answer, another model, a joint out of range or in motion.
pub fn started(file: &DeviceFile, side: Side, source: &Source) -> Result<Started, String> {
    let mut bus: Box<dyn Bus> = match source {
        Source::Port => open(file).map_err(|e| e.to_string())?,
        Source::Emulator(emulator) => {
            let (child, port) = emulator_of(emulator)?;
            let child = Ending(child);
            let bus = open(&DeviceFile { port, ..file.clone() }).map_err(|e| e.to_string())?;
            Box::new(Emulated { bus, _child: child })
        }
    };
    let mut notes = Vec::new();
    if side == Side::Master && file.takes() != Takes::Effort {
        notes.push("unilateral: this master gives no force, because its device takes no torque".to_string());
    }
    if let Some(note) = slow_adapter(&file.port) {
        notes.push(note);
    }
    let present = checked(bus.as_mut(), file)?;
    let takes = if side == Side::Master && file.takes() == Takes::Position { Takes::Nothing } else { file.takes() };
    if takes == Takes::Nothing {
        bus.release().map_err(|e| e.to_string())?;
    } else {
        bus.engage(&present).map_err(|e| e.to_string())?;
    }
    Ok((bus, present, notes))
}

/// Checks that every joint answers, is of its model, in its range, and rests.
///
/// # Errors
/// The first joint that does not, in one sentence.
pub fn checked(bus: &mut dyn Bus, file: &DeviceFile) -> Result<Vec<Reading>, String> {
    let port = file.port.display();
    for (index, joint) in file.joints.iter().enumerate() {
        let identity = bus.identify(index).map_err(|e| format!("joint \"{}\": {e}", joint.name))?;
        if let (Some(expected), Some(found)) = (joint.model, identity.model)
            && expected != found
        {
            return Err(format!(
                "joint \"{}\": id {} on {port} is of model {found}, the file states {expected}; name the right id, or correct `model`",
                joint.name, joint.id
            ));
        }
    }
    let first = all_read(bus, file)?;
    let until = Instant::now() + RESTS_FOR;
    let mut last = first.clone();
    while Instant::now() < until {
        last = all_read(bus, file)?;
        std::thread::sleep(Duration::from_millis(10));
    }
    for ((joint, before), now) in file.joints.iter().zip(&first).zip(&last) {
        let (Some(before), Some(now)) = (before.position, now.position) else { continue };
        if now < joint.range[0] || now > joint.range[1] {
            return Err(format!(
                "joint \"{}\" stands at {now:.3}, outside of its range of {:.3} to {:.3}; move it by hand, or correct `zero`, `sign` or `range`",
                joint.name, joint.range[0], joint.range[1]
            ));
        }
        if joint.takes != Takes::Nothing && (now - before).abs() > RESTS_WITHIN {
            return Err(format!(
                "joint \"{}\" moves ({:.3} within {} ms); motors are turned on at rest only: hold it still",
                joint.name,
                now - before,
                RESTS_FOR.as_millis()
            ));
        }
        if let (Some(temperature), Some(limit)) = (now_of(&last, file, &joint.name), joint.temperature_limit)
            && temperature > limit
        {
            return Err(format!("joint \"{}\" has {temperature} degrees, its limit is {limit}; let it cool down", joint.name));
        }
    }
    Ok(last)
}

fn now_of(readings: &[Reading], file: &DeviceFile, name: &str) -> Option<f64> {
    file.joints.iter().position(|joint| joint.name == name).and_then(|i| readings.get(i)).and_then(|r| r.temperature)
}

fn all_read(bus: &mut dyn Bus, file: &DeviceFile) -> Result<Vec<Reading>, String> {
    let mut readings = vec![Reading::default(); file.joints.len()];
    bus.read(&mut readings).map_err(|e| e.to_string())?;
    match readings.iter().position(|r| r.position.is_none()) {
        Some(silent) => Err(format!(
            "joint \"{}\": id {} on {} does not answer a reading within {} s; check its cable, or raise timeout_s",
            file.joints[silent].name,
            file.joints[silent].id,
            file.port.display(),
            file.timeout_s
        )),
        None => Ok(readings),
    }
}

/// Starts an emulator; gives the port that it has opened. It ends with this process.
///
/// # Errors
/// It cannot be started, or reports an error.
pub fn emulator_of(file: &Path) -> Result<(Child, PathBuf), String> {
    let program = std::env::current_exe().map_err(|e| format!("the emulator cannot be started: {e}"))?;
    // As this node itself was started: words before `node` belong to the program, such as those of an interpreter.
    let words: Vec<String> = std::env::args().skip(1).take_while(|word| word != "node").collect();
    let mut command = Command::new(program);
    command.args(words).args(["device", "emulate", "--end-with-input"]).arg(file).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().map_err(|e| format!("the emulator cannot be started: {e}"))?;
    let mut line = String::new();
    let read = child.stdout.take().map(|out| BufReader::new(out).read_line(&mut line));
    let port = line.trim().strip_prefix("port ").map(PathBuf::from);
    match (read, port) {
        (Some(Ok(_)), Some(port)) => Ok((child, port)),
        _ => {
            let _ = child.kill();
            let _ = child.wait();
            Err(format!("the emulator of {} did not start; `backdrive device emulate {}` shows why", file.display(), file.display()))
        }
    }
}

/// Adapters of FTDI hold bytes back for 16 ms by default, which no loop survives.
fn slow_adapter(port: &Path) -> Option<String> {
    let name = std::fs::canonicalize(port).ok()?.file_name()?.to_string_lossy().into_owned();
    let file = format!("/sys/bus/usb-serial/devices/{name}/latency_timer");
    let wait: u32 = std::fs::read_to_string(&file).ok()?.trim().parse().ok()?;
    (wait > 1).then(|| format!("the adapter holds bytes back for {wait} ms: echo 1 | sudo tee {file}"))
}

impl Bus for Emulated {
    fn joints(&self) -> usize {
        self.bus.joints()
    }

    fn abilities(&self, joint: usize) -> crate::bus::Abilities {
        self.bus.abilities(joint)
    }

    fn identify(&mut self, joint: usize) -> Result<crate::bus::Identity, BusError> {
        self.bus.identify(joint)
    }

    fn read(&mut self, readings: &mut [Reading]) -> Result<(), BusError> {
        self.bus.read(readings)
    }

    fn write(&mut self, goals: &[crate::bus::Goal]) -> Result<(), BusError> {
        self.bus.write(goals)
    }

    fn engage(&mut self, present: &[Reading]) -> Result<(), BusError> {
        self.bus.engage(present)
    }

    fn release(&mut self) -> Result<(), BusError> {
        self.bus.release()
    }

    fn counts(&self) -> crate::bus::Counts {
        self.bus.counts()
    }

    fn wire_time(&self) -> Duration {
        self.bus.wire_time()
    }
}
