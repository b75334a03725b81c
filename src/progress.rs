//! Progress bars: on standard error, and only where that is a terminal.

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;

/// A bar that counts steps.
pub fn steps(total: u64, title: &str) -> ProgressBar {
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template("{msg:28!} {wide_bar} {pos} of {len} steps, {rate}, {eta} left") {
        let rate = |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{:.0} steps/s", state.per_sec());
        };
        bar.set_style(style.with_key("rate", rate));
    }
    bar.set_message(title.to_string());
    bar
}

/// A bar that says what is being done, and how much of it is done.
pub fn work() -> ProgressBar {
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template("{msg:28!} {wide_bar} {pos} of {len}, {eta} left") {
        bar.set_style(style);
    }
    bar
}
