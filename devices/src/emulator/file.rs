//! An emulator's file: its bus, and for each servo the plant that it hides and the loop inside of it.

use super::faults::Faults;
use crate::file::Protocol;
use backdrive_plant::elements::Range;
use backdrive_plant::model::{Fragment, Model};
use backdrive_plant::tomlfile::{FileError, Table};
use std::path::Path;

/// A tone of a hand's motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// rad or m.
    pub amplitude: f64,
    /// Hz.
    pub frequency: f64,
    /// rad.
    pub phase: f64,
}

/// A servo of an emulator.
#[derive(Debug, Clone, PartialEq)]
pub struct ServoFile {
    /// Address on the bus.
    pub id: u32,
    /// Model number that it answers with.
    pub model_number: u32,
    /// The plant behind it, driven by a torque: its first axis.
    pub model: Model,
    /// The hand that holds it.
    pub grip: Option<Fragment>,
    /// Motion of that hand: a sum of tones.
    pub hand: Vec<Tone>,
    /// Stiffness and damping of its position loop, N m/rad and N m s/rad.
    pub stiffness: f64,
    /// See `stiffness`.
    pub damping: f64,
    /// Half the band of error without torque, rad.
    pub dead_band: f64,
    /// Most torque, N m.
    pub torque_limit: f64,
    /// Time from a goal's arrival until it acts, s.
    pub goal_delay_s: f64,
    /// Torque of a current, N m/A.
    pub torque_constant: f64,
    /// Counts of a turn.
    pub counts_per_turn: f64,
    /// The count at position 0.
    pub zero: f64,
    /// Temperature that it reports, degrees Celsius.
    pub temperature: f64,
}

/// An emulator's file.
#[derive(Debug, Clone, PartialEq)]
pub struct EmulatorFile {
    /// What its bus speaks.
    pub protocol: Protocol,
    /// Baud rate, which paces its bytes.
    pub baud: u32,
    /// Time from the end of a question to the beginning of its answer, s.
    pub latency_s: f64,
    /// Rate of the loop inside of the servos and of the simulation, Hz.
    pub loop_hz: f64,
    /// Seed of noise and faults.
    pub seed: u64,
    /// What goes wrong, in the words of [`super::Faults::of`].
    pub faults: Vec<String>,
    /// In any order.
    pub servos: Vec<ServoFile>,
}

impl EmulatorFile {
    /// Reads an emulator's file; files that it names are relative to it.
    ///
    /// # Errors
    /// With file, line and key.
    pub fn load(path: &Path) -> Result<EmulatorFile, FileError> {
        let mut table = Table::open(path)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        table.string("title")?;
        let protocol = table.need_one_of("protocol", &Protocol::ALL)?;
        let baud = table.integer("baud", 9600, 8_000_000)?.unwrap_or(1_000_000) as u32;
        let latency_s = table.number_or("latency_s", Range::NonNegative, 50e-6)?;
        let loop_hz = table.number_or("loop_hz", Range::Positive, 1000.0)?;
        if !(100.0..=10_000.0).contains(&loop_hz) {
            return Err(table.error_at("loop_hz", format!("must be from 100 to 10 000 Hz, is {loop_hz}")));
        }
        let seed = table.integer("seed", 0, i64::MAX)?.unwrap_or(1) as u64;
        let faults = table.strings("faults")?.unwrap_or_default();
        Faults::of(&faults, seed).map_err(|e| table.error_at("faults", e.to_string()))?;
        let tables = table.tables("servos")?;
        if tables.is_empty() {
            return Err(table.missing("servos"));
        }
        let servos = tables.into_iter().map(|servo| read_servo(servo, folder, protocol)).collect::<Result<Vec<_>, _>>()?;
        table.finish()?;
        Ok(EmulatorFile { protocol, baud, latency_s, loop_hz, seed, faults, servos })
    }
}

fn read_servo(mut table: Table, folder: &Path, protocol: Protocol) -> Result<ServoFile, FileError> {
    let id = table.integer("id", 0, 2047)?.ok_or_else(|| table.missing("id"))? as u32;
    let (model_default, counts, zero) = match protocol {
        Protocol::FeetechSts => (777, 4096.0, 2048.0),
        Protocol::FeetechScs => (1029, 1024.0 * 1.2, 512.0),
        Protocol::Dynamixel2 => (1200, 4096.0, 2048.0),
        Protocol::Mit => (0, std::f64::consts::TAU, 0.0),
    };
    let model_number = table.integer("model_number", 0, 65_535)?.unwrap_or(model_default) as u32;
    let path = table.need_string("model")?;
    let model = Model::load(&folder.join(path))?;
    let grip = match table.string("grip")? {
        Some(path) => Some(Fragment::load(&folder.join(path))?),
        None => None,
    };
    let mut hand = Vec::new();
    for mut tone in table.tables("hand")? {
        hand.push(Tone {
            amplitude: tone.need_number("amplitude", Range::Any)?,
            frequency: tone.need_number("frequency", Range::Positive)?,
            phase: tone.number_or("phase", Range::Any, 0.0)?,
        });
        tone.finish()?;
    }
    if !hand.is_empty() && grip.is_none() {
        return Err(table.error_at("hand", "has no effect without a grip: name one such as ../plant/grips/knob.toml"));
    }
    let servo = ServoFile {
        id,
        model_number,
        model,
        grip,
        hand,
        stiffness: table.number_or("stiffness", Range::NonNegative, 20.0)?,
        damping: table.number_or("damping", Range::NonNegative, 0.4)?,
        dead_band: table.number_or("dead_band", Range::NonNegative, 0.0)?,
        torque_limit: table.number_or("torque_limit", Range::Positive, 3.0)?,
        goal_delay_s: table.number_or("goal_delay_s", Range::NonNegative, 0.0)?,
        torque_constant: table.number_or("torque_constant", Range::Positive, 1.0)?,
        counts_per_turn: table.number_or("counts_per_turn", Range::Positive, counts)?,
        zero: table.number_or("zero", Range::Any, zero)?,
        temperature: table.number_or("temperature", Range::Any, 32.0)?,
    };
    table.finish()?;
    Ok(servo)
}
