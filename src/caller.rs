//! Who calls a verb instead of the command line: the output of the verb is kept for them, and they can read its progress and end it.

use std::cell::RefCell;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

thread_local! {
    static CALLER: RefCell<Option<Arc<Caller>>> = const { RefCell::new(None) };
}

/// Who calls a verb: its output is gathered here.
#[derive(Debug, Default)]
pub struct Caller {
    /// Set it to end the work early: a search ends with what it has, as after the first Ctrl-C on the command line.
    pub stop: Arc<AtomicBool>,
    arguments: Mutex<Vec<String>>,
    result: Mutex<String>,
    notes: Mutex<Vec<String>>,
    progress: Mutex<Option<Progress>>,
}

/// How far long work is.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub message: String,
    /// How far, in steps, or in ms where a time is expected.
    pub position: u64,
    /// Of how many; `None` where nobody can tell.
    pub length: Option<u64>,
}

impl Caller {
    /// How far the work is; `None` before it has begun and after its end.
    pub fn progress(&self) -> Option<Progress> {
        locked(&self.progress).clone()
    }

    /// The arguments of the verb that it calls.
    pub(crate) fn arguments(&self) -> Vec<String> {
        locked(&self.arguments).clone()
    }

    /// Keeps the arguments of the verb that it calls.
    pub(crate) fn calls(&self, arguments: Vec<String>) {
        *locked(&self.arguments) = arguments;
    }

    /// Publishes the progress of the work.
    pub(crate) fn tell(&self, progress: Option<Progress>) {
        *locked(&self.progress) = progress;
    }
}

// What a thread that panicked has left in there is text, and as good as before.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The caller of what this thread does; `None` on the command line.
pub(crate) fn caller() -> Option<Arc<Caller>> {
    CALLER.with_borrow(Clone::clone)
}

/// Keeps a piece of a result for the caller, if there is one.
pub(crate) fn kept(text: &str) -> bool {
    caller().inspect(|c| locked(&c.result).push_str(text)).is_some()
}

/// Keeps a note for the caller, if there is one.
pub(crate) fn noted(line: &str) -> bool {
    caller().inspect(|c| locked(&c.notes).push(line.trim_end().to_string())).is_some()
}

/// What was kept: the result, and the notes.
pub(crate) fn taken(caller: &Caller) -> (String, Vec<String>) {
    (std::mem::take(&mut *locked(&caller.result)), std::mem::take(&mut *locked(&caller.notes)))
}

/// While it lives, what this thread does is done for a caller.
pub(crate) struct Calling;

impl Calling {
    /// From here on.
    pub(crate) fn begin(caller: &Arc<Caller>) -> Calling {
        CALLER.set(Some(caller.clone()));
        Calling
    }
}

impl Drop for Calling {
    fn drop(&mut self) {
        CALLER.set(None);
    }
}
