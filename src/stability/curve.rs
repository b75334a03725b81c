//! The curve of a sweep: what happens at each gain.

use crate::failure::Failure;
use crate::progress;
use backdrive_pages::stability::Point;
use backdrive_stability::outcome::Outcome;
use backdrive_stability::resimulate::sweep::sweep;
use backdrive_stability::resimulate::{RunOptions, Scenario};
use backdrive_stability::verdict::Question;
use serde_json::{Value, json};
use std::sync::atomic::AtomicBool;

/// Runs the loop again at every gain.
pub(super) fn curve(question: &Question, gains: &[f64], cancel: &AtomicBool) -> Result<Vec<Option<Point>>, Failure> {
    let no = |why: &str| Failure::input(format!("{}: a sweep runs the loop again, and {why}", question.session.name));
    let graph = question.asked.ok_or_else(|| no("this bag holds no models"))?;
    if question.intents.is_none() && question.script.is_none() {
        return Err(no("its hand was not recorded and could not be recovered; name one with --script"));
    }
    let rows = question.session.len() as u64;
    let mut scenario = Scenario::new(graph.clone(), question.intents.clone(), Some(rows)).map_err(Failure::input)?;
    if let Some(script) = &question.script {
        scenario = scenario.with_script(script);
    }
    let bar = progress::work();
    bar.set_message("sweep");
    bar.set_length(gains.len() as u64);
    let done = sweep(&scenario, gains, &RunOptions::default(), &|done| bar.set_position(done as u64), cancel);
    bar.finish_and_clear();
    done.map_err(Failure::input)
}

pub(super) fn point_json((gain, run): &Point) -> Value {
    json!({ "gain": gain, "verdict": run.outcome.word(), "outcome": run.outcome, "contact_s": run.contact_s })
}

/// Ranges of gains with one verdict.
pub(super) fn curve_text(curve: &[Option<Point>]) -> String {
    let done: Vec<&Point> = curve.iter().flatten().collect();
    let mut lines = Vec::new();
    let mut from = 0;
    for i in 0..done.len() {
        let last = i + 1 == done.len() || done[i + 1].1.outcome.word() != done[i].1.outcome.word();
        if last {
            let (a, b) = (done[from], done[i]);
            let ends = match (&a.1.outcome, &b.1.outcome) {
                (Outcome::Stable, _) => "stable".to_string(),
                (x, y) if from < i => format!("{x} ... {y}"),
                (x, _) => x.to_string(),
            };
            lines.push(format!("sweep    {:>8.3} to {:>8.3}  {ends}", a.0, b.0));
            from = i + 1;
        }
    }
    if done.len() < curve.len() {
        lines.push(format!("sweep    stopped after {} of {} gains", done.len(), curve.len()));
    }
    lines.join("\n")
}
