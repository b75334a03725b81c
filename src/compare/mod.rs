//! `backdrive compare`: the same session through each law between master and slave, and through the canceller.

mod text;

use crate::failure::{Failure, code};
use crate::{cli, interrupt, output, progress};
use backdrive_nodes::graph::Overrides;
use backdrive_pages::compare::compared::Compared;
use backdrive_pages::compare::page;
use backdrive_stability::compare::asked::{Asked, Options};
use backdrive_stability::compare::{Cell, Condition, Varied};
use serde_json::json;
use std::sync::atomic::Ordering;

/// Compares.
pub fn compare(options: &cli::Compare) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    let loaded = progress::busy(&format!("reading {}", options.session.display()), || Asked::read(&resolved(options)))?;
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

/// The options of the work.
fn resolved(options: &cli::Compare) -> Options {
    Options {
        session: options.session.clone(),
        laws: options.laws.clone(),
        changes: Overrides { lambda: options.lambda, ..options.parts.overrides() },
        conditions: conditions(options),
    }
}

fn conditions(options: &cli::Compare) -> Vec<Condition> {
    let ms = |ms: f64| 1e-3 * ms;
    let at = Condition::delay(ms(options.at));
    let delays = options.delays.iter().map(|d| Condition::delay(ms(*d)));
    let jitter = options.jitter.iter().filter_map(|j| j.0);
    let jitter = jitter.map(|[mean, most]| Condition { varied: Varied::Jitter, jitter_s: ms(most), ..Condition::delay(ms(mean)) });
    let loss = options.loss.iter().filter_map(|l| l.0).map(|loss| Condition { varied: Varied::Loss, loss, ..at.clone() });
    let grips = options.grips.iter().filter(|g| **g != 1.0).map(|g| Condition { varied: Varied::Grip, grip_scale: *g, ..at.clone() });
    delays.chain(jitter).chain(loss).chain(grips).collect()
}
