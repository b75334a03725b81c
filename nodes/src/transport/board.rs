//! The bell board of a run: one small page range in shared memory with a bell per receiving node. It also holds per topic the set of bells that its
//! publisher rings, and the tone it rings each with.
//!
//! It holds no state that a crash could damage: a slot belongs to a name, so a node that is restarted finds its own, and the bell of a dead one is
//! rung once without effect.

use super::bell::Bell;
use super::location::SHM;
use super::{Location, TransportError, name_hash};
use nix::libc;
use nix::sys::mman::{MapFlags, ProtFlags, mmap, munmap};
use std::fs::OpenOptions;
use std::num::NonZeroUsize;
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

const NODES: usize = 64;
const TOPICS: usize = 512;

#[repr(C)]
struct Entry {
    topic: AtomicU64,
    listeners: AtomicU64,
    tones: [AtomicU8; NODES],
}

#[repr(C)]
struct Layout {
    bells: [Bell; NODES],
    owners: [AtomicU64; NODES],
    topics: [Entry; TOPICS],
}

/// The board, mapped into this process.
pub(crate) struct Board {
    layout: NonNull<Layout>,
}

impl Board {
    /// Opens the board of a run; the first to come makes it.
    pub fn open(location: &Location) -> Result<Board, TransportError> {
        let path = Path::new(SHM).join(format!("{}board", location.prefix));
        let failed = |what: &str, why: String| TransportError::Start(format!("cannot {what} {}: {why}", path.display()));
        let size = const { NonZeroUsize::new(std::mem::size_of::<Layout>()).unwrap() };
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(&path)
            .map_err(|e| failed("open", e.to_string()))?;
        // Allocated now: a full /dev/shm would otherwise kill the process at the first ring.
        // SAFETY: a plain call on an open file.
        let error = unsafe { libc::posix_fallocate(file.as_raw_fd(), 0, size.get() as libc::off_t) };
        if error != 0 {
            return Err(failed("allocate", std::io::Error::from_raw_os_error(error).to_string()));
        }
        // SAFETY: a fresh shared mapping of a file that is at least as long; all zeros is a valid Layout.
        let memory = unsafe { mmap(None, size, ProtFlags::PROT_READ | ProtFlags::PROT_WRITE, MapFlags::MAP_SHARED, &file, 0) };
        Ok(Board { layout: memory.map_err(|e| failed("map", e.to_string()))?.cast() })
    }

    fn layout(&self) -> &Layout {
        // SAFETY: mapped as long as self lives, and holds nothing but atomics.
        unsafe { self.layout.as_ref() }
    }

    /// The bell of the node with this name.
    pub fn bell_of(&self, node: &str) -> Option<usize> {
        claim(name_hash(node), self.layout().owners.iter())
    }

    /// The entry of a topic.
    pub fn topic(&self, topic: &str) -> Option<usize> {
        claim(name_hash(topic), self.layout().topics.iter().map(|e| &e.topic))
    }

    /// From now on the topic's publisher rings this bell with this tone (0 to 63). It is never removed: ringing a bell without a sleeping receiver
    /// costs one addition.
    pub fn listen(&self, topic: usize, bell: usize, tone: u8) {
        let entry = &self.layout().topics[topic];
        entry.tones[bell].store(tone, Ordering::SeqCst);
        entry.listeners.fetch_or(1 << bell, Ordering::SeqCst);
    }

    pub fn bell(&self, bell: usize) -> &Bell {
        &self.layout().bells[bell]
    }

    /// Rings everyone who waits for the topic.
    #[inline]
    pub fn ring(&self, topic: usize) {
        let entry = &self.layout().topics[topic];
        let mut listeners = entry.listeners.load(Ordering::SeqCst);
        while listeners != 0 {
            let bell = listeners.trailing_zeros() as usize;
            self.bell(bell).ring(entry.tones[bell].load(Ordering::Relaxed));
            listeners &= listeners - 1;
        }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // SAFETY: mapped by open with this size, and nothing borrows from it any more.
        let _ = unsafe { munmap(self.layout.cast(), std::mem::size_of::<Layout>()) };
    }
}

/// The first slot that belongs to the name, taken if it has none yet; `None` when all are taken.
fn claim<'a>(name: u64, mut slots: impl Iterator<Item = &'a AtomicU64>) -> Option<usize> {
    slots.position(|slot| match slot.compare_exchange(0, name, Ordering::SeqCst, Ordering::SeqCst) {
        Ok(_) => true,
        Err(owner) => owner == name,
    })
}
