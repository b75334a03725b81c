//! `backdrive compare`: the same session through each law between master and slave, and through the canceller.

pub mod links;
mod text;

use crate::failure::{Failure, code};
use crate::offered::{Builder, Step, lines, plain};
use crate::{cli, interrupt, output, progress};
use backdrive_nodes::graph::Overrides;
use backdrive_pages::compare::choice::{choice, laws, sentence};
use backdrive_pages::compare::compared::Compared;
use backdrive_pages::compare::page;
use backdrive_stability::compare::Cell;
use backdrive_stability::compare::asked::{Asked, Options};
use links::Links;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Compares.
pub fn compare(options: &cli::Compare) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    if let Some(html) = &options.html {
        output::writable(html)?;
    }
    let done = Done::of(&resolved(options), &cancel)?;
    let compared = done.compared();
    let steps = next(&compared, &options.session);
    if options.json {
        output::json(&done.json())?;
    } else {
        output::line(text::text(&compared))?;
        output::line(format!("\nanswer    {}", sentence(&compared)))?;
        lines("next", 10, &steps).into_iter().try_for_each(output::line)?;
    }
    if let Some(html) = &options.html {
        output::page(html, page(&compared, &steps))?;
        output::note(format_args!("wrote {}", html.display()));
    }
    if cancel.load(Ordering::SeqCst) {
        let message = format!("stopped; {} of {} were done", compared.cells.len(), compared.asked);
        return Err(Failure { code: code::INTERRUPTED, message });
    }
    Ok(0)
}

/// A comparison that was run, as far as it came.
pub struct Done {
    session: String,
    asked: Asked,
    cells: Vec<Cell>,
}

impl Done {
    /// Compares.
    ///
    /// # Errors
    /// The session or a change is wrong, or a loop cannot be run.
    pub fn of(options: &Options, cancel: &AtomicBool) -> Result<Done, Failure> {
        let session = options.session.display().to_string();
        let asked = progress::busy(&format!("reading {session}"), || Asked::read(options))?;
        let comparison = &asked.comparison;
        let bar = progress::work();
        bar.set_message("laws and links");
        bar.set_length(comparison.cells() as u64);
        let done = comparison.run(&|done| bar.set_position(done as u64), cancel);
        bar.finish_and_clear();
        let cells = done.map_err(|e| Failure::input(format!("{session}: {e}")))?.into_iter().flatten().collect();
        Ok(Done { session, asked, cells })
    }

    /// For text and page.
    fn compared(&self) -> Compared<'_> {
        let comparison = &self.asked.comparison;
        let graph = comparison.rivals.first().map(|(_, graph)| graph);
        Compared {
            session: self.session.clone(),
            title: graph.map_or("", |graph| graph.title.as_str()),
            gains: graph.map_or([1.0, 0.0], |graph| [graph.gains.mu, graph.gains.lambda]),
            highest: comparison.search.highest,
            cells: &self.cells,
            asked: comparison.cells(),
            notes: &self.asked.notes,
        }
    }

    /// The result for programs.
    pub fn json(&self) -> Value {
        let Compared { session, gains: [mu, lambda], cells, asked, notes, .. } = self.compared();
        json!({ "session": session, "mu": mu, "lambda": lambda, "asked": asked, "notes": notes, "cells": cells })
    }

    /// The text of the page.
    pub fn html(&self) -> String {
        output::html(page(&self.compared(), &[]))
    }
}

/// A run of the session with the law to take.
fn next(compared: &Compared, session: &Path) -> Vec<Step> {
    let laws = laws(compared);
    let Some(law) = choice(&laws) else { return Vec::new() };
    let run = Builder::verb("run").reads(session).option("--coupling", law.name).option("--lambda", plain(compared.gains[1]));
    let run = run.option_writes("--html", Path::new("run.html"));
    vec![Step::new(format!("Run the session with {}, and look at its motion.", law.name), [run.build()])]
}

/// The options of the work.
fn resolved(options: &cli::Compare) -> Options {
    let links = Links {
        delays_ms: options.delays.clone(),
        jitter_ms: options.jitter.iter().filter_map(|j| j.0).collect(),
        loss: options.loss.iter().filter_map(|l| l.0).collect(),
        grips: options.grips.clone(),
        at_ms: options.at,
    };
    Options {
        session: options.session.clone(),
        laws: options.laws.clone(),
        changes: Overrides { lambda: options.lambda, ..options.parts.overrides() },
        conditions: links.conditions(),
    }
}
