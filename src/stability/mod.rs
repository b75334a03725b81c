//! `backdrive stability`: would the loop of a bag be stable at another gain, and how far away is the stability limit.

mod curve;
mod next;
mod text;

pub use crate::cli::{GRIPS, spaced};
use crate::failure::{Failure, code};
use crate::offered::{Step, lines, with_recover};
use crate::{cli, interrupt, output, progress};
use backdrive_nodes::graph::Overrides;
use backdrive_pages::stability::{self as pages, Point};
use backdrive_report::Page;
use backdrive_stability::asked::{Asked, Options, curve};
use backdrive_stability::resimulate::ResimulateError;
use backdrive_stability::session::Session;
use backdrive_stability::verdict::{Answer, AnswerError, Question, Word, answer};
use curve::{curve_text, point_json};
use next::next;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
use text::text;

/// Answers.
pub fn stability(options: &cli::Stability) -> Result<u8, Failure> {
    let cancel = interrupt::heard()?;
    if let Some(html) = &options.html {
        // A report that cannot be written is reported before the work, not after it.
        output::writable(html)?;
    }
    let judged = Judged::of(&resolved(options), options.sweep.as_ref().map(|gains| gains.0.as_slice()), &cancel)?;
    if options.json {
        output::line(judged.json()?)?;
    } else {
        if let Some(curve) = &judged.curve {
            output::line(curve_text(curve))?;
        }
        if let Some(found) = &judged.found {
            output::line(text(found))?;
            // The advice stands above.
            let with_commands: Vec<Step> = judged.steps.iter().filter(|step| !step.commands.is_empty()).cloned().collect();
            lines("to do", 9, &with_commands).iter().try_for_each(output::line)?;
        }
    }
    if let (Some(html), Some(page)) = (&options.html, judged.page()) {
        output::page(html, page)?;
        output::note(format_args!("wrote {}", html.display()));
    }
    match judged.code(&cancel) {
        code::INTERRUPTED => Err(Failure { code: code::INTERRUPTED, message: "stopped; what was done until then is above".to_string() }),
        code => Ok(code),
    }
}

/// A recorded loop that was judged.
pub struct Judged {
    session: Session,
    /// `None` where it was interrupted.
    found: Option<Answer>,
    curve: Option<Vec<Option<Point>>>,
    steps: Vec<Step>,
}

impl Judged {
    /// Judges the loop of a recording; `sweep` are gain products of a re-simulation.
    ///
    /// # Errors
    /// The recording or an option is wrong, or the loop cannot be judged.
    pub fn of(how: &Options, sweep: Option<&[f64]>, cancel: &AtomicBool) -> Result<Judged, Failure> {
        let mut asked = progress::busy(&format!("reading {}", how.recording.display()), || Asked::read(how))?;
        if asked.is_cut {
            asked.session.notes.push(with_recover("the bag was not closed: what it holds is used", &how.recording));
        }
        let question = asked.question(how)?;
        let curve = sweep.map(|gains| swept(&question, gains, cancel)).transpose()?;
        let bar = progress::work();
        let hear = |what: &str, done: usize, all: usize| {
            bar.set_message(what.to_string());
            bar.set_length(all.max(1) as u64);
            bar.set_position(done as u64);
        };
        let found = answer(&question, &hear, cancel);
        bar.finish_and_clear();
        let found = match found {
            Ok(found) => Some(found),
            // What was done until then is printed.
            Err(AnswerError::Resimulate(ResimulateError::Cancelled)) => None,
            Err(e) => return Err(Failure::input(format!("{}: {e}", how.recording.display()))),
        };
        let steps = found.as_ref().map_or_else(Vec::new, |found| next(found, how, asked.graph.as_ref()));
        Ok(Judged { session: asked.session, found, curve, steps })
    }

    /// The result for programs.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub fn json(&self) -> Result<Value, Failure> {
        let mut all = self.found.as_ref().map_or(json!({ "bag": self.session.name, "verdict": "interrupted" }), Answer::json);
        if let Some(curve) = &self.curve {
            all["sweep"] = Value::Array(curve.iter().flatten().map(point_json).collect());
        }
        all["next"] = serde_json::to_value(&self.steps).map_err(Failure::input)?;
        Ok(all)
    }

    /// The page; `None` where it was interrupted.
    fn page(&self) -> Option<Page> {
        let points: Vec<&Point> = self.curve.iter().flatten().flatten().collect();
        Some(pages::page(self.found.as_ref()?, &self.session, &points, &self.steps))
    }

    /// The text of the page; `None` where it was interrupted.
    pub fn html(&self) -> Option<String> {
        self.page().map(output::html)
    }

    /// The exit code.
    pub fn code(&self, cancel: &AtomicBool) -> u8 {
        match self.found.as_ref().filter(|_| !cancel.load(Ordering::SeqCst)).map(|found| found.verdict) {
            None => code::INTERRUPTED,
            Some(Word::Stable) => 0,
            Some(Word::CannotTell) => code::CANNOT_TELL,
            Some(Word::LimitCycle | Word::Unstable | Word::Limited) => code::NEGATIVE,
        }
    }
}

/// Re-simulation of the loop at each gain.
fn swept(question: &Question, gains: &[f64], cancel: &AtomicBool) -> Result<Vec<Option<Point>>, Failure> {
    let bar = progress::work();
    bar.set_message("sweep");
    bar.set_length(gains.len() as u64);
    let done = curve(question, gains, &|done| bar.set_position(done as u64), cancel);
    bar.finish_and_clear();
    Ok(done?)
}

/// The options of the work.
fn resolved(asked: &cli::Stability) -> Options {
    Options {
        recording: asked.recording.clone(),
        roles: asked.roles.clone(),
        changes: Overrides { coupling: asked.coupling, ..asked.parts.overrides() },
        gain: asked.gain,
        mu: asked.mu,
        lambda: asked.lambda,
        script: asked.script.clone(),
        grips: asked.grips.clone(),
    }
}
