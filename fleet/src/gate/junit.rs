//! The checks as JUnit XML, which services of continuous integration read.

use super::types::{Check, Gated, Outcome};
use std::fmt::Write;

/// The text of the file: a test case for each check.
pub fn junit(gated: &Gated) -> String {
    let count = |outcome| gated.with(outcome).count();
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(
        out,
        "<testsuite name=\"backdrive gate\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"{}\">",
        gated.checks.len(),
        count(Outcome::Failed),
        count(Outcome::Uncertain) + count(Outcome::NotJudged)
    );
    for check in &gated.checks {
        case(&mut out, check);
    }
    out.push_str("</testsuite>\n");
    out
}

fn case(out: &mut String, check: &Check) {
    let (name, place, text) = (escaped(&check.quantity), escaped(&check.place), escaped(&check.sentence));
    let begin = format!("  <testcase classname=\"{place}\" name=\"{name}\"");
    let _ = match check.outcome {
        Outcome::Passed => writeln!(out, "{begin}/>"),
        Outcome::Failed => writeln!(out, "{begin}><failure message=\"{text}\"/></testcase>"),
        Outcome::Uncertain | Outcome::NotJudged => writeln!(out, "{begin}><skipped message=\"{text}\"/></testcase>"),
    };
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    // XML 1.0 has no control characters.
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
