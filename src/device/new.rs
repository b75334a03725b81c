//! `backdrive device new`: a device's file, by asking and by small motions.

use super::find::{ids, protocols};
use crate::failure::{Failure, code};
use crate::{cli, output};
use backdrive_devices::bus::{Bus, Goal, Reading};
use backdrive_devices::file::{DeviceFile, Joint, Protocol, Takes};
use backdrive_devices::find::{USUAL_BAUDS, find, only_read};
use backdrive_devices::start::open;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Size of the motion by which a sign is found, rad.
const SMALL_MOTION: f64 = 0.15;

/// What is known of a joint.
struct Known {
    id: u32,
    model: Option<u32>,
    name: String,
    sign: f64,
    zero: f64,
    range: [f64; 2],
}

/// Finds the joints, asks, and writes the file.
pub fn new(options: &cli::DeviceNew) -> Result<u8, Failure> {
    let known: Vec<&str> = Takes::ALL.iter().map(|(name, _)| *name).collect();
    let takes = Takes::ALL.iter().find(|(name, _)| *name == options.takes).map(|(_, takes)| *takes).ok_or_else(|| Failure {
        code: code::USAGE,
        message: format!("--takes: {}", backdrive_plant::tomlfile::unknown("word", &options.takes, known)),
    })?;
    if options.out.exists() && !options.overwrite {
        return Err(Failure::input(format!("{}: exists; --overwrite replaces it", options.out.display())));
    }
    let bauds = options.baud.map_or(USUAL_BAUDS.to_vec(), |baud| vec![baud]);
    let found = find(&options.port, &protocols(options.protocol.as_deref())?, &bauds, ids(&options.ids)?).map_err(Failure::machine)?;
    let Some(bus) = found.into_iter().next() else {
        output::line(format!(
            "nothing answers on {}; `backdrive device find {}` tries more",
            options.port.display(),
            options.port.display()
        ))?;
        return Ok(code::NEGATIVE);
    };
    let file = only_read(&options.port, bus.protocol, bus.baud, bus.answers.iter().map(|who| who.id));
    let mut joints = Vec::new();
    let mut readings = vec![Reading::default(); bus.answers.len()];
    {
        let mut wire = open(&file).map_err(Failure::machine)?;
        if !options.yes {
            wire.release().map_err(Failure::machine)?;
        }
        read_all(wire.as_mut(), &mut readings)?;
        for (index, who) in bus.answers.iter().enumerate() {
            let given = options.joints.get(index).cloned();
            let name = match (given, options.yes) {
                (Some(name), _) => name,
                (None, true) => format!("joint{}", who.id),
                (None, false) => ask(&format!("id {}: name of the joint", who.id), &format!("joint{}", who.id))?,
            };
            let per_count = counts(bus.protocol).recip() * TAU;
            let (mut zero, mut range) = (readings[index].position.unwrap_or(0.0), [-1.0, 1.0]);
            if !options.yes {
                ask(&format!("{name}: hold it where its position is 0, then press Enter"), "")?;
                read_all(wire.as_mut(), &mut readings)?;
                zero = readings[index].position.unwrap_or(zero);
                ask(&format!("{name}: press Enter, then move it from end to end within 8 s"), "")?;
                range = swept(wire.as_mut(), index, &mut readings)?.map(|count| (count - zero) * per_count);
            }
            joints.push(Known { id: who.id, model: who.model, name, sign: 1.0, zero, range });
        }
    }
    for joint in joints.iter_mut().filter(|_| options.moves && takes == Takes::Position) {
        joint.sign = sign_by_motion(&file, joint, options.yes)?;
        if joint.sign < 0.0 {
            joint.range = [-joint.range[1], -joint.range[0]];
        }
    }
    let text = written(options, &file, takes, &joints);
    DeviceFile::parse(&text, &options.out.display().to_string())?;
    output::file(&options.out, &text)?;
    output::line(format!("{} joints -> {}", joints.len(), options.out.display()))?;
    output::line(format!("next      backdrive device check {}", options.out.display()))?;
    Ok(0)
}

fn counts(protocol: Protocol) -> f64 {
    match protocol {
        Protocol::FeetechSts | Protocol::Dynamixel2 => 4096.0,
        Protocol::FeetechScs => 1024.0 * 360.0 / 300.0,
        Protocol::Mit => TAU,
    }
}

fn read_all(bus: &mut dyn Bus, readings: &mut [Reading]) -> Result<(), Failure> {
    bus.read(readings).map_err(Failure::machine)
}

/// Lowest and highest count of a joint while a hand moves it.
fn swept(bus: &mut dyn Bus, joint: usize, readings: &mut [Reading]) -> Result<[f64; 2], Failure> {
    let (until, mut range) = (Instant::now() + Duration::from_secs(8), [f64::INFINITY, f64::NEG_INFINITY]);
    while Instant::now() < until {
        read_all(bus, readings)?;
        if let Some(count) = readings[joint].position {
            range = [range[0].min(count), range[1].max(count)];
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok(range)
}

/// Moves a joint a little in the direction of rising counts, and asks whether that was positive.
fn sign_by_motion(file: &DeviceFile, joint: &Known, yes: bool) -> Result<f64, Failure> {
    let per_count = TAU / counts(file.protocol);
    let one = Joint {
        name: joint.name.clone(),
        takes: Takes::Position,
        zero: joint.zero,
        per_count,
        range: joint.range,
        ..file.joints.iter().find(|j| j.id == joint.id).cloned().ok_or_else(|| Failure::input("the joint is gone"))?
    };
    let alone = DeviceFile { joints: vec![one], ..file.clone() };
    let mut bus = open(&alone).map_err(Failure::machine)?;
    let mut present = [Reading::default()];
    read_all(bus.as_mut(), &mut present)?;
    let Some(start) = present[0].position else {
        return Err(Failure::machine(format!("{}: does not answer", joint.name)));
    };
    bus.engage(&present).map_err(Failure::machine)?;
    // Towards the middle of its range, so that it meets no stop.
    let way = if start > 0.5 * (joint.range[0] + joint.range[1]) { -1.0 } else { 1.0 };
    for step in (0..=100).chain((0..100).rev()) {
        let goal = start + way * SMALL_MOTION * f64::from(step) / 100.0;
        bus.write(&[Goal::Position(goal)]).map_err(Failure::machine)?;
        std::thread::sleep(Duration::from_millis(8));
        if step == 100 {
            std::thread::sleep(Duration::from_millis(300));
            read_all(bus.as_mut(), &mut present)?;
        }
    }
    bus.release().map_err(Failure::machine)?;
    let moved = present[0].position.map_or(0.0, |p| p - start);
    if moved.abs() < 0.3 * SMALL_MOTION {
        let message =
            format!("{}: was commanded by {SMALL_MOTION} rad and moved by {moved:.3}; is its power on, is it blocked?", joint.name);
        return Err(Failure::machine(message));
    }
    if yes {
        return Ok(1.0);
    }
    let answer = ask(
        &format!(
            "{}: it went {} and came back. Was that its positive direction? y/n",
            joint.name,
            if way > 0.0 { "up in counts" } else { "down in counts" }
        ),
        "y",
    )?;
    Ok(if answer.starts_with(['n', 'N']) { -way } else { way })
}

/// One line from the user; the default where it is empty.
fn ask(question: &str, default: &str) -> Result<String, Failure> {
    output::note(if default.is_empty() { question.to_string() } else { format!("{question} [{default}]") });
    let mut line = String::new();
    match std::io::stdin().read_line(&mut line) {
        Ok(0) => Err(Failure { code: code::USAGE, message: "standard input has ended; --yes asks nothing".to_string() }),
        Ok(_) if line.trim().is_empty() => Ok(default.to_string()),
        Ok(_) => Ok(line.trim().to_string()),
        Err(error) => Err(Failure::machine(error)),
    }
}

fn written(options: &cli::DeviceNew, file: &DeviceFile, takes: Takes, joints: &[Known]) -> String {
    let mut text = format!(
        "# Written by `backdrive device new`. docs/devices.md explains every key.\nname = \"{}\"\nprotocol = \"{}\"\nport = \"{}\"\nbaud = {}\n",
        options.name,
        file.protocol.name(),
        options.port.display(),
        file.baud
    );
    for joint in joints {
        let _ = write!(text, "\n[[joints]]\nname = \"{}\"\nid = {}\n", joint.name, joint.id);
        if let Some(model) = joint.model {
            let _ = writeln!(text, "model = {model}               # checked at the start");
        }
        let _ = writeln!(text, "takes = \"{}\"", takes.name());
        let _ = writeln!(text, "zero = {}              # counts where the position is 0", joint.zero);
        let _ = writeln!(text, "sign = {}", joint.sign);
        let _ = writeln!(text, "range = [{:.4}, {:.4}]  # rad; goals are cut to it", joint.range[0], joint.range[1]);
        if takes == Takes::Position {
            text.push_str("speed = 4.0               # rad/s, of the goal\n");
        }
        if takes == Takes::Effort {
            text.push_str("effort = 0.2              # N m, the most that it gives: raise it with care\ntorque_constant = 1.0     # N m/A, from its data sheet\n");
        }
        text.push_str("temperature_limit = 65    # degrees Celsius\n");
    }
    text
}
