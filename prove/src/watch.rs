//! Who watches a proof: receives each step and its result, and may stop it.

use crate::case::Case;
use crate::error::ProveError;
use std::any::Any;
use std::sync::atomic::AtomicBool;

/// Who watches a proof.
pub trait Watch {
    /// Becomes true when the proof shall stop.
    fn stop(&self) -> &AtomicBool;

    /// Something begins that may take long, and lasts until what is returned is dropped.
    fn begins(&self, doing: &str) -> Box<dyn Any>;

    /// A truth was drawn and sealed; the sentence holds its digest.
    ///
    /// # Errors
    /// It cannot be reported.
    fn sealed(&self, sentence: &str) -> Result<(), ProveError>;

    /// A case has ended, by itself or with an error; `cases` are all that are done.
    ///
    /// # Errors
    /// It cannot be reported or kept.
    fn ended(&self, last: Result<&Case, &ProveError>, cases: &[Case]) -> Result<(), ProveError>;
}

/// Does what may take long while the watcher knows of it.
pub(crate) fn busy<T>(watch: &dyn Watch, doing: &str, work: impl FnOnce() -> T) -> T {
    let _until_then = watch.begins(doing);
    work()
}
