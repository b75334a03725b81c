//! A cable with faults, in user space: an interface in each namespace, and a thread that carries frames between them.

use nix::libc;
use nix::sched::{CloneFlags, setns};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsRawFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What the cable does to a frame in either direction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Link {
    /// One way, s.
    pub delay_s: f64,
    /// Most that is added, uniformly, s: frames overtake each other.
    pub jitter_s: f64,
    /// Share of frames lost, 0 to 1.
    pub loss: f64,
    /// Nothing passes.
    pub cut: bool,
}

/// Carries frames while it exists.
pub struct Relay {
    link: Arc<Mutex<Link>>,
    stop: Arc<AtomicBool>,
    carried: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    /// Makes an interface of this name in each namespace.
    pub fn between(namespaces: &[String; 2], name: &str, link: Link) -> Result<Relay, String> {
        let ends = [tap(&namespaces[0], name)?, tap(&namespaces[1], name)?];
        let (link, stop, carried) = (Arc::new(Mutex::new(link)), Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let (shared, stopped, count) = (Arc::clone(&link), Arc::clone(&stop), Arc::clone(&carried));
        let thread = std::thread::spawn(move || carry(ends, &shared, &stopped, &count));
        Ok(Relay { link, stop, carried, thread: Some(thread) })
    }

    /// From now on the cable is like this.
    pub fn set(&self, link: Link) {
        *self.link.lock().unwrap_or_else(PoisonError::into_inner) = link;
    }

    /// Frames carried so far.
    pub fn carried(&self) -> u64 {
        self.carried.load(Ordering::SeqCst)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// An interface in another namespace: a thread goes there to make it, and its descriptor works from anywhere.
fn tap(namespace: &str, name: &str) -> Result<File, String> {
    let (path, name) = (format!("/var/run/netns/{namespace}"), name.to_string());
    let made = std::thread::spawn(move || -> Result<File, String> {
        let there = File::open(&path).map_err(|e| format!("{path}: {e}"))?;
        setns(&there, CloneFlags::CLONE_NEWNET).map_err(|e| format!("setns: {e}"))?;
        let file = File::options().read(true).write(true).open("/dev/net/tun").map_err(|e| format!("/dev/net/tun: {e}"))?;
        // SAFETY: all zeros is a valid request, and the kernel reads it during the call only.
        let result = unsafe {
            let mut request: libc::ifreq = std::mem::zeroed();
            for (to, from) in request.ifr_name.iter_mut().zip(name.bytes()) {
                *to = from as libc::c_char;
            }
            request.ifr_ifru.ifru_flags = (libc::IFF_TAP | libc::IFF_NO_PI) as libc::c_short;
            const TUNSETIFF: libc::c_ulong = 0x4004_54ca;
            let made = libc::ioctl(file.as_raw_fd(), TUNSETIFF, &raw const request);
            libc::fcntl(file.as_raw_fd(), libc::F_SETFL, libc::O_NONBLOCK);
            made
        };
        if result < 0 { Err(format!("TUNSETIFF: {}", std::io::Error::last_os_error())) } else { Ok(file) }
    });
    made.join().map_err(|_| "a thread has panicked".to_string())?
}

/// A frame on its way: due, order of arrival, end, bytes.
type Frame = (Instant, u64, usize, Vec<u8>);

fn carry(mut ends: [File; 2], link: &Mutex<Link>, stop: &AtomicBool, carried: &AtomicU64) {
    // A relay that waits for a processor would be a slow cable.
    let parameter = libc::sched_param { sched_priority: 60 };
    // SAFETY: plain calls on this thread.
    unsafe {
        libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameter);
        libc::prctl(libc::PR_SET_TIMERSLACK, 1);
    }
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut held, mut count): (BinaryHeap<Reverse<Frame>>, u64) = (BinaryHeap::new(), 0);
    let mut buffer = vec![0; 65_536];
    while !stop.load(Ordering::SeqCst) {
        let now = Instant::now();
        let wait = held.peek().map_or(Duration::from_millis(20), |Reverse(f)| f.0.saturating_duration_since(now));
        let mut polled = [0, 1].map(|i: usize| libc::pollfd { fd: ends[i].as_raw_fd(), events: libc::POLLIN, revents: 0 });
        let time = libc::timespec { tv_sec: 0, tv_nsec: i64::from(wait.min(Duration::from_millis(20)).subsec_nanos()) };
        // SAFETY: the descriptors are open, and the arrays live as long as the call.
        unsafe { libc::ppoll(polled.as_mut_ptr(), 2, &time, std::ptr::null()) };
        let how = *link.lock().unwrap_or_else(PoisonError::into_inner);
        for (from, entry) in polled.iter().enumerate() {
            if entry.revents & libc::POLLIN == 0 {
                continue;
            }
            while let Ok(length) = ends[from].read(&mut buffer) {
                if how.cut || random.random::<f64>() < how.loss {
                    continue;
                }
                let delay = how.delay_s + how.jitter_s * random.random::<f64>();
                count += 1;
                held.push(Reverse((Instant::now() + Duration::from_secs_f64(delay), count, 1 - from, buffer[..length].to_vec())));
            }
        }
        while held.peek().is_some_and(|Reverse(f)| f.0 <= Instant::now()) {
            if let Some(Reverse((_, _, to, frame))) = held.pop()
                && !how.cut
                && ends[to].write(&frame).is_ok()
            {
                carried.fetch_add(1, Ordering::SeqCst);
            }
        }
    }
}
