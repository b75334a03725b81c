//! A device's own file: its port, and per joint address, unit, sign, zero, limits and what it takes.

use backdrive_msgs::MAX_AXES;
use backdrive_plant::elements::Range;
use backdrive_plant::tomlfile::{FileError, Table};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// What a bus speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Feetech STS and SMS: little end first, 4096 counts a turn, synchronous read.
    FeetechSts,
    /// Feetech SCS: big end first, no current, read one by one.
    FeetechScs,
    /// Dynamixel protocol 2, X series.
    Dynamixel2,
    /// Frames of the MIT mini cheetah over CAN, as Damiao and others speak them.
    Mit,
}

impl Protocol {
    /// Names in files.
    pub const ALL: [(&'static str, Protocol); 4] = [
        ("feetech_sts", Protocol::FeetechSts),
        ("feetech_scs", Protocol::FeetechScs),
        ("dynamixel2", Protocol::Dynamixel2),
        ("mit", Protocol::Mit),
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Protocol::ALL.iter().find(|(_, p)| *p == self).map_or("", |(name, _)| name)
    }

    /// Counts of a turn where the file states none.
    fn counts_per_turn(self) -> f64 {
        match self {
            Protocol::FeetechSts | Protocol::Dynamixel2 => 4096.0,
            // 1024 counts over 300 degrees.
            Protocol::FeetechScs => 1024.0 * 360.0 / 300.0,
            // Its frames hold rad.
            Protocol::Mit => TAU,
        }
    }

    /// The count of the middle of the range, which is the usual zero.
    fn middle(self) -> f64 {
        match self {
            Protocol::FeetechSts | Protocol::Dynamixel2 => 2048.0,
            Protocol::FeetechScs => 512.0,
            Protocol::Mit => 0.0,
        }
    }
}

/// What a joint takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Takes {
    /// Goals of position.
    Position,
    /// Goals of torque or force.
    Effort,
    /// Nothing: it is only read, and its motor stays off.
    Nothing,
}

impl Takes {
    /// Names in files.
    pub const ALL: [(&'static str, Takes); 3] = [("position", Takes::Position), ("effort", Takes::Effort), ("nothing", Takes::Nothing)];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Takes::ALL[self as usize].0
    }
}

/// A joint of a device's file.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name of the axis.
    pub name: String,
    /// Address on the bus.
    pub id: u32,
    /// Model number that must answer, where the file states one.
    pub model: Option<u32>,
    /// What it takes.
    pub takes: Takes,
    /// The count at which the position is 0.
    pub zero: f64,
    /// rad or m of a count, with the joint's sign.
    pub per_count: f64,
    /// Lowest and highest position, rad or m; goals are cut to it.
    pub range: [f64; 2],
    /// Highest speed of the goal, rad/s or m/s.
    pub speed: Option<f64>,
    /// Highest torque or force, N m or N.
    pub effort: Option<f64>,
    /// Stiffness and damping with which a motor follows a position, where it has no loop of its own: N m/rad.
    pub stiffness: Option<f64>,
    /// See `stiffness`, N m s/rad.
    pub damping: Option<f64>,
    /// Torque or force of a current, N m/A or N/A.
    pub torque_constant: Option<f64>,
    /// Whether the current that it reports has a sign.
    pub current_signed: bool,
    /// Current above which the device is released, A.
    pub current_limit: Option<f64>,
    /// Temperature above which the device is released, degrees Celsius.
    pub temperature_limit: Option<f64>,
    /// MIT frames: the values that the ends of position (rad), velocity (rad/s) and torque (N m) stand for.
    pub spans: [f64; 3],
}

/// A device's file.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceFile {
    /// For a person.
    pub name: String,
    /// What its bus speaks.
    pub protocol: Protocol,
    /// Path of the serial port, name of the CAN interface, or path of a socket.
    pub port: PathBuf,
    /// Baud rate of the bus; of CAN its bit rate.
    pub baud: u32,
    /// Time that an answer may take beyond its bytes on the wire, s.
    pub timeout_s: f64,
    /// How often a question without an answer is asked again within a cycle.
    pub retries: u32,
    /// Time over which torque or force rises after the start, s.
    pub ramp_s: f64,
    /// In the order of the axes.
    pub joints: Vec<Joint>,
}

impl DeviceFile {
    /// Reads a device's file.
    ///
    /// # Errors
    /// With file, line and key.
    pub fn load(path: &Path) -> Result<DeviceFile, FileError> {
        DeviceFile::read(Table::open(path)?)
    }

    /// Reads a device's file from its text; `name` stands in errors.
    ///
    /// # Errors
    /// With file, line and key.
    pub fn parse(text: &str, name: &str) -> Result<DeviceFile, FileError> {
        DeviceFile::read(Table::parse(text, name)?)
    }

    fn read(mut table: Table) -> Result<DeviceFile, FileError> {
        let name = table.need_string("name")?;
        let protocol = table.need_one_of("protocol", &Protocol::ALL)?;
        let port = PathBuf::from(table.need_string("port")?);
        let baud = table.integer("baud", 9600, 8_000_000)?.unwrap_or(1_000_000) as u32;
        let timeout_s = table.number_or("timeout_s", Range::Positive, 0.002)?;
        if timeout_s > 0.1 {
            return Err(table.error_at("timeout_s", format!("is {timeout_s} s; at most 0.1: the loop waits for it")));
        }
        let retries = table.integer("retries", 0, 5)?.unwrap_or(1) as u32;
        let ramp_s = table.number_or("ramp_s", Range::NonNegative, 0.5)?;
        let tables = table.tables("joints")?;
        if tables.is_empty() || tables.len() > MAX_AXES {
            return Err(table.error_at("joints", format!("expected 1 to {MAX_AXES} [[joints]], found {}", tables.len())));
        }
        let mut joints: Vec<Joint> = Vec::new();
        for mut entry in tables {
            let joint = read_joint(&mut entry, protocol)?;
            if joints.iter().any(|j| j.id == joint.id) {
                return Err(entry.error_at("id", format!("another joint has the id {}", joint.id)));
            }
            if joints.iter().any(|j| j.name == joint.name) {
                return Err(entry.error_at("name", format!("another joint is called \"{}\"", joint.name)));
            }
            if joints.first().is_some_and(|first| first.takes != joint.takes) {
                return Err(entry.error_at("takes", "all joints of a device take the same; write another file for the others"));
            }
            entry.finish()?;
            joints.push(joint);
        }
        table.finish()?;
        Ok(DeviceFile { name, protocol, port, baud, timeout_s, retries, ramp_s, joints })
    }

    /// What its joints take.
    pub fn takes(&self) -> Takes {
        self.joints.first().map_or(Takes::Nothing, |joint| joint.takes)
    }

    /// Names of its axes.
    pub fn axis_names(&self) -> Vec<String> {
        self.joints.iter().map(|joint| joint.name.clone()).collect()
    }
}

fn read_joint(table: &mut Table, protocol: Protocol) -> Result<Joint, FileError> {
    let name = table.need_string("name")?;
    table.label(&name);
    let highest = if protocol == Protocol::Mit { 0x7ff } else { 252 };
    let id = table.integer("id", 0, highest)?.ok_or_else(|| table.missing("id"))? as u32;
    let model = table.integer("model", 0, 65_535)?.map(|m| m as u32);
    let takes = table.need_one_of("takes", &Takes::ALL)?;
    if takes == Takes::Effort && matches!(protocol, Protocol::FeetechSts | Protocol::FeetechScs) {
        let message =
            "a Feetech servo takes no torque; write takes = \"position\" for a slave, or \"nothing\" for a master that gives no force";
        return Err(table.error_at("takes", message));
    }
    let zero = table.number_or("zero", Range::Any, protocol.middle())?;
    let sign = table.number_or("sign", Range::Any, 1.0)?;
    if sign.abs() != 1.0 {
        return Err(table.error_at("sign", format!("must be 1 or -1, is {sign}")));
    }
    let counts = table.number_or("counts_per_turn", Range::Positive, protocol.counts_per_turn())?;
    let turn = table.number_or("travel_per_turn", Range::Positive, TAU)?;
    let range = match table.numbers("range", Range::Any)?.as_deref() {
        Some([low, high]) if low < high => [*low, *high],
        Some(_) => return Err(table.error_at("range", "expected the lowest and the highest position, such as [-1.5, 1.5]")),
        None => return Err(table.missing("range")),
    };
    let (speed, effort) = (table.number("speed", Range::Positive)?, table.number("effort", Range::Positive)?);
    let (stiffness, damping) = (table.number("stiffness", Range::NonNegative)?, table.number("damping", Range::NonNegative)?);
    if takes == Takes::Position && protocol == Protocol::Mit && (stiffness.is_none() || damping.is_none()) {
        return Err(table.error(
            "follows positions by the stiffness and damping of its frames: add stiffness = N_M_PER_RAD and damping = N_M_S_PER_RAD",
        ));
    }
    let torque_constant = table.number("torque_constant", Range::Positive)?;
    let current_signed = table.boolean("current_signed")?.unwrap_or(protocol == Protocol::Dynamixel2);
    let current_limit = table.number("current_limit", Range::Positive)?;
    let temperature_limit = table.number("temperature_limit", Range::Positive)?;
    if takes == Takes::Effort && effort.is_none() {
        return Err(table.error("takes torque and has no limit of it: add effort = N_M, the most that it may give"));
    }
    if takes == Takes::Effort && protocol == Protocol::Dynamixel2 && torque_constant.is_none() {
        return Err(table.error("takes torque by its current: add torque_constant = N_M_PER_A"));
    }
    let spans = match table.numbers("spans", Range::Positive)?.as_deref() {
        Some([position, velocity, torque]) => [*position, *velocity, *torque],
        Some(_) => return Err(table.error_at("spans", "expected the ends of position, velocity and torque, such as [12.5, 30.0, 10.0]")),
        None => [12.5, 30.0, 10.0],
    };
    let per_count = sign * turn / counts;
    Ok(Joint {
        name,
        id,
        model,
        takes,
        zero,
        per_count,
        range,
        speed,
        effort,
        stiffness,
        damping,
        torque_constant,
        current_signed,
        current_limit,
        temperature_limit,
        spans,
    })
}

impl Joint {
    /// Position of a count, rad or m.
    pub fn position(&self, count: f64) -> f64 {
        (count - self.zero) * self.per_count
    }

    /// The count of a position.
    pub fn count(&self, position: f64) -> f64 {
        position / self.per_count + self.zero
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "name = \"arm\"\nprotocol = \"feetech_sts\"\nport = \"/dev/ttyUSB0\"\n[[joints]]\nname = \"elbow\"\nid = 3\ntakes = \"position\"\nrange = [-1.5, 1.5]\nsign = -1\n";

    #[test]
    fn counts_and_positions_are_each_others_inverse() {
        let file = DeviceFile::parse(FILE, "arm.toml").unwrap();
        let joint = &file.joints[0];
        assert!((joint.position(2048.0 + 1024.0) + TAU / 4.0).abs() < 1e-12, "a quarter turn, with the sign");
        assert!((joint.count(joint.position(777.0)) - 777.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_wrong_is_reported_with_its_key() {
        let refused = |from: &str, to: &str| DeviceFile::parse(&FILE.replace(from, to), "arm.toml").unwrap_err().to_string();
        assert!(refused("\"position\"", "\"effort\"").contains("takes no torque"));
        assert!(refused("sign = -1", "sign = 2").contains("must be 1 or -1"));
        assert!(refused("[-1.5, 1.5]", "[1.5, -1.5]").contains("lowest"));
        assert!(refused("range = [-1.5, 1.5]\n", "").contains("range"));
        assert!(refused("sign", "sing").contains("did you mean \"sign\""));
    }
}
