//! What a viewer may change in a running loop, and the bounds that were set before.

use crate::picture::Known;
use backdrive_control::guard::THIN_MARGIN;
use backdrive_launch::RunPaths;
use backdrive_launch::asks::{Answer, Ask, AskLine, MOST_TEXT};
use backdrive_msgs::margin::KNOWN;
use backdrive_nodes::graph::Graph;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// With a guard the gain may be raised to this many times the largest one of the graph file, unless a bound is given.
const WITH_GUARD: f64 = 10.0;

/// Shortest ramp of a change by hand, s: well above the guard's window of 50 ms.
const RAMP_S: f64 = 0.25;

/// Refused attempts of the same kind within this time are recorded together.
const EVERY: Duration = Duration::from_secs(1);

/// Within what the gain of a run may be changed from outside.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounds {
    /// Least force scale, no unit.
    pub least_lambda: f64,
    /// Greatest force scale, no unit.
    pub most_lambda: f64,
    /// Time over which a change ramps, s.
    pub ramp_s: f64,
}

impl Bounds {
    /// Of a graph. Without a guard nothing intervenes where the loop becomes unstable, so the gain may then only be lowered, and raised again to what the
    /// graph file has. `most_lambda` is a bound that somebody states instead.
    pub fn of(graph: &Graph, most_lambda: Option<f64>) -> Bounds {
        let planned = graph.gains.changes.iter().map(|c| c.lambda).fold(graph.gains.lambda, f64::max);
        let has_guard = crate::scene::Scene::of(graph).has_guard;
        let most_lambda = most_lambda.unwrap_or(if has_guard { WITH_GUARD * planned } else { planned });
        Bounds { least_lambda: 0.0, most_lambda, ramp_s: graph.gains.ramp_s.max(RAMP_S) }
    }
}

/// The way from viewers to the supervisor of a run.
pub(crate) struct Steer {
    paths: RunPaths,
    pub bounds: Bounds,
    has_guard: bool,
    /// Attempts that wait to be recorded, by the reason for which they were refused.
    refused: Mutex<BTreeMap<String, u64>>,
}

/// Why it is not done, or what was done.
pub(crate) type Done = Result<String, String>;

impl Steer {
    pub fn new(paths: RunPaths, bounds: Bounds, has_guard: bool) -> Steer {
        Steer { paths, bounds, has_guard, refused: Mutex::default() }
    }

    fn ask(&self, ask: &Ask) -> Done {
        let line = AskLine::open(&self.paths).map_err(|e| format!("the run cannot be asked: {e}"));
        match line?.ask(ask).map_err(|e| format!("the run does not answer: {e}"))? {
            Answer { done: true, text } => Ok(text),
            Answer { done: false, text } => Err(text),
        }
    }

    /// The force scale that a wish comes to, and why it is not what was wished.
    fn allowed(&self, wished: f64, known: &Known) -> Result<(f64, &'static str), String> {
        let Bounds { least_lambda, most_lambda, .. } = self.bounds;
        if !(wished.is_finite() && (least_lambda..=most_lambda).contains(&wished)) {
            return Err(format!("lambda must be between {least_lambda} and {most_lambda}; `--most-lambda` sets the bound at the start"));
        }
        let (mu, now) = known.gains.ok_or("the gains in force are not known yet")?;
        let margin = known.margin.filter(|m| self.has_guard && m.known == KNOWN);
        let limit = margin.and_then(|m| Some(m.gain * m.factor? / (mu.abs() * THIN_MARGIN))).filter(|l| l.is_finite());
        Ok(match limit.map(|limit| limit.max(now)) {
            Some(limit) if wished > limit => (limit, " (bounded by the guard: beyond it the margin would be thin)"),
            _ => (wished, ""),
        })
    }

    /// Changes the force scale, by a ramp.
    pub fn gain(&self, wished: f64, known: &Known, by: &str) -> Done {
        let (lambda, bounded) = self.allowed(wished, known)?;
        let mu = known.gains.map_or(f64::NAN, |g| g.0);
        let lambda = rounded(lambda);
        self.ask(&Ask::Gains { mu, lambda, ramp_s: self.bounds.ramp_s, by: by.to_string() }).map(|text| text + bounded)
    }

    /// The same for a remedy, which was bounded before: it may go below the bounds of a person.
    pub fn set(&self, lambda: f64, known: &Known, by: &str) -> Done {
        let (mu, _) = known.gains.ok_or("the gains in force are not known yet")?;
        self.ask(&Ask::Gains { mu, lambda: rounded(lambda), ramp_s: self.bounds.ramp_s, by: by.to_string() })
    }

    /// Puts an event into the recording. Whether that was possible: a run that has ended records nothing more.
    pub fn note(&self, kind: &str, severity: u32, text: &str, value: f64) -> bool {
        let note = Ask::Note { severity, kind: kind.to_string(), text: text.to_string(), value: backdrive_msgs::measured(value) };
        self.ask(&note).is_ok()
    }

    /// Leaves the canceller out of the loop, or takes it back.
    pub fn canceller(&self, on: bool, by: &str) -> Done {
        self.ask(&Ask::Canceller { on, ramp_s: self.bounds.ramp_s, by: by.to_string() })
    }

    /// Removes the reflected force and ends the run.
    pub fn stop(&self, known: &Known, by: &str) -> Done {
        self.ask(&Ask::Stop { mu: known.gains.map(|g| g.0), by: by.to_string() })
    }

    /// Puts a remark into the recording.
    pub fn remark(&self, text: &str) -> Done {
        let text = text.trim();
        match text.len() {
            0 => Err("the remark is empty".to_string()),
            1..=MOST_TEXT => self.ask(&Ask::Note { severity: 0, kind: "live_remark".to_string(), text: text.to_string(), value: None }),
            more => Err(format!("the remark has {more} bytes, at most {MOST_TEXT} are kept: shorten it")),
        }
    }

    /// Records an attempt that was refused: the first of its kind at once, those of the next second together.
    pub fn refused(self: &Arc<Steer>, by: &str, why: &str) {
        let mut refused = self.refused.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(waiting) = refused.get_mut(why) {
            *waiting += 1;
            return;
        }
        refused.insert(why.to_string(), 0);
        drop(refused);
        let (steer, by, why) = (Arc::clone(self), by.to_string(), why.to_string());
        let record = move || {
            steer.note("live_refused", 1, &format!("{by} was refused: {why}"), 1.0);
            std::thread::sleep(EVERY);
            let more = steer.refused.lock().unwrap_or_else(PoisonError::into_inner).remove(&why).unwrap_or(0);
            if more > 0 {
                steer.note("live_refused", 1, &format!("{more} more attempts were refused: {why}"), more as f64);
            }
        };
        // Without a thread nothing is recorded, and the attempt is refused all the same.
        let _ = std::thread::Builder::new().name("live-refused".to_string()).spawn(record);
    }
}

/// Four significant digits: what a person has set, and what is recorded.
fn rounded(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let scale = 10f64.powi(3 - value.abs().log10().floor() as i32);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_keeps_four_digits() {
        assert_eq!([rounded(0.299_999_9), rounded(12.3456), rounded(0.0), rounded(0.001_234_56)], [0.3, 12.35, 0.0, 0.001_235]);
    }
}
