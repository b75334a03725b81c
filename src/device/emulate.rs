//! `backdrive device emulate`: a bus of servos for tests, and to try without hardware.

use crate::failure::Failure;
use crate::{cli, interrupt, output};
use backdrive_devices::emulator::{EmulatorFile, Faults, open};
use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Runs an emulator until it is interrupted, its time is over, or its standard input ends where that is asked for.
pub fn emulate(options: &cli::Emulate) -> Result<u8, Failure> {
    let file = EmulatorFile::load(&options.file)?;
    let faults = Faults::of(&[file.faults.as_slice(), &options.faults].concat(), file.seed).map_err(Failure::input)?;
    let stop = interrupt::heard()?;
    let mut emulator = open(&file, faults, options.link.as_deref()).map_err(Failure::machine)?;
    if options.end_with_input {
        ends_with_input(&stop);
    }
    output::line(format!("port {}", emulator.port().display()))?;
    let end = options.duration_s.and_then(|s| Duration::try_from_secs_f64(s).ok()).map(|lasts| Instant::now() + lasts);
    emulator.run(&mut || stop.load(Ordering::Relaxed) || end.is_some_and(|end| Instant::now() >= end));
    if options.json {
        let [taken, sent] = emulator.carried();
        let faults: serde_json::Map<String, serde_json::Value> =
            emulator.faults().into_iter().map(|(name, count)| (name.to_string(), count.into())).collect();
        output::json(&serde_json::json!({ "bytes_taken": taken, "bytes_sent": sent, "faults": faults }))?;
    }
    Ok(0)
}

/// The end of standard input shows that whoever started the emulator is gone.
fn ends_with_input(stop: &Arc<AtomicBool>) {
    let stop = Arc::clone(stop);
    std::thread::spawn(move || {
        let mut bytes = [0u8; 64];
        while std::io::stdin().read(&mut bytes).is_ok_and(|n| n > 0) {}
        stop.store(true, Ordering::Relaxed);
    });
}
