//! Ctrl-C in long work: the first ends it with what is done, a second one at once.

use crate::caller;
use crate::failure::{Failure, code};
use crate::output;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Becomes true with the first Ctrl-C, or when the caller of a verb requests it. To be asked for once in a process of ours.
pub fn heard() -> Result<Arc<AtomicBool>, Failure> {
    if let Some(caller) = caller::caller() {
        return Ok(caller.stop.clone());
    }
    let stop = Arc::new(AtomicBool::new(false));
    let heard = stop.clone();
    let handler = move || {
        if heard.swap(true, Ordering::SeqCst) {
            output::fail(&Failure { code: code::INTERRUPTED, message: "interrupted".to_string() });
            std::process::exit(i32::from(code::INTERRUPTED))
        }
    };
    ctrlc::set_handler(handler).map_err(Failure::machine)?;
    Ok(stop)
}
