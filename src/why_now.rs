//! `backdrive why-now`: why a loop shakes at this moment; `run --why` starts it.

use crate::failure::Failure;
use crate::{cli, output};
use backdrive_why::now::{Seen, why_now};
use std::sync::atomic::AtomicBool;

/// Prints causes and the gain that is offered, as JSON.
pub fn answer(options: &cli::WhyNow) -> Result<u8, Failure> {
    let seen: Seen = serde_json::from_str(&options.seen).map_err(|e| Failure::input(format!("--seen: {e}")))?;
    let wrong = |e| Failure::input(format!("{}: {e}", options.recording.display()));
    let found = why_now(&options.recording, &seen, &|_| {}, &AtomicBool::new(false)).map_err(wrong)?;
    output::json(&serde_json::to_value(found).map_err(Failure::input)?)?;
    Ok(0)
}
