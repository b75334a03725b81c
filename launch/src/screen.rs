//! Writes to standard error from a thread of its own. A terminal that is held (Ctrl-S), or a pipe without a reader, must not hold the supervisor and,
//! through full pipes, the nodes.

use crate::status::Summary;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How a run is shown while it lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Display {
    /// A live line on a terminal, else a line every few seconds.
    #[default]
    Auto,
    /// A line every few seconds.
    Plain,
    /// Nothing but warnings, errors and what nodes write.
    Quiet,
}

/// Lines that may wait for a slow terminal.
const QUEUE: usize = 1024;

/// How long the last lines may take.
const CLOSING: Duration = Duration::from_secs(1);

enum Show {
    Line(String),
    Summary(Box<Summary>),
}

pub(crate) struct Screen {
    show: Option<mpsc::SyncSender<Show>>,
    dropped: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Screen {
    /// `every`: time between two plain lines.
    pub fn new(display: Display, every: Duration) -> Screen {
        let (show, shown) = mpsc::sync_channel(QUEUE);
        let dropped = Arc::new(AtomicU64::new(0));
        let lost = Arc::clone(&dropped);
        let thread = std::thread::Builder::new().name("screen".to_string()).spawn(move || draw(&shown, &lost, display, every)).ok();
        Screen { show: Some(show), dropped, thread }
    }

    /// Shows a line above the status.
    pub fn line(&self, text: String) {
        self.show(Show::Line(text));
    }

    /// Shows how the run does.
    pub fn summary(&self, summary: Summary) {
        self.show(Show::Summary(Box::new(summary)));
    }

    fn show(&self, what: Show) {
        if let Some(show) = &self.show {
            let line = matches!(what, Show::Line(_));
            if show.try_send(what).is_err() && line {
                self.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

impl Drop for Screen {
    /// Lets it write what it has, unless it is held.
    fn drop(&mut self) {
        self.show = None;
        let until = Instant::now() + CLOSING;
        if let Some(thread) = self.thread.take() {
            while !thread.is_finished() && Instant::now() < until {
                std::thread::sleep(Duration::from_millis(2));
            }
        }
    }
}

fn draw(shown: &mpsc::Receiver<Show>, dropped: &AtomicU64, display: Display, every: Duration) {
    let dumb = std::env::var_os("TERM").is_none_or(|t| t == "dumb");
    let live = display == Display::Auto && !dumb && std::io::stderr().is_terminal();
    let mut bar: Option<(ProgressBar, bool)> = None;
    let mut last = Instant::now();
    let say = |bar: &Option<(ProgressBar, bool)>, text: &str| {
        let write = || {
            // Not eprintln: it panics when the terminal is gone.
            let _ = writeln!(std::io::stderr(), "{text}");
        };
        match bar {
            Some((bar, _)) => bar.suspend(write),
            None => write(),
        }
    };
    while let Ok(show) = shown.recv() {
        match show {
            Show::Line(text) => {
                let lost = dropped.swap(0, Ordering::Relaxed);
                if lost > 0 {
                    say(&bar, &format!("({lost} lines were not shown: the terminal was too slow)"));
                }
                say(&bar, &text);
            }
            Show::Summary(summary) if live => {
                let (bar, ended) = bar.get_or_insert_with(|| (new_bar(), false));
                let with_end = summary.planned.is_some() && summary.doing.is_empty();
                if with_end != *ended {
                    *ended = with_end;
                    bar.set_style(style(with_end));
                }
                if let Some(planned) = summary.planned {
                    bar.set_length(planned);
                    bar.set_position(summary.steps.min(planned));
                }
                let left = summary.remaining().filter(|_| with_end).map(|d| format!("{} left, ", crate::status::clock(d)));
                let at = if with_end || !summary.doing.is_empty() {
                    String::new()
                } else {
                    format!("{}, ", crate::status::clock(summary.elapsed))
                };
                bar.set_message(format!("{}{at}{}", left.unwrap_or_default(), summary.line()));
                bar.tick();
            }
            Show::Summary(summary) if display != Display::Quiet => {
                if last.elapsed() >= every {
                    say(&bar, &summary.plain());
                    last = Instant::now();
                }
            }
            Show::Summary(_) => {}
        }
    }
    if let Some((bar, _)) = bar {
        bar.finish_and_clear();
    }
}

fn new_bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr_with_hz(10));
    bar.set_style(style(false));
    bar
}

fn style(with_end: bool) -> ProgressStyle {
    let template = if with_end { "[{bar:20}] {percent:>3} % {wide_msg}" } else { "{spinner} {wide_msg}" };
    ProgressStyle::with_template(template).map_or_else(|_| ProgressStyle::default_bar(), |s| s.progress_chars("=> "))
}
