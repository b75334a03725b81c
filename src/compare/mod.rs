//! `backdrive compare`: the same session through each law between master and slave, and through the canceller.

mod loaded;
mod text;

use crate::failure::{Failure, code};
use crate::{cli, interrupt, output, progress};
use backdrive_pages::compare::compared::Compared;
use backdrive_pages::compare::page;
use backdrive_stability::compare::Cell;
use loaded::Loaded;
use serde_json::json;
use std::sync::atomic::Ordering;

/// Compares.
pub fn compare(options: &cli::Compare) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    let loaded = progress::busy(&format!("reading {}", options.session.display()), || Loaded::read(options))?;
    if let Some(html) = &options.html {
        output::writable(html)?;
    }
    let comparison = &loaded.comparison;
    let bar = progress::work();
    bar.set_message("laws and links");
    bar.set_length(comparison.cells() as u64);
    let done = comparison.run(&|done| bar.set_position(done as u64), &cancel);
    bar.finish_and_clear();
    let cells: Vec<Cell> = done.map_err(|e| Failure::input(format!("{}: {e}", options.session.display())))?.into_iter().flatten().collect();
    let gains = comparison.rivals.first().map_or([1.0, 0.0], |(_, graph)| [graph.gains.mu, graph.gains.lambda]);
    let title = comparison.rivals.first().map_or("", |(_, graph)| graph.title.as_str());
    let compared = Compared {
        session: options.session.display().to_string(),
        title,
        gains,
        highest: comparison.search.highest,
        cells,
        asked: comparison.cells(),
        notes: &loaded.notes,
    };
    if options.json {
        output::json(&json!({
            "session": compared.session,
            "mu": gains[0],
            "lambda": gains[1],
            "asked": compared.asked,
            "notes": compared.notes,
            "cells": compared.cells,
        }))?;
    } else {
        output::line(text::text(&compared))?;
    }
    if let Some(html) = &options.html {
        output::page(html, page(&compared))?;
        output::note(format_args!("wrote {}", html.display()));
    }
    if cancel.load(Ordering::SeqCst) {
        let message = format!("stopped; {} of {} were done", compared.cells.len(), compared.asked);
        return Err(Failure { code: code::INTERRUPTED, message });
    }
    Ok(0)
}
