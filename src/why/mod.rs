//! `backdrive why`: what a recorded loop does, why, and what would stop it.

mod next;
mod text;

use crate::failure::{Failure, code};
use crate::offered::Step;
use crate::{cli, interrupt, output, progress};
use backdrive_bags::Reader;
use backdrive_nodes::graph::{Graph, Overrides};
use backdrive_pages::why::page;
use backdrive_runs::source::runs_from_its_bag;
use backdrive_stability::by_itself::recorded::Recorded;
use backdrive_stability::resimulate::Gain;
use backdrive_stability::resimulate::recover::{recorded_intents, recover_intent};
use backdrive_stability::roles::Roles;
use backdrive_stability::session::Session;
use backdrive_stability::summary::graph_of;
use backdrive_why::answer::{Answer, PATIENCE, Question, WhyError, why as answer};
use backdrive_why::foreign::why_of_signals;
use backdrive_why::happening::Happening;
use next::{Asked, commands, next};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use text::text;

/// Answers.
pub fn why(options: &cli::Why) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    let path = &options.recording;
    for file in options.html.iter().chain(&options.out) {
        output::writable(file)?;
    }
    let (found, session, graph) = match &options.roles {
        Some(roles) => {
            let roles = Roles::load(roles)?;
            let session =
                progress::busy(&format!("reading {}", path.display()), || Session::from_roles(path, &roles)).map_err(Failure::input)?;
            let gain = own_gain(&session, None);
            (why_of_signals(&session, gain), session, None)
        }
        None => of_our_bag(path, &cancel)?,
    };
    let written = match (&options.out, &found.master) {
        (Some(out), Some(model)) => {
            output::file(out, model)?;
            output::note(format_args!("wrote {}", out.display()));
            Some(out.as_path())
        }
        (Some(out), None) => {
            output::note(format_args!("{}: not written, for the master does what the graph says", out.display()));
            None
        }
        (None, _) => None,
    };
    let takes = |changes: &Overrides| Reader::open(path).is_ok_and(|reader| graph_of(&reader, changes).is_ok());
    let asked = Asked {
        recording: path,
        roles: options.roles.as_deref(),
        master: written,
        takes: &takes,
        runs: graph.as_ref().is_some_and(runs_from_its_bag),
    };
    let steps = next(&found, &asked);
    if options.json {
        let mut all = serde_json::to_value(&found).map_err(Failure::input)?;
        all["next"] = serde_json::to_value(&steps).map_err(Failure::input)?;
        output::json(&all)?;
    } else {
        output::line(text(&found, &steps))?;
    }
    if let Some(html) = &options.html {
        let tries: Vec<Step> = found.remedies.iter().map(|remedy| Step::new("", commands(&found, &asked, remedy))).collect();
        output::page(html, page(&found, &session, &tries, &steps))?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(exit_code(&found))
}

/// The answer of a bag of ours, its signals and its graph.
fn of_our_bag(path: &Path, cancel: &Arc<AtomicBool>) -> Result<(Answer, Session, Option<Graph>), Failure> {
    let hint = |f: Failure| Failure { message: format!("{}; a recording that we did not make needs --roles FILE", f.message), ..f };
    let reader = Reader::open(path).map_err(Failure::input)?;
    let is_cut = reader.without_messages().is_some();
    let graph = graph_of(&reader, &Overrides::default()).map_err(|e| if is_cut { e.into() } else { hint(e.into()) })?;
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
    let gain = own_gain(&session, Some(&graph));
    let question = Question { session: &session, graph: &graph, recorded: &recorded, intents, gain, patience: PATIENCE };
    let found = progress::about(EXPECTED, |report| {
        answer(&question, report, cancel).map_err(|e| match e {
            WhyError::Loop(_) if cancel.load(Ordering::SeqCst) => Failure { code: code::INTERRUPTED, message: "stopped".to_string() },
            other => Failure::input(format!("{}: {other}", path.display())),
        })
    })?;
    Ok((found, session, Some(graph)))
}

/// About how long an answer takes that needs a diagnosis.
const EXPECTED: Duration = Duration::from_secs(20);

/// The gain of most of a recording.
fn own_gain(session: &Session, graph: Option<&Graph>) -> Gain {
    let median = |column: &[f64]| {
        let mut values: Vec<f64> = column.iter().copied().filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Gain {
        mu: median(&session.mu).or(graph.map(|g| g.gains.mu)).unwrap_or(1.0),
        lambda: median(&session.lambda).or(graph.map(|g| g.gains.lambda)).unwrap_or(1.0),
    }
}

fn exit_code(found: &Answer) -> u8 {
    match found.happening {
        Happening::Nothing => 0,
        Happening::NotJudged { .. } => code::CANNOT_TELL,
        _ => code::NEGATIVE,
    }
}
