//! `backdrive why`: what a recorded loop does, why, and what would stop it.

mod next;
mod text;

use crate::failure::{Failure, code};
use crate::offered::Step;
use crate::{cli, interrupt, output, progress};
use backdrive_bags::Reader;
use backdrive_nodes::graph::Overrides;
use backdrive_pages::why::page;
use backdrive_report::Page;
use backdrive_runs::source::runs_from_its_bag;
use backdrive_stability::summary::graph_of;
use backdrive_why::answer::{Answer, WhyError};
use backdrive_why::happening::Happening;
use backdrive_why::recording::Recording;
use next::{Asked, commands, next};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use text::text;

/// Answers.
pub fn why(options: &cli::Why) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    for file in options.html.iter().chain(&options.out) {
        output::writable(file)?;
    }
    let found = Explained::of(&options.recording, options.roles.as_deref(), options.out.as_deref(), &cancel)?;
    if options.json {
        output::json(&found.json()?)?;
    } else {
        output::line(text(&found.answer, &found.steps))?;
    }
    if let Some(html) = &options.html {
        output::page(html, found.page())?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(found.code())
}

/// An answer with what it is about, and what to do.
pub struct Explained {
    recording: Recording,
    answer: Answer,
    tries: Vec<Step>,
    steps: Vec<Step>,
}

impl Explained {
    /// Asks a recording, a bag of a run or with `roles` any other. A master that differs from the graph is written to `out`, where that is given.
    ///
    /// # Errors
    /// The recording cannot be read or judged, the work is interrupted, or `out` cannot be written.
    pub fn of(path: &Path, roles: Option<&Path>, out: Option<&Path>, cancel: &Arc<AtomicBool>) -> Result<Explained, Failure> {
        let recording = progress::busy(&format!("reading {}", path.display()), || Recording::read(path, roles))?;
        let answer = progress::about(EXPECTED, |report| {
            recording.why(report, cancel).map_err(|e| match e {
                WhyError::Loop(_) if cancel.load(Ordering::SeqCst) => Failure { code: code::INTERRUPTED, message: "stopped".to_string() },
                other => Failure::input(format!("{}: {other}", path.display())),
            })
        })?;
        let master = match (out, answer.master.as_ref().or(answer.slave.as_ref())) {
            (Some(out), Some(model)) => {
                output::file(out, model)?;
                output::note(format_args!("wrote {}", out.display()));
                Some(out)
            }
            (Some(out), None) => {
                output::note(format_args!("{}: not written, because no device differs from its model in the graph", out.display()));
                None
            }
            (None, _) => None,
        };
        let takes = |changes: &Overrides| Reader::open(path).is_ok_and(|reader| graph_of(&reader, changes).is_ok());
        let offer = Asked { recording: path, roles, master, takes: &takes, runs: recording.graph().is_some_and(runs_from_its_bag) };
        let steps = next(&answer, &offer);
        let tries = answer.remedies.iter().map(|remedy| Step::new("", commands(&answer, &offer, remedy))).collect();
        Ok(Explained { recording, answer, tries, steps })
    }

    /// The result for programs.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub fn json(&self) -> Result<Value, Failure> {
        let mut all = serde_json::to_value(&self.answer).map_err(Failure::input)?;
        all["next"] = serde_json::to_value(&self.steps).map_err(Failure::input)?;
        Ok(all)
    }

    /// The page.
    fn page(&self) -> Page {
        page(&self.answer, &self.recording.session, &self.tries, &self.steps)
    }

    /// The text of the page.
    pub fn html(&self) -> String {
        output::html(self.page())
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        exit_code(&self.answer)
    }
}

/// About how long an answer takes that needs a diagnosis.
const EXPECTED: Duration = Duration::from_secs(20);

fn exit_code(found: &Answer) -> u8 {
    match found.happening {
        Happening::Nothing => 0,
        Happening::NotJudged { .. } => code::CANNOT_TELL,
        _ => code::NEGATIVE,
    }
}
