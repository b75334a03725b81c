//! Shared memory, rights, timers, processors, clock, and what dead runs have left.

use super::Finding;
use crate::RunHome;
use backdrive_nodes::clock::now_ns;
use backdrive_nodes::graph::MAX_RATE_HZ;
use backdrive_nodes::realtime;
use nix::libc;
use std::io::{Read, Write};
use std::time::Duration;

/// Shared memory that a graph of six nodes and a long recorder buffer uses, bytes.
const SHM_WANTED: u64 = 256 << 20;

/// Wake-ups that are timed.
const WAKES: usize = 500;

/// Ways there and back between two threads that are timed.
const HOPS: usize = 2000;

pub(super) fn look() -> Vec<Finding> {
    let mut findings = vec![shared_memory()];
    // On a thread that ends: its scheduling is not to be kept.
    let tried = std::thread::spawn(|| (realtime::enter(&realtime::Options::default()), lateness_us())).join();
    if let Ok((refused, (p50, p99))) = tried {
        findings.push(rights(&refused));
        findings.push(timers(p50, p99));
    }
    findings.extend(hop_us().map(|(p50, p99)| ways(p50, p99)));
    findings.extend([timer_slack(), processors(), wall_clock(), leftovers()]);
    findings
}

fn shared_memory() -> Finding {
    const PART: &str = "shared memory";
    let probe = format!("/dev/shm/bd_doctor_{}", std::process::id());
    let written = std::fs::write(&probe, [1_u8; 4096]);
    let _ = std::fs::remove_file(&probe);
    if let Err(e) = written {
        return Finding::bad(
            PART,
            format!("/dev/shm cannot be written: {e}"),
            "mount a tmpfs there with mode 1777; runs over iceoryx2 need it",
        );
    }
    let Ok(stat) = nix::sys::statvfs::statvfs("/dev/shm") else { return Finding::fine(PART, "/dev/shm can be written") };
    let mib = |blocks: u64| blocks.saturating_mul(stat.fragment_size()) >> 20;
    let (free, all) = (mib(stat.blocks_available()), mib(stat.blocks()));
    if stat.blocks() > 0 && free << 20 < SHM_WANTED {
        let advice = "run `backdrive clean`, or in a container give it more with --shm-size=256m";
        return Finding::weak(PART, format!("{free} of {all} MiB free in /dev/shm"), advice);
    }
    Finding::fine(PART, format!("{free} of {all} MiB free in /dev/shm"))
}

fn rights(refused: &[String]) -> Finding {
    const PART: &str = "real-time";
    if refused.is_empty() {
        return Finding::fine(PART, "SCHED_FIFO and locked memory are permitted");
    }
    let advice = "in /etc/security/limits.conf give this user `rtprio 99` and `memlock unlimited`, and log in again";
    Finding::weak(PART, format!("refused: {}", refused.join("; ")), advice)
}

/// How late a thread wakes at 1 kHz, median and 99th percentile, us.
fn lateness_us() -> (f64, f64) {
    let (mut late, mut due) = (Vec::with_capacity(WAKES), now_ns() + 1_000_000);
    for _ in 0..WAKES {
        let wait = due - now_ns();
        if wait > 0 {
            std::thread::sleep(Duration::from_nanos(wait as u64));
        }
        late.push((now_ns() - due).max(0));
        due += 1_000_000;
    }
    late.sort_unstable();
    (late[WAKES / 2] as f64 * 1e-3, late[WAKES * 99 / 100] as f64 * 1e-3)
}

fn timers(p50: f64, p99: f64) -> Finding {
    let found = format!("wakes at 1 kHz {p50:.0} us late in the median, {p99:.0} us at the 99th percentile");
    if p99 > 500.0 {
        let advice =
            "another load, a power-saving governor or a busy virtual machine takes the processor; a kernel with PREEMPT_RT helps most";
        return Finding::weak("timers", found, advice);
    }
    Finding::fine("timers", found)
}

/// How long a byte takes from one thread that sleeps to the other and wakes it, median and 99th percentile, us; with what the machine
/// grants a loop in real time.
fn hop_us() -> Option<(f64, f64)> {
    let ((mut heard, mut there), (mut back, mut answer)) = (std::io::pipe().ok()?, std::io::pipe().ok()?);
    let echo = std::thread::spawn(move || {
        realtime::enter(&realtime::Options::default());
        let mut byte = [0];
        while heard.read_exact(&mut byte).is_ok() && answer.write_all(&byte).is_ok() {}
    });
    let timed = std::thread::spawn(move || {
        realtime::enter(&realtime::Options::default());
        let (mut times, mut byte) = (Vec::with_capacity(HOPS), [0]);
        for _ in 0..HOPS {
            let begun = now_ns();
            there.write_all(&byte).and_then(|()| back.read_exact(&mut byte)).ok()?;
            times.push(now_ns() - begun);
        }
        times.sort_unstable();
        Some((times[HOPS / 2] as f64 * 0.5e-3, times[HOPS * 99 / 100] as f64 * 0.5e-3))
    });
    let times = timed.join().ok()?;
    echo.join().ok()?;
    times
}

fn ways(p50: f64, p99: f64) -> Finding {
    const PART: &str = "between processes";
    // Five nodes one after the other within a step, all five as slow as one in a hundred.
    let rate = (1e6 / (5.0 * p99)).min(MAX_RATE_HZ);
    let found = format!(
        "a sample wakes the next process in {p50:.1} us in the median, {p99:.1} us at the 99th percentile; five nodes in a row leave time for {rate:.0} Hz"
    );
    if rate < MAX_RATE_HZ {
        let advice = "nodes of a faster loop share a process (`together` in the graph, docs/guide.md), or get processors of their own";
        return Finding::weak(PART, found, advice);
    }
    Finding::fine(PART, found)
}

fn timer_slack() -> Finding {
    let slack = std::fs::read_to_string("/proc/self/timerslack_ns").ok().and_then(|t| t.trim().parse::<u64>().ok());
    match (slack, nix::sys::prctl::set_timerslack(1)) {
        (_, Err(e)) => Finding::weak("timer slack", format!("cannot be cut: {}", e.desc()), "every deadline is late by it"),
        (Some(ns), Ok(())) => Finding::fine("timer slack", format!("{} us by default; nodes cut it to 1 ns", ns / 1000)),
        (None, Ok(())) => Finding::fine("timer slack", "nodes cut it to 1 ns"),
    }
}

fn processors() -> Finding {
    const PART: &str = "processors";
    let count = std::thread::available_parallelism().map_or(1, usize::from);
    let governor = std::fs::read_to_string("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor").unwrap_or_default();
    let stolen = || -> Option<f64> {
        let text = std::fs::read_to_string("/proc/stat").ok()?;
        let numbers: Vec<f64> = text.lines().next()?.split_whitespace().skip(1).filter_map(|n| n.parse().ok()).collect();
        Some(100.0 * numbers.get(7)? / numbers.iter().sum::<f64>())
    };
    let steal = stolen().unwrap_or(0.0);
    let found = format!("{count} processors, {steal:.1} % of their time taken by the hypervisor since boot");
    if governor.trim() == "powersave" {
        return Finding::weak(PART, format!("{found}; governor powersave"), "`cpupower frequency-set -g performance`");
    }
    if steal > 1.0 {
        return Finding::weak(PART, found, "a virtual machine that shares its processors misses deadlines; give it its own");
    }
    if count < 2 {
        return Finding::weak(PART, found, "real time wants one processor for the loop and one for the rest");
    }
    Finding::fine(PART, found)
}

fn wall_clock() -> Finding {
    const PART: &str = "wall clock";
    // SAFETY: all zeros is a valid timex that only asks, and the call fills it.
    let (state, timex) = unsafe {
        let mut timex: libc::timex = std::mem::zeroed();
        (libc::adjtimex(&mut timex), timex)
    };
    if state < 0 || timex.status & libc::STA_UNSYNC != 0 {
        let advice = "run chrony or systemd-timesyncd on each host; a run measures the offset all the same";
        return Finding::weak(PART, "is not kept in step with any other clock", advice);
    }
    Finding::fine(PART, format!("is kept in step, estimated error {} us", timex.esterror))
}

fn leftovers() -> Finding {
    let dead = RunHome::system().dead();
    match dead.len() {
        0 => Finding::fine("leftovers", "no dead run has left anything"),
        n => Finding::weak("leftovers", format!("{n} dead runs have left files"), "`backdrive clean` removes them"),
    }
}
