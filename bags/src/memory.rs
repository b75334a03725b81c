//! How much memory the numbers of a file may take. Some MB of a compressed file can hold billions of equal numbers.

use std::cell::Cell;

/// Bytes that the numbers of one recording may take unless another limit is asked for: 134 million numbers.
/// The peak of an import is at most three times as much, because a format's own buffers come on top.
pub const MOST_BYTES: u64 = 1 << 30;

/// Counts what a file unpacks to against a limit.
#[derive(Debug)]
pub(crate) struct Memory {
    limit: u64,
    used: Cell<u64>,
}

impl Memory {
    pub(crate) fn new(limit: u64) -> Memory {
        Memory { limit, used: Cell::new(0) }
    }

    /// Bytes that may still be taken.
    pub(crate) fn left(&self) -> u64 {
        self.limit.saturating_sub(self.used.get())
    }

    /// Takes `bytes` of the remaining memory.
    ///
    /// # Errors
    /// A sentence with the size and the limit.
    pub(crate) fn take(&self, bytes: u64) -> Result<(), String> {
        if bytes > self.left() {
            return Err(self.refuse(bytes));
        }
        self.used.set(self.used.get() + bytes);
        Ok(())
    }

    /// The sentence that refuses `bytes` more.
    pub(crate) fn refuse(&self, bytes: u64) -> String {
        too_much(self.used.get().saturating_add(bytes), self.limit)
    }

    /// Whether `count` numbers of eight bytes would go in.
    ///
    /// # Errors
    /// As [`Memory::take`].
    pub(crate) fn check_numbers(&self, count: u64) -> Result<(), String> {
        let bytes = count.saturating_mul(8);
        if bytes > self.left() { Err(self.refuse(bytes)) } else { Ok(()) }
    }

    /// Takes `count` numbers of eight bytes.
    ///
    /// # Errors
    /// As [`Memory::take`].
    pub(crate) fn take_numbers(&self, count: u64) -> Result<(), String> {
        self.take(count.saturating_mul(8))
    }
}

/// The sentence that refuses what is larger than the limit.
fn too_much(bytes: u64, limit: u64) -> String {
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    format!(
        "unpacks to {} MiB or more, and {} MiB are allowed; split the recording, or allow more with --memory (MiB)",
        mib(bytes),
        mib(limit)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_beyond_the_limit_is_refused_with_both_sizes() {
        let memory = Memory::new(16 << 20);
        assert_eq!(memory.take_numbers(2 << 20), Ok(()));
        assert_eq!(memory.left(), 0);
        let refused = memory.take(1).unwrap_err();
        assert!(refused.contains("17 MiB") && refused.contains("16 MiB"), "{refused}");
        assert!(memory.take_numbers(u64::MAX).is_err());
    }
}
