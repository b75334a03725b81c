//! Options of `backdrive device`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `backdrive device`
#[derive(Debug, Subcommand)]
pub enum Device {
    /// List what answers on a serial port or a socket of CAN frames: protocol, baud rate, ids, models. Without a port: list the ports.
    #[command(after_help = FIND_HELP)]
    Find(DeviceFind),
    /// Write a device's file: finds the joints on a port, then asks for their names, signs, zeroes and ranges.
    #[command(after_help = NEW_HELP)]
    New(DeviceNew),
    /// Do the start-up checks of a device's file without turning a motor on, and measure its bus for a second.
    #[command(
        after_help = "Example:\n  backdrive device check arm.toml\n\nExit codes: 0 fine, 2 usage, 3 the file is wrong, 5 a check failed."
    )]
    Check {
        /// The device's file.
        device: PathBuf,
        /// Use this port in place of the file's.
        #[arg(long, value_name = "PORT")]
        port: Option<PathBuf>,
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Emulate a bus of servos on a pty, or of motors on a socket of CAN frames: their real bytes, over simulated plants.
    #[command(after_help = EMULATE_HELP)]
    Emulate(Emulate),
}

const FIND_HELP: &str = "Examples:
  backdrive device find
  backdrive device find /dev/ttyUSB0
  backdrive device find /dev/ttyUSB0 --protocol feetech_sts --baud 1000000 --ids 1..6

Exit codes: 0 something answers, 1 nothing does, 2 usage, 5 the port cannot be opened.";

const NEW_HELP: &str = "Examples:
  backdrive device new /dev/ttyUSB0 --out arm.toml
  backdrive device new /dev/ttyUSB0 --out leader.toml --takes nothing --joints shoulder,elbow,wrist --yes

Exit codes: 0 written, 1 nothing answers, 2 usage, 3 the file exists, 5 the port cannot be opened.";

const EMULATE_HELP: &str = "Examples:
  backdrive device emulate launch/servo-pair/emulated-follower.toml --link /tmp/follower
  backdrive device emulate launch/servo-pair/emulated-follower.toml --fault corrupt=0.01 --fault closed@10

The first line of the output is `port PATH`. Faults: silent, corrupt, late, twice, other_id, checksum (a share of the answers), closed (the cable is pulled).

Exit codes: 0 ended, 2 usage, 3 the file is wrong, 5 no pty.";

/// `backdrive device find`
#[derive(Debug, Args)]
pub struct DeviceFind {
    /// The port; without one the ports of this machine are listed.
    pub port: Option<PathBuf>,
    /// Protocol: feetech_sts, feetech_scs, dynamixel2 or mit; all without.
    #[arg(long, value_name = "NAME")]
    pub protocol: Option<String>,
    /// Baud rate; the usual ones without.
    #[arg(long, value_name = "BAUD")]
    pub baud: Option<u32>,
    /// First and last id that is asked.
    #[arg(long, value_name = "FIRST..LAST", default_value = "0..20")]
    pub ids: String,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `backdrive device new`
#[derive(Debug, Args)]
pub struct DeviceNew {
    /// The port.
    pub port: PathBuf,
    /// The file to write.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace a file that exists.
    #[arg(long)]
    pub overwrite: bool,
    /// Name of the device.
    #[arg(long, default_value = "device")]
    pub name: String,
    /// Protocol: feetech_sts, feetech_scs, dynamixel2 or mit; found without.
    #[arg(long, value_name = "NAME")]
    pub protocol: Option<String>,
    /// Baud rate; found without.
    #[arg(long, value_name = "BAUD")]
    pub baud: Option<u32>,
    /// First and last id that is asked.
    #[arg(long, value_name = "FIRST..LAST", default_value = "0..20")]
    pub ids: String,
    /// What its joints take: position, effort or nothing.
    #[arg(long, default_value = "position")]
    pub takes: String,
    /// Names of the joints in the order of their ids, separated by commas.
    #[arg(long, value_delimiter = ',')]
    pub joints: Vec<String>,
    /// Find signs by small motions of each joint: its motor goes on.
    #[arg(long)]
    pub moves: bool,
    /// Ask nothing: where the joints stand is their zero, and their range is one radian to both sides.
    #[arg(long)]
    pub yes: bool,
}

/// `backdrive device emulate`
#[derive(Debug, Args)]
pub struct Emulate {
    /// The emulator's file.
    pub file: PathBuf,
    /// A link to the port is made here, and removed at the end.
    #[arg(long, value_name = "PATH")]
    pub link: Option<PathBuf>,
    /// What goes wrong, such as corrupt=0.01, late=0.1@2..5 (seconds), or closed@3. May be given several times.
    #[arg(long = "fault", value_name = "FAULT")]
    pub faults: Vec<String>,
    /// End after this time, s.
    #[arg(long = "duration", value_name = "S")]
    pub duration_s: Option<f64>,
    /// End when standard input ends.
    #[arg(long)]
    pub end_with_input: bool,
    /// Print at the end what was carried, and what went wrong on purpose, as JSON.
    #[arg(long)]
    pub json: bool,
}
