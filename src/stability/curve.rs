//! The curve of a sweep: what happens at each gain.

use backdrive_pages::stability::Point;
use backdrive_stability::outcome::Outcome;
use serde_json::{Value, json};

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
