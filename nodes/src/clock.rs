//! CLOCK_MONOTONIC, which all processes of a machine share.

use nix::libc;

/// When step 0 is due, as the supervisor announces it to every node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Start {
    /// CLOCK_MONOTONIC, ns.
    pub t0_ns: i64,
    /// Unix time at that moment, ns.
    pub unix_ns: i64,
}

impl Start {
    /// Step 0 is due after `delay_ns`.
    pub fn after(delay_ns: i64) -> Start {
        let unix = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |d| d.as_nanos() as i64);
        Start { t0_ns: now_ns() + delay_ns, unix_ns: unix + delay_ns }
    }

    /// Unix time at a moment of CLOCK_MONOTONIC, ns. All of a run go by it, so that setting the machine's clock neither turns stamps back nor
    /// puts arrivals before them.
    pub fn unix_at(&self, monotonic_ns: i64) -> i64 {
        self.unix_ns.saturating_add(monotonic_ns.saturating_sub(self.t0_ns))
    }
}

/// CLOCK_MONOTONIC now, ns.
#[inline]
pub fn now_ns() -> i64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: writes the timespec. It cannot fail: the clock exists on every Linux.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time) };
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// Looks at CLOCK_MONOTONIC until it reaches `due_ns`.
pub(crate) fn poll_until_ns(due_ns: i64) {
    while now_ns() < due_ns {
        std::hint::spin_loop();
    }
}

/// Sleeps until CLOCK_MONOTONIC reaches `due_ns`; a signal ends it early.
pub(crate) fn sleep_until_ns(due_ns: i64) {
    let time = libc::timespec { tv_sec: due_ns.div_euclid(1_000_000_000), tv_nsec: due_ns.rem_euclid(1_000_000_000) };
    // SAFETY: reads the timespec; with an absolute time nothing is written back.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &time, std::ptr::null_mut()) };
}
