//! The doorbell of one receiving node: a futex word that its publishers count up.
//!
//! A publisher pays for a system call only while the receiver sleeps, and only if the receiver waits for what it sends. A stage with several inputs
//! would otherwise be woken for each, and look in vain. iceoryx2's own event costs two system calls on each side (a datagram), about twice the
//! latency of a pipe.

use nix::libc;
use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, Instant};

const SLEEPING: u32 = 1;
const RING: u32 = 2;

/// Bit 0 is set while the receiver sleeps or is about to; the rest counts rings. All zeros is a valid bell.
#[repr(C, align(64))]
pub(crate) struct Bell {
    word: AtomicU32,
    /// The tones for which a sleeping receiver wants to be woken, a bit each.
    awaited: AtomicU64,
}

/// How a receiver looks at its bell before it sleeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Looks {
    /// Not at all: it sleeps at once.
    None,
    /// Once more after it has offered its processor to others. Where nodes outnumber processors the publisher it waits for often runs
    /// then, and neither sleep nor wake is paid for. Where a process that has nothing to do with the run takes the offer it keeps the
    /// processor for milliseconds; so the longer an offer took, the longer no other is made.
    Offer(Offer),
    /// As long as it may wait: it never sleeps, and needs a processor for itself.
    Poll,
}

/// When a processor is offered to others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Offer {
    /// Waits that go by without one.
    pause: u32,
    /// The pause after the next one that takes long.
    penalty: u32,
}

/// An offer that took longer went to somebody else; a round of five nodes takes a tenth of it.
const LONG: Duration = Duration::from_micros(150);

/// Most waits without an offer: one that takes 4 ms then costs a microsecond a wait.
const MOST_PAUSE: u32 = 4096;

impl Offer {
    /// Whether this wait makes one.
    fn due(&mut self) -> bool {
        let due = self.pause == 0;
        self.pause = self.pause.saturating_sub(1);
        due
    }

    fn took(&mut self, time: Duration) {
        if time > LONG {
            self.penalty = (self.penalty.max(32) * 2).min(MOST_PAUSE);
            self.pause = self.penalty;
        } else {
            self.penalty -= self.penalty / 8;
        }
    }
}

impl Bell {
    pub fn new() -> Bell {
        Bell { word: AtomicU32::new(0), awaited: AtomicU64::new(0) }
    }

    /// Notifies the receiver that something has arrived, with the tone of what it is.
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
    pub fn wait(&self, seen: &mut u32, awaited: u64, timeout: Duration, looks: &mut Looks) {
        if self.rung(seen) || timeout.is_zero() {
            return;
        }
        match looks {
            Looks::None => {}
            Looks::Offer(offer) => {
                if offer.due() {
                    let started = Instant::now();
                    std::thread::yield_now();
                    let rung = self.rung(seen);
                    let took = started.elapsed();
                    offer.took(took);
                    if rung || took >= timeout {
                        return;
                    }
                }
            }
            Looks::Poll => {
                let started = Instant::now();
                loop {
                    // The clock costs more than a look.
                    for _ in 0..64 {
                        std::hint::spin_loop();
                        if self.rung(seen) {
                            return;
                        }
                    }
                    if started.elapsed() >= timeout {
                        return;
                    }
                }
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

    #[test]
    fn a_ring_before_the_wait_is_not_lost() {
        let (bell, mut seen) = (Bell::new(), 0);
        bell.ring(0);
        let started = Instant::now();
        bell.wait(&mut seen, 1, Duration::from_secs(10), &mut Looks::None);
        assert!(started.elapsed() < Duration::from_secs(5));
        bell.wait(&mut seen, 1, Duration::from_millis(20), &mut Looks::None);
        assert!(started.elapsed() >= Duration::from_millis(20));
    }

    #[test]
    fn offers_that_take_long_become_rare() {
        let mut offer = Offer::default();
        let mut made = 0;
        for _ in 0..100_000 {
            if offer.due() {
                made += 1;
                offer.took(Duration::from_millis(4));
            }
        }
        assert!((10..60).contains(&made), "{made} offers");
        // Where they are short again they are made at every wait.
        let mut waits = 0;
        while offer.penalty > 8 {
            waits += 1;
            if offer.due() {
                offer.took(Duration::from_micros(20));
            }
        }
        assert!(offer.due() && waits < 10_000, "{waits}");
    }

    #[test]
    fn who_polls_sees_a_ring_and_the_end_of_its_time() {
        let bell = Arc::new(Bell::new());
        let other = Arc::clone(&bell);
        let (mut seen, started) = (0, Instant::now());
        bell.wait(&mut seen, 1, Duration::from_millis(20), &mut Looks::Poll);
        assert!(started.elapsed() >= Duration::from_millis(20));
        let thread = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            other.ring(0);
        });
        bell.wait(&mut seen, 1, Duration::from_secs(20), &mut Looks::Poll);
        assert!(started.elapsed() < Duration::from_secs(10));
        assert!(thread.join().is_ok());
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
                    other.0.wait(&mut seen, 1, Duration::from_secs(10), &mut Looks::None);
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
                bells.1.wait(&mut seen, 1, Duration::from_secs(10), &mut Looks::None);
            }
        }
        assert!(thread.join().is_ok());
        // A lost wake would cost ten seconds each.
        assert!(started.elapsed() < Duration::from_secs(9));
    }
}
