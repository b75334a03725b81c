//! `backdrive why`: what a recorded loop does, why, and what would stop it.

mod page;
mod text;

use crate::failure::{Failure, code};
use crate::summary::graph_of;
use crate::{cli, interrupt, output, progress};
use backdrive_bags::Reader;
use backdrive_nodes::graph::Overrides;
use backdrive_stability::resimulate::Gain;
use backdrive_stability::resimulate::recover::{recorded_intents, recover_intent};
use backdrive_stability::session::Session;
use backdrive_why::answer::{Answer, PATIENCE, Question, WhyError, why as answer};
use backdrive_why::happening::Happening;
use backdrive_why::recorded::Recorded;
use std::sync::atomic::Ordering;
use text::text;

/// Answers.
pub fn why(options: &cli::Why) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    let path = &options.recording;
    for file in options.html.iter().chain(&options.out) {
        output::writable(file)?;
    }
    let reader = Reader::open(path).map_err(Failure::input)?;
    let graph = graph_of(&reader, &Overrides::default())?;
    let read = || -> Result<(Session, Recorded), Failure> {
        let session = Session::from_bag(&reader, &graph).map_err(Failure::input)?;
        Ok((session, Recorded::read(&reader).map_err(Failure::input)?))
    };
    let (mut session, recorded) = progress::busy(&format!("reading {}", path.display()), read)?;
    let mut intents = recorded_intents(&session);
    if intents.is_none() {
        match recover_intent(&session, &graph) {
            Ok(found) => {
                session.notes.push("the hand was not recorded: it was recovered from x_m and F_f by the master's model".to_string());
                intents = Some(found.intents);
            }
            Err(e) => session.notes.push(format!("the hand was not recorded and could not be recovered: {e}")),
        }
    }
    let gain = own_gain(&session, &graph);
    let question = Question { session: &session, graph: &graph, recorded: &recorded, intents, gain, patience: PATIENCE };
    let found = progress::about(std::time::Duration::from_secs(20), |report| {
        answer(&question, report, &cancel).map_err(|e| match e {
            WhyError::Loop(_) if cancel.load(Ordering::SeqCst) => Failure { code: code::INTERRUPTED, message: "stopped".to_string() },
            other => Failure::input(format!("{}: {other}", path.display())),
        })
    })?;
    if options.json {
        output::json(&found)?;
    } else {
        output::line(text(&found))?;
    }
    match (&options.out, &found.master) {
        (Some(out), Some(model)) => {
            output::file(out, model)?;
            output::note(format_args!("wrote {}", out.display()));
        }
        (Some(out), None) => output::note(format_args!("{}: not written, for the master does what the graph says", out.display())),
        (None, _) => {}
    }
    if let Some(html) = &options.html {
        output::file(html, page::page(&found, &session, options.out.as_deref()).html())?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(exit_code(&found))
}

/// The gain of most of a recording.
fn own_gain(session: &Session, graph: &backdrive_nodes::graph::Graph) -> Gain {
    let median = |column: &[f64]| {
        let mut values: Vec<f64> = column.iter().copied().filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Gain { mu: median(&session.mu).unwrap_or(graph.gains.mu), lambda: median(&session.lambda).unwrap_or(graph.gains.lambda) }
}

fn exit_code(found: &Answer) -> u8 {
    match found.happening {
        Happening::Nothing => 0,
        Happening::NotJudged { .. } => code::CANNOT_TELL,
        _ => code::NEGATIVE,
    }
}
