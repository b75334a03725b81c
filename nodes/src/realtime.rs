//! What the operating system can do for a process with deadlines. What it refuses is named, and the node runs without.

use nix::libc;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;

/// What to ask for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// SCHED_FIFO priority, 1 to 99; `None` leaves the scheduler alone.
    pub priority: Option<i32>,
    /// Keep all memory in RAM.
    pub lock_memory: bool,
    /// Processors to run on; empty for all.
    pub processors: Vec<usize>,
}

impl Default for Options {
    /// Priority 50, memory locked, any processor.
    fn default() -> Options {
        Options { priority: Some(50), lock_memory: true, processors: Vec::new() }
    }
}

/// Whether the kernel holds SCHED_FIFO threads back that never sleep, which it does for a twentieth of each second by default
/// (`kernel.sched_rt_runtime_us`; -1 lets them run). True where it does not say.
pub fn is_throttled() -> bool {
    std::fs::read_to_string("/proc/sys/kernel/sched_rt_runtime_us").map_or(true, |text| text.trim() != "-1")
}

/// Enters real time with the calling thread; returns what was refused, a clause each.
///
/// The timer slack is always cut to 1 ns: it needs no privilege, and its default alone makes every
/// deadline 50 µs late.
pub fn enter(options: &Options) -> Vec<String> {
    let mut refused = Vec::new();
    if let Err(e) = nix::sys::prctl::set_timerslack(1) {
        refused.push(format!("timer slack: {}", e.desc()));
    }
    if !options.processors.is_empty() {
        let mut set = CpuSet::new();
        let result = options.processors.iter().try_for_each(|p| set.set(*p)).and_then(|()| sched_setaffinity(Pid::from_raw(0), &set));
        if let Err(e) = result {
            refused.push(format!("processors {:?}: {}", options.processors, e.desc()));
        }
    }
    if let Some(priority) = options.priority {
        // SAFETY: integers, all of which may be 0; how many there are differs between C libraries.
        let mut parameter: libc::sched_param = unsafe { std::mem::zeroed() };
        parameter.sched_priority = priority;
        // SAFETY: reads the parameter, of the calling thread. (musl refuses sched_setscheduler, whatever it is asked.)
        let code = unsafe { libc::pthread_setschedparam(libc::pthread_self(), libc::SCHED_FIFO, &parameter) };
        if code != 0 {
            refused.push(format!("SCHED_FIFO {priority}: {} (see RLIMIT_RTPRIO)", nix::errno::Errno::from_raw(code).desc()));
        }
    }
    if options.lock_memory {
        // Only what is mapped now: later buffers must not fail for want of lockable memory. And only pages
        // that are touched: most of a topic's segment is room for listeners that never come.
        // SAFETY: takes flags only.
        if unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_ONFAULT) } != 0 {
            refused.push(format!("memory lock: {} (see RLIMIT_MEMLOCK)", nix::errno::Errno::last().desc()));
        }
    }
    refused
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_named_and_does_not_fail() {
        let impossible = Options { priority: Some(1000), lock_memory: false, processors: vec![100_000] };
        let refused = std::thread::spawn(move || enter(&impossible)).join().unwrap_or_default();
        assert_eq!(refused.len(), 2, "{refused:?}");
        assert!(refused[0].starts_with("processors") && refused[1].starts_with("SCHED_FIFO"));
    }
}
