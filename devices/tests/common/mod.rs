//! Emulators in a thread of the test, and device files for them.
#![allow(dead_code)]

use backdrive_devices::emulator::{EmulatorFile, Faults, open};
use backdrive_devices::file::DeviceFile;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;

/// Protocols, and what each of them can take.
pub const BUSES: [(&str, &[&str]); 4] = [
    ("feetech_sts", &["position"]),
    ("feetech_scs", &["position"]),
    ("dynamixel2", &["position", "effort"]),
    ("mit", &["position", "effort"]),
];

const PLANT: &str = r#"
name = "servo"
motion = "rotation"
bodies = { rotor = 0.01 }
elements = [{ name = "bearing", kind = "damper", between = ["rotor", "ground"], damping = 0.1 }]
inputs = [{ name = "torque", kind = "force", on = "rotor" }]
outputs = [{ name = "angle", kind = "position", of = "rotor" }]
axes = [{ name = "turn", user = "rotor", feedback = "torque", measured = "angle" }]
"#;

/// An emulator that runs until it is dropped.
pub struct Running {
    pub port: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Vec<(&'static str, u64)>>>,
    folder: tempfile::TempDir,
}

impl Running {
    /// `joints` servos with ids from 1, of a protocol, with faults.
    pub fn start(protocol: &str, joints: u32, faults: &[&str]) -> Running {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("plant.toml"), PLANT).unwrap();
        let mut text = format!("protocol = \"{protocol}\"\nbaud = 1000000\n");
        for id in 1..=joints {
            text.push_str(&format!("[[servos]]\nid = {id}\nmodel = \"plant.toml\"\ntorque_constant = 1.0\n"));
        }
        let file = folder.path().join("emulator.toml");
        std::fs::write(&file, text).unwrap();
        Running::of(&file, faults, folder)
    }

    fn of(file: &Path, faults: &[&str], folder: tempfile::TempDir) -> Running {
        let file = EmulatorFile::load(file).unwrap();
        let faults = Faults::of(faults, file.seed).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let (opened, port) = channel();
        let stopped = Arc::clone(&stop);
        let link = folder.path().join("port");
        let thread = std::thread::spawn(move || {
            let mut emulator = open(&file, faults, Some(&link)).unwrap();
            opened.send(link).unwrap();
            emulator.run(&mut || stopped.load(Ordering::Relaxed));
            emulator.faults()
        });
        Running { port: port.recv().unwrap(), stop, thread: Some(thread), folder }
    }

    /// Ends it; how often each fault happened.
    pub fn end(&mut self) -> Vec<(&'static str, u64)> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(|thread| thread.join().unwrap()).unwrap_or_default()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end();
    }
}

/// A device's file for joints with ids from 1; `more` is added to each joint.
pub fn device(protocol: &str, port: &Path, joints: u32, takes: &str, more: &str) -> DeviceFile {
    let mut text = format!(
        "name = \"device\"\nprotocol = \"{protocol}\"\nport = \"{}\"\nbaud = 1000000\ntimeout_s = 0.05\nramp_s = 0.0\n",
        port.display()
    );
    for id in 1..=joints {
        text.push_str(&format!("[[joints]]\nname = \"j{id}\"\nid = {id}\ntakes = \"{takes}\"\nrange = [-6.0, 6.0]\n"));
        text.push_str("effort = 1.0\ntorque_constant = 1.0\nstiffness = 20.0\ndamping = 0.4\n");
        text.push_str(more);
        text.push('\n');
    }
    DeviceFile::parse(&text, "device.toml").unwrap()
}
