//! `backdrive why`: what a recorded loop does, why, and what would stop it.

mod next;
mod text;

use crate::failure::{Failure, code};
use crate::offered::Step;
use crate::{cli, interrupt, output, progress};
use backdrive_bags::Reader;
use backdrive_nodes::graph::Overrides;
use backdrive_pages::why::page;
use backdrive_runs::source::runs_from_its_bag;
use backdrive_stability::summary::graph_of;
use backdrive_why::answer::{Answer, WhyError};
use backdrive_why::happening::Happening;
use backdrive_why::recording::Recording;
use next::{Asked, commands, next};
use std::sync::atomic::Ordering;
use std::time::Duration;
use text::text;

/// Answers.
pub fn why(options: &cli::Why) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    let path = &options.recording;
    for file in options.html.iter().chain(&options.out) {
        output::writable(file)?;
    }
    let asked = progress::busy(&format!("reading {}", path.display()), || Recording::read(path, options.roles.as_deref()))?;
    let found = progress::about(EXPECTED, |report| {
        asked.why(report, &cancel).map_err(|e| match e {
            WhyError::Loop(_) if cancel.load(Ordering::SeqCst) => Failure { code: code::INTERRUPTED, message: "stopped".to_string() },
            other => Failure::input(format!("{}: {other}", path.display())),
        })
    })?;
    let (session, graph) = (&asked.session, asked.graph());
    let written = match (&options.out, &found.master) {
        (Some(out), Some(model)) => {
            output::file(out, model)?;
            output::note(format_args!("wrote {}", out.display()));
            Some(out.as_path())
        }
        (Some(out), None) => {
            output::note(format_args!("{}: not written, because the master behaves as the graph states", out.display()));
            None
        }
        (None, _) => None,
    };
    let takes = |changes: &Overrides| Reader::open(path).is_ok_and(|reader| graph_of(&reader, changes).is_ok());
    let offer = Asked {
        recording: path,
        roles: options.roles.as_deref(),
        master: written,
        takes: &takes,
        runs: graph.is_some_and(runs_from_its_bag),
    };
    let steps = next(&found, &offer);
    if options.json {
        let mut all = serde_json::to_value(&found).map_err(Failure::input)?;
        all["next"] = serde_json::to_value(&steps).map_err(Failure::input)?;
        output::json(&all)?;
    } else {
        output::line(text(&found, &steps))?;
    }
    if let Some(html) = &options.html {
        let tries: Vec<Step> = found.remedies.iter().map(|remedy| Step::new("", commands(&found, &offer, remedy))).collect();
        output::page(html, page(&found, session, &tries, &steps))?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(exit_code(&found))
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
