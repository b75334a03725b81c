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

/// A bar over the time that something may take at most, which moves by itself while `work` runs; `work` names its stages.
pub fn at_most<T>(limit: std::time::Duration, work: impl FnOnce(&(dyn Fn(&str) + Sync)) -> T) -> T {
    let bar = ProgressBar::new(limit.as_millis().max(1) as u64);
    let style = ProgressStyle::with_template("{msg:32!} {wide_bar} {elapsed_of}");
    if let Ok(style) = style {
        let of = move |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{:.1} s, at most {:.0} s", state.elapsed().as_secs_f64(), limit.as_secs_f64());
        };
        bar.set_style(style.with_key("elapsed_of", of));
    }
    let done = std::sync::atomic::AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(std::sync::atomic::Ordering::Relaxed) {
                bar.set_position(bar.elapsed().as_millis() as u64);
                std::thread::park_timeout(std::time::Duration::from_millis(50));
            }
        });
        let result = work(&|stage: &str| bar.set_message(stage.to_string()));
        done.store(true, std::sync::atomic::Ordering::Relaxed);
        result
    });
    bar.finish_and_clear();
    result
}
