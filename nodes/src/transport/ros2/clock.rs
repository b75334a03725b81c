//! Notices what the middleware does not survive: a wall clock that is set back, and a process that was stopped.

use super::Network;
use super::participant::Participant;
use nix::sys::signal::{SigHandler, Signal, signal};
use nix::time::{ClockId, clock_gettime};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Set when the process goes on after it was stopped: the middleware's waits are interrupted then, which ends its threads.
static CONTINUED: AtomicBool = AtomicBool::new(false);

extern "C" fn on_continue(_: i32) {
    CONTINUED.store(true, Ordering::SeqCst);
}

/// How often it looks.
const EVERY: Duration = Duration::from_millis(20);

/// Steps back by less are over before they could be acted on, ns.
const LEAST_STEP_NS: i64 = 100_000_000;

/// Makes a new participant when the old one is deaf.
pub(super) struct ClockWatch {
    /// Wall clock less CLOCK_MONOTONIC, ns.
    difference_ns: i64,
    looked: Instant,
    coming: Option<Receiver<Participant>>,
}

impl ClockWatch {
    pub fn new() -> ClockWatch {
        // SAFETY: the handler does nothing but store to an atomic.
        let _ = unsafe { signal(Signal::SIGCONT, SigHandler::Handler(on_continue)) };
        ClockWatch { difference_ns: difference_ns(), looked: Instant::now(), coming: None }
    }

    /// A participant that was made after a step back or a stop, when it is there.
    pub fn look(&mut self, network: &Network, name: &str) -> Option<Participant> {
        if self.looked.elapsed() < EVERY {
            return None;
        }
        self.looked = Instant::now();
        let now = difference_ns();
        // A slow drift is followed; only what is sudden is a step.
        let stepped_back = self.difference_ns - now > LEAST_STEP_NS;
        self.difference_ns = now;
        if CONTINUED.swap(false, Ordering::SeqCst) || stepped_back {
            let (send, coming) = channel();
            let (network, name) = (network.clone(), name.to_string());
            std::thread::spawn(move || {
                if let Ok(made) = Participant::open(&network, &name) {
                    let _ = send.send(made);
                }
            });
            self.coming = Some(coming);
        }
        match self.coming.as_ref()?.try_recv() {
            Ok(made) => {
                self.coming = None;
                Some(made)
            }
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.coming = None;
                None
            }
        }
    }

    /// Releases a participant that is no longer used; its threads end in the background.
    pub fn retire(&self, old: Arc<Participant>) {
        std::thread::spawn(move || {
            // Its ports are recreated one by one, and wait for theirs.
            std::thread::sleep(Duration::from_secs(2));
            drop(old);
        });
    }
}

fn difference_ns() -> i64 {
    let read = |clock| clock_gettime(clock).map_or(0, |t| t.tv_sec() * 1_000_000_000 + t.tv_nsec());
    let before = read(ClockId::CLOCK_MONOTONIC);
    let unix = read(ClockId::CLOCK_REALTIME);
    let after = read(ClockId::CLOCK_MONOTONIC);
    unix - (before + (after - before) / 2)
}
