//! Signals that end a run. The handlers are there only while a run lasts: before and after it, Ctrl-C does what it always does.

use crate::error::LaunchError;
use nix::sys::signal::{SaFlags, SigAction, SigHandler, SigSet, Signal, sigaction};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// SIGTSTP among them: a suspended supervisor would leave the force loop without one.
const WATCHED: [Signal; 4] = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP, Signal::SIGTSTP];

static COUNTS: [AtomicU32; 4] = [const { AtomicU32::new(0) }; 4];

/// Runs of this process that watch now, and the handlers to put back.
static WATCHING: Mutex<(usize, Vec<(Signal, SigAction)>)> = Mutex::new((0, Vec::new()));

extern "C" fn count(number: i32) {
    if let Some(index) = WATCHED.iter().position(|&s| s as i32 == number) {
        COUNTS[index].fetch_add(1, Ordering::SeqCst);
    }
}

/// Sees the signals that arrive while it exists.
pub(crate) struct Signals {
    seen: [u32; 4],
}

impl Signals {
    /// Signals that were ignored, as under nohup, stay ignored; not SIGINT, which shells have their background jobs ignore: whoever sends
    /// it to a run means it.
    pub fn watch() -> Result<Signals, LaunchError> {
        let mut watching = WATCHING.lock().unwrap_or_else(PoisonError::into_inner);
        if watching.0 == 0 {
            let action = SigAction::new(SigHandler::Handler(count), SaFlags::SA_RESTART, SigSet::empty());
            for signal in WATCHED {
                // SAFETY: the handler only adds to an atomic number.
                let before = unsafe { sigaction(signal, &action) }
                    .map_err(|e| LaunchError::Runtime { what: signal.as_str(), reason: e.to_string() })?;
                if signal != Signal::SIGINT && matches!(before.handler(), SigHandler::SigIgn) {
                    // SAFETY: puts back what was there.
                    let _ = unsafe { sigaction(signal, &before) };
                } else {
                    watching.1.push((signal, before));
                }
            }
        }
        watching.0 += 1;
        Ok(Signals { seen: std::array::from_fn(|i| COUNTS[i].load(Ordering::SeqCst)) })
    }

    /// A signal that has arrived since the last call.
    pub fn next(&mut self) -> Option<Signal> {
        for (index, signal) in WATCHED.into_iter().enumerate() {
            let now = COUNTS[index].load(Ordering::SeqCst);
            if now != self.seen[index] {
                // One by one: two Ctrl-C within a tick are two.
                self.seen[index] = self.seen[index].wrapping_add(1);
                return Some(signal);
            }
        }
        None
    }
}

impl Drop for Signals {
    fn drop(&mut self) {
        let mut watching = WATCHING.lock().unwrap_or_else(PoisonError::into_inner);
        watching.0 = watching.0.saturating_sub(1);
        if watching.0 == 0 {
            for (signal, before) in std::mem::take(&mut watching.1) {
                // SAFETY: puts back what was there.
                let _ = unsafe { sigaction(signal, &before) };
            }
        }
    }
}
