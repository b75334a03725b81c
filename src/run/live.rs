//! A window on the run while it lasts, for `run --live`.

use crate::cli;
use crate::output;
use crate::program::called;
use crate::progress::Terminal;
use backdrive_launch::RunPaths;
use backdrive_live::heal::WhyOptions;
use backdrive_live::run::{Live, Options};
use backdrive_runs::Watch;
use std::any::Any;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// Share of the graph's lambda below which nothing is healed unless asked.
const TENTH: f64 = 0.1;

/// What starts this program.
fn program() -> Vec<String> {
    match called().command.clone() {
        command if !command.is_empty() => command,
        _ => std::env::current_exe().map(|exe| vec![exe.to_string_lossy().into_owned()]).unwrap_or_default(),
    }
}

/// A terminal beside which a page is served, from when the run has a place.
pub struct Windowed {
    terminal: Terminal,
    created: Option<Sender<RunPaths>>,
    live: Arc<Mutex<Option<Live>>>,
}

impl Windowed {
    /// Without its options only the terminal. `lambda` is the graph's force scale.
    pub fn of(options: &cli::Run, lambda: f64) -> Windowed {
        let (terminal, live) = (Terminal::default(), Arc::new(Mutex::new(None)));
        if options.live.is_none() && !options.why && options.heal.is_none() {
            return Windowed { terminal, created: None, live };
        }
        let watched = options.why || options.heal.is_some();
        let why = watched.then(|| WhyOptions { program: program(), heal: options.heal.map(|least| least.unwrap_or(TENTH * lambda)) });
        let wanted = Options { address: options.live, most_lambda: options.most_lambda, why };
        let (created, creates) = channel::<RunPaths>();
        let opened = Arc::clone(&live);
        std::thread::spawn(move || {
            let Ok(paths) = creates.recv() else { return };
            match Live::open(&paths, &wanted, Arc::new(|said: &str| output::note(said))) {
                Ok(window) => {
                    if let Some([control, watch]) = window.urls() {
                        output::note(format_args!("page     {control}"));
                        output::note(format_args!("to watch {watch}"));
                    }
                    opened.lock().unwrap_or_else(PoisonError::into_inner).replace(window);
                }
                Err(e) => output::note(format_args!("warning: there is no page: {e}")),
            }
        });
        Windowed { terminal, created: Some(created), live }
    }

    /// Shows how the run has ended, and closes the page.
    pub fn end(&self, how: &str) {
        if let Some(live) = self.live.lock().unwrap_or_else(PoisonError::into_inner).take() {
            live.end(how);
        }
    }
}

impl Watch for Windowed {
    fn note(&self, sentence: &str) {
        self.terminal.note(sentence);
    }

    fn begins(&self, doing: &str) -> Box<dyn Any> {
        self.terminal.begins(doing)
    }

    fn node_command(&self) -> Vec<String> {
        called().command.clone()
    }

    fn created(&self) -> Option<Sender<RunPaths>> {
        self.created.clone()
    }

    fn steps(&self, title: &str, done: u64, all: u64) {
        self.terminal.steps(title, done, all);
    }
}
