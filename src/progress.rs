//! Progress on standard error: bars where that is a terminal, else a line every 5 s of what takes longer.

use crate::caller::{self, Progress};
use crate::output;
use crate::program::called;
use backdrive_runs::Watch;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::any::Any;
use std::cell::RefCell;
use std::fmt::Write;
use std::io::IsTerminal;
use std::time::Duration;

/// Time between two lines where there is no terminal.
const EVERY: Duration = Duration::from_secs(5);

/// Time between two looks at a bar for the caller of a verb.
const OFTEN: Duration = Duration::from_millis(100);

/// Reports a bar until it is finished or gone, where standard error is no terminal to draw it on. `line` gives its progress.
fn tell(bar: &ProgressBar, line: impl Fn(&ProgressBar) -> String + Send + 'static) {
    let weak = bar.downgrade();
    if let Some(caller) = caller::caller() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
        std::thread::spawn(move || {
            while let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) {
                caller.tell(Some(Progress { message: bar.message(), position: bar.position(), length: bar.length() }));
                drop(bar);
                std::thread::sleep(OFTEN);
            }
        });
        return;
    }
    if std::io::stderr().is_terminal() {
        return;
    }
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(EVERY);
            match weak.upgrade().filter(|bar| !bar.is_finished()) {
                Some(bar) => output::note(line(&bar)),
                None => return,
            }
        }
    });
}

fn counted(bar: &ProgressBar) -> String {
    let (done, all) = (bar.position(), bar.length().unwrap_or(0));
    format!("{}: {done} of {all}, after {:.0} s", bar.message(), bar.elapsed().as_secs_f64())
}

/// While it lives, something goes on that may take long and reports no steps; a line shows that it does.
pub struct Busy(ProgressBar);

impl Busy {
    /// From here on.
    pub fn begin(title: &str) -> Busy {
        let bar = ProgressBar::new_spinner();
        bar.set_message(title.to_string());
        bar.enable_steady_tick(Duration::from_millis(100));
        tell(&bar, |bar| format!("{}: {:.0} s", bar.message(), bar.elapsed().as_secs_f64()));
        Busy(bar)
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Does what may take long and reports no steps; a line shows that it goes on.
pub fn busy<T>(title: &str, work: impl FnOnce() -> T) -> T {
    let _until_then = Busy::begin(title);
    work()
}

/// Does what may take long and reports its stages, without a known length.
pub fn stages<T>(work: impl FnOnce(&(dyn Fn(&str) + Sync)) -> T) -> T {
    let busy = Busy::begin("");
    work(&|stage: &str| busy.0.set_message(stage.to_string()))
}

/// What a terminal hears of a run.
#[derive(Default)]
pub struct Terminal(RefCell<Option<ProgressBar>>);

impl Watch for Terminal {
    fn node_command(&self) -> Vec<String> {
        called().command.clone()
    }

    fn note(&self, sentence: &str) {
        match &*self.0.borrow() {
            Some(bar) => bar.suspend(|| output::note(sentence)),
            None => output::note(sentence),
        }
    }

    fn begins(&self, doing: &str) -> Box<dyn Any> {
        Box::new(Busy::begin(doing))
    }

    fn steps(&self, title: &str, done: u64, all: u64) {
        let bar = self.0.take().unwrap_or_else(|| steps(all, title));
        bar.set_position(done);
        if done < all {
            self.0.replace(Some(bar));
        } else {
            bar.finish_and_clear();
        }
    }
}

/// A bar that counts steps.
fn steps(total: u64, title: &str) -> ProgressBar {
    let bar = ProgressBar::new(total);
    if let Ok(style) = ProgressStyle::with_template("{msg:28!} {wide_bar} {pos} of {len} steps, {rate}, {eta} left") {
        let rate = |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{:.0} steps/s", state.per_sec());
        };
        bar.set_style(style.with_key("rate", rate));
    }
    bar.set_message(title.to_string());
    tell(&bar, counted);
    bar
}

/// A bar that shows what is being done, and how much of it is done.
pub fn work() -> ProgressBar {
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template("{msg:28!} {wide_bar} {pos} of {len}, {eta} left") {
        bar.set_style(style);
    }
    tell(&bar, counted);
    bar
}

/// The elapsed time, with the usual maximum. The maximum is not shown once it is exceeded.
fn within(elapsed: Duration, limit: Duration) -> String {
    let s = elapsed.as_secs_f64();
    match elapsed <= limit {
        true => format!("{s:.0} s, usually at most {:.0} s", limit.as_secs_f64()),
        false => format!("{s:.0} s, longer than usual: a slow or busy machine"),
    }
}

/// A bar over the time that something takes at most as a rule, which moves by itself while `work` runs; `work` names its stages.
pub fn about<T>(limit: std::time::Duration, work: impl FnOnce(&(dyn Fn(&str) + Sync)) -> T) -> T {
    let bar = ProgressBar::new(limit.as_millis().max(1) as u64);
    let style = ProgressStyle::with_template("{msg:32!} {wide_bar} {elapsed_of}");
    if let Ok(style) = style {
        let of = move |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{}", within(state.elapsed(), limit));
        };
        bar.set_style(style.with_key("elapsed_of", of));
    }
    tell(&bar, move |bar| format!("{}: {}", bar.message(), within(bar.elapsed(), limit)));
    let done = std::sync::atomic::AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        let ended = Ended(&done);
        scope.spawn(|| {
            while !done.load(std::sync::atomic::Ordering::Relaxed) {
                bar.set_position(bar.elapsed().as_millis() as u64);
                std::thread::park_timeout(std::time::Duration::from_millis(50));
            }
        });
        let result = work(&|stage: &str| bar.set_message(stage.to_string()));
        drop(ended);
        result
    });
    bar.finish_and_clear();
    result
}

/// Signals that work has ended, by a panic too: what waits for the bar would wait for ever.
struct Ended<'a>(&'a std::sync::atomic::AtomicBool);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        self.0.store(true, std::sync::atomic::Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_panics_ends_the_bar_too() {
        let ended = std::panic::catch_unwind(|| about(Duration::from_secs(1), |_| panic!("meant")));
        assert!(ended.is_err());
    }

    #[test]
    fn a_limit_is_never_told_beside_a_longer_time() {
        let at = |s: f64| within(Duration::from_secs_f64(s), Duration::from_secs(24));
        assert_eq!(at(3.2), "3 s, usually at most 24 s");
        assert_eq!(at(31.7), "32 s, longer than usual: a slow or busy machine");
    }
}
