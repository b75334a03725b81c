//! The doorbell of one receiving node: a futex word that its publishers count up.
//!
//! A publisher pays for a system call only while the receiver sleeps, and only if the receiver waits
//! for what it sends: a stage with several inputs would otherwise be woken for each, and look in vain. iceoryx2's own event costs
//! two system calls on each side (a datagram), about twice the latency of a pipe.

use nix::libc;
use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

const SLEEPING: u32 = 1;
const RING: u32 = 2;

/// Bit 0 says that the receiver sleeps or is about to; the rest counts rings. All zeros is a valid bell.
#[repr(C, align(64))]
pub(crate) struct Bell {
    word: AtomicU32,
    /// The tones for which a sleeping receiver wants to be woken, a bit each.
    awaited: AtomicU64,
}

/// How long a receiver looks at its bell before it sleeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Spin {
    /// Looks with a pause instruction between them.
    pub pauses: u32,
    /// Looks with the processor offered to others between them.
    pub yields: u32,
}

impl Bell {
    pub fn new() -> Bell {
        Bell { word: AtomicU32::new(0), awaited: AtomicU64::new(0) }
    }

    /// Tells the receiver that something has arrived, with the tone of what it is.
    #[inline]
    pub fn ring(&self, tone: u8) {
        let before = self.word.fetch_add(RING, Ordering::SeqCst);
        if before & SLEEPING != 0 && self.awaited.load(Ordering::SeqCst) >> tone & 1 != 0 {
            // Cleared here, so that further rings before the receiver runs cost no system call.
            self.word.fetch_and(!SLEEPING, Ordering::SeqCst);
            futex(&self.word, libc::FUTEX_WAKE, 1, None);
        }
    }

    /// Waits until the bell has rung since `seen`, or the time is over, or a signal came. Once asleep only
    /// a tone of `awaited` ends it.
    pub fn wait(&self, seen: &mut u32, awaited: u64, timeout: Duration, spin: Spin) {
        if self.rung(seen) || timeout.is_zero() {
            return;
        }
        for _ in 0..spin.pauses {
            std::hint::spin_loop();
            if self.rung(seen) {
                return;
            }
        }
        let started = Instant::now();
        for _ in 0..spin.yields {
            std::thread::yield_now();
            if self.rung(seen) || started.elapsed() >= timeout {
                return;
            }
        }
        // Before the sleeping bit: who sees the bit sees these.
        self.awaited.store(awaited, Ordering::SeqCst);
        if self.word.compare_exchange(*seen, *seen | SLEEPING, Ordering::SeqCst, Ordering::SeqCst).is_ok() {
            futex(&self.word, libc::FUTEX_WAIT, *seen | SLEEPING, Some(timeout));
            self.word.fetch_and(!SLEEPING, Ordering::SeqCst);
        }
        self.rung(seen);
    }

    #[inline]
    fn rung(&self, seen: &mut u32) -> bool {
        let now = self.word.load(Ordering::SeqCst) & !SLEEPING;
        std::mem::replace(seen, now) != now
    }
}

/// Neither operation's result matters: every return means "look again".
fn futex(word: &AtomicU32, operation: i32, value: u32, timeout: Option<Duration>) {
    let time = timeout.map(|t| libc::timespec { tv_sec: t.as_secs() as _, tv_nsec: t.subsec_nanos() as _ });
    let pointer = time.as_ref().map_or(std::ptr::null(), |t| t as *const libc::timespec);
    // SAFETY: the word outlives the call, and the kernel reads the time only during it.
    unsafe {
        libc::syscall(libc::SYS_futex, word.as_ptr(), operation, value, pointer);
    }
}

/// Which of a node's subscribers wait, as the tones of its bell.
#[derive(Debug, Default)]
pub(crate) struct Tones {
    /// Per tone the topic's number, and how many subscribers wait for it.
    waiting: RefCell<Vec<(usize, usize)>>,
    mask: Cell<u64>,
}

impl Tones {
    /// The tone of a topic; topics beyond the 63rd share the last.
    pub fn of(&self, topic: usize) -> u8 {
        let mut waiting = self.waiting.borrow_mut();
        let tone = waiting.iter().position(|(t, _)| *t == topic).unwrap_or_else(|| {
            waiting.push((topic, 0));
            waiting.len() - 1
        });
        tone.min(63) as u8
    }

    /// One subscriber more, or one fewer, waits for this tone.
    pub fn change(&self, tone: u8, waits: bool) {
        if let Some((_, count)) = self.waiting.borrow_mut().get_mut(usize::from(tone)) {
            *count = if waits { *count + 1 } else { count.saturating_sub(1) };
            let bit = 1 << tone;
            self.mask.set(if *count > 0 { self.mask.get() | bit } else { self.mask.get() & !bit });
        }
    }

    /// The tones that somebody waits for.
    pub fn awaited(&self) -> u64 {
        self.mask.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    const NONE: Spin = Spin { pauses: 0, yields: 0 };

    #[test]
    fn a_ring_before_the_wait_is_not_lost() {
        let (bell, mut seen) = (Bell::new(), 0);
        bell.ring(0);
        let started = Instant::now();
        bell.wait(&mut seen, 1, Duration::from_secs(10), NONE);
        assert!(started.elapsed() < Duration::from_secs(5));
        bell.wait(&mut seen, 1, Duration::from_millis(20), NONE);
        assert!(started.elapsed() >= Duration::from_millis(20));
    }

    #[test]
    fn two_bells_play_ping_pong() {
        let bells = Arc::new((Bell::new(), Bell::new(), AtomicU32::new(0)));
        let other = Arc::clone(&bells);
        let rounds = 20_000;
        let thread = std::thread::spawn(move || {
            let mut seen = 0;
            for i in 0..rounds {
                while other.2.load(Ordering::SeqCst) != 2 * i + 1 {
                    other.0.wait(&mut seen, 1, Duration::from_secs(10), NONE);
                }
                other.2.store(2 * i + 2, Ordering::SeqCst);
                other.1.ring(0);
            }
        });
        let mut seen = 0;
        let started = Instant::now();
        for i in 0..rounds {
            bells.2.store(2 * i + 1, Ordering::SeqCst);
            bells.0.ring(0);
            while bells.2.load(Ordering::SeqCst) != 2 * i + 2 {
                bells.1.wait(&mut seen, 1, Duration::from_secs(10), NONE);
            }
        }
        assert!(thread.join().is_ok());
        // A lost wake would cost ten seconds each.
        assert!(started.elapsed() < Duration::from_secs(9));
    }
}
