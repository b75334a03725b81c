//! The recordings of a shard answered one after the other, on some threads, and all answers together as a table.

use super::kept::Store;
use super::key::{Keys, Version, short};
use crate::answer::answer;
use crate::answered::Answered;
use crate::error::FleetError;
use crate::manifest::{Entry, Manifest};
use crate::table::Table;
use crate::what::What;
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// What is asked of which part of a manifest.
pub struct Work<'a> {
    /// The recordings.
    pub manifest: &'a Manifest,
    /// What is asked of each.
    pub what: What,
    /// Which shard, from 1, of how many.
    pub shard: (usize, usize),
    /// Threads; 0 for as many as the machine has.
    pub jobs: usize,
    /// Version of the program.
    pub version: Version,
}

/// How far the work is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Recordings that are done, those that were kept from before among them.
    pub done: usize,
    /// Of them those that were answered before.
    pub kept: usize,
    /// All of the shard.
    pub all: usize,
}

/// What was done.
#[derive(Debug)]
pub struct Done {
    /// How far it came.
    pub progress: Progress,
    /// Recordings without an answer, each with the reason.
    pub failed: Vec<(String, String)>,
    /// The table of all recordings; `None` while other shards are not done.
    pub table: Option<Table>,
    /// Recordings of the manifest that are not answered yet.
    pub missing: usize,
}

/// Answers for each recording of a shard. Once `stop` is set it ends after the recordings that are being answered.
///
/// # Errors
/// A model is wrong, a file cannot be written, or it was stopped.
pub fn run(work: &Work, store: &Store, hear: &(dyn Fn(Progress) + Sync), stop: &AtomicBool) -> Result<Done, FleetError> {
    let keys = Keys::of(work.manifest, work.what, &work.version)?;
    let entries = work.manifest.shard(work.shard);
    let (done, kept) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let failed = Mutex::new(Vec::new());
    let now = || Progress { done: done.load(Ordering::SeqCst), kept: kept.load(Ordering::SeqCst), all: entries.len() };
    hear(now());
    let one = |entry: &&Entry| -> Result<(), FleetError> {
        if stop.load(Ordering::SeqCst) {
            return Err(FleetError::Stopped);
        }
        let (answered, was_kept) = answered(work, store, &keys, entry)?;
        if let (Some(why), Ok(mut failed)) = (answered.error, failed.lock()) {
            failed.push((entry.name.clone(), why));
        }
        kept.fetch_add(usize::from(was_kept), Ordering::SeqCst);
        done.fetch_add(1, Ordering::SeqCst);
        hear(now());
        Ok(())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(work.jobs).build().map_err(|e| FleetError::Machine(e.to_string()))?;
    pool.install(|| entries.par_iter().try_for_each(one))?;
    let mut failed = failed.into_inner().unwrap_or_default();
    failed.sort();
    let (table, missing) = merged(work.manifest, work.what, &keys, store);
    Ok(Done { progress: now(), failed, table, missing })
}

/// The answer to a recording, and whether it was kept from before.
fn answered(work: &Work, store: &Store, keys: &Keys, entry: &Entry) -> Result<(Answered, bool), FleetError> {
    let question = keys.question(entry);
    let unread = |why: String| {
        // Nothing is kept of a recording that cannot be read: it may be there the next time.
        let key = short(&[question.as_bytes(), entry.name.as_bytes(), b"unread"]);
        let answered = Answered::failed(why);
        store.keep(&key, &answered)?;
        store.point(entry, &question, &key)?;
        Ok((answered, false))
    };
    let loaded = match entry.load() {
        Ok(loaded) => loaded,
        Err(FleetError::Input(why)) => return unread(why),
        Err(other) => return Err(other),
    };
    let key = match keys.key(entry, &loaded) {
        Ok(key) => key,
        Err(FleetError::Input(why)) => return unread(why),
        Err(other) => return Err(other),
    };
    if let Some(answered) = store.answer(&key) {
        store.point(entry, &question, &key)?;
        return Ok((answered, true));
    }
    let answered = answer(work.manifest, entry, &loaded, work.what)?;
    store.keep(&key, &answered)?;
    store.point(entry, &question, &key)?;
    Ok((answered, false))
}

impl Store {
    /// The table of all recordings of a manifest as far as they are answered, and how many are not; `None` while some are not.
    ///
    /// # Errors
    /// A model cannot be read.
    pub fn table(&self, work: &Work) -> Result<(Option<Table>, usize), FleetError> {
        Ok(merged(work.manifest, work.what, &Keys::of(work.manifest, work.what, &work.version)?, self))
    }
}

/// The table of all recordings, and how many are not answered.
fn merged(manifest: &Manifest, what: What, keys: &Keys, store: &Store) -> (Option<Table>, usize) {
    // While most shards are at work a look into the folder is enough.
    let answered = store.count();
    if answered < manifest.entries.len() {
        return (None, manifest.entries.len() - answered);
    }
    let mut table = Table::new(what);
    let mut missing = 0;
    for entry in &manifest.entries {
        let key = store.key_of(entry, &keys.question(entry));
        match key.and_then(|key| Some((store.answer(&key)?, key))) {
            Some((answered, key)) => table.add(entry, &key, &answered),
            None => missing += 1,
        }
    }
    ((missing == 0).then_some(table), missing)
}
