//! `backdrive stability`: would the loop of a bag be stable at another gain, and how far away is the stability limit.

mod curve;
mod next;
mod text;

use crate::failure::{Failure, code};
use crate::offered::{Step, lines, with_recover};
use crate::{cli, interrupt, output, progress};
use backdrive_nodes::graph::Overrides;
use backdrive_pages::stability::{self as pages, Point};
use backdrive_stability::asked::{Asked, Options, curve};
use backdrive_stability::resimulate::ResimulateError;
use backdrive_stability::verdict::{Answer, AnswerError, Word, answer};
use curve::{curve_text, point_json};
use next::next;
use serde_json::{Value, json};
use std::sync::atomic::Ordering;
use text::text;

/// Answers.
pub fn stability(options: &cli::Stability) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;

    let how = resolved(options);
    let mut asked = progress::busy(&format!("reading {}", options.recording.display()), || Asked::read(&how))?;
    if asked.is_cut {
        asked.session.notes.push(with_recover("the bag was not closed: its remaining content is used", &options.recording));
    }
    let question = asked.question(&how)?;
    if let Some(html) = &options.html {
        // A report that cannot be written is reported before the work, not after it.
        output::writable(html)?;
    }
    let curve = match &options.sweep {
        Some(gains) => {
            let bar = progress::work();
            bar.set_message("sweep");
            bar.set_length(gains.0.len() as u64);
            let done = curve(&question, &gains.0, &|done| bar.set_position(done as u64), &cancel);
            bar.finish_and_clear();
            Some(done?)
        }
        None => None,
    };
    let bar = progress::work();
    let hear = |what: &str, done: usize, all: usize| {
        bar.set_message(what.to_string());
        bar.set_length(all.max(1) as u64);
        bar.set_position(done as u64);
    };
    let found = answer(&question, &hear, &cancel);
    bar.finish_and_clear();
    let steps = found.as_ref().map_or_else(|_| Vec::new(), |found| next(found, options, asked.graph.as_ref()));
    let found = match found {
        Ok(found) => Some(found),
        // What was done until then is printed.
        Err(AnswerError::Resimulate(ResimulateError::Cancelled)) => None,
        Err(e) => return Err(Failure::input(format!("{}: {e}", options.recording.display()))),
    };
    if options.json {
        let mut all = found.as_ref().map_or(json!({ "bag": question.session.name, "verdict": "interrupted" }), Answer::json);
        if let Some(curve) = &curve {
            all["sweep"] = Value::Array(curve.iter().flatten().map(point_json).collect());
        }
        all["next"] = serde_json::to_value(&steps).map_err(Failure::input)?;
        output::line(format_args!("{all}"))?;
    } else {
        if let Some(curve) = &curve {
            output::line(curve_text(curve))?;
        }
        if let Some(found) = &found {
            output::line(text(found))?;
            // The advice stands above.
            let with_commands: Vec<Step> = steps.iter().filter(|step| !step.commands.is_empty()).cloned().collect();
            lines("to do", 9, &with_commands).iter().try_for_each(output::line)?;
        }
    }
    let interrupted = || Failure { code: code::INTERRUPTED, message: "stopped; what was done until then is above".to_string() };
    let found = found.ok_or_else(interrupted)?;
    if let Some(html) = &options.html {
        let points: Vec<&Point> = curve.iter().flatten().flatten().collect();
        let page = pages::page(&found, question.session, &points, &steps);
        output::page(html, page)?;
        output::note(format_args!("wrote {}", html.display()));
    }
    if cancel.load(Ordering::SeqCst) {
        return Err(interrupted());
    }
    Ok(match found.verdict {
        Word::Stable => 0,
        Word::CannotTell => code::CANNOT_TELL,
        Word::LimitCycle | Word::Unstable | Word::Limited => code::NEGATIVE,
    })
}

/// The options of the work.
fn resolved(asked: &cli::Stability) -> Options {
    Options {
        recording: asked.recording.clone(),
        roles: asked.roles.clone(),
        changes: Overrides { coupling: asked.coupling.clone(), ..asked.parts.overrides() },
        gain: asked.gain,
        mu: asked.mu,
        lambda: asked.lambda,
        script: asked.script.clone(),
        grips: asked.grips.clone(),
    }
}
