//! The numbers of a comparison in words and cells, for terminal and page.

use backdrive_report::{number, si};
use backdrive_stability::compare::Cell;
use backdrive_stability::outcome::Outcome;

/// Headings of the table, with what they mean on the page.
pub const COLUMNS: [(&str, &str); 8] = [
    ("law", "what stands between master and slave"),
    ("edge", "loop gain μλ at which the loop stops being stable; > where it is stable at every gain searched, or a clamp comes first"),
    ("at the gain", "what the loop does at the gain of the comparison"),
    ("shown", "stiffness that the hand is shown in the push over μλ times the wall's; 100 % is transparent"),
    ("drag", "force against the hand per velocity in free motion, at the master"),
    ("off free", "slave beside μ times the master before contact, root mean square"),
    ("off contact", "the same in contact; on a stiff wall most of it is the wall"),
    ("effort", "force on the master in contact, root mean square"),
];

/// The critical gain in a word.
pub fn edge(cell: &Cell, highest: f64) -> String {
    match (cell.critical_gain, cell.stable_up_to) {
        (Some(critical), _) => number(critical),
        (None, least) if least >= highest => format!("> {}", number(least)),
        (None, least) if least > 0.0 => format!("> {} (clamp)", number(least)),
        (None, _) if matches!(cell.outcome, Outcome::NotJudged { .. }) => "not judged".to_string(),
        (None, _) => "none".to_string(),
    }
}

/// The verdict in a word or two.
pub fn verdict(cell: &Cell) -> &'static str {
    match cell.outcome {
        Outcome::Stable => "stable",
        Outcome::LimitCycle { .. } => "limit cycle",
        Outcome::Unstable { .. } => "unstable",
        Outcome::Limited { .. } => "limited",
        Outcome::NotJudged { .. } => "not judged",
    }
}

/// A row of the table.
pub fn row(cell: &Cell, highest: f64) -> [String; 8] {
    let m = &cell.measures;
    let with = |value: Option<f64>, unit: &str| value.map_or("-".to_string(), |v| si(v, unit));
    [
        cell.rival.clone(),
        edge(cell, highest),
        verdict(cell).to_string(),
        m.stiffness_share.map_or("-".to_string(), |s| format!("{:.0} %", 100.0 * s)),
        m.drag.map_or("-".to_string(), |d| format!("{d:.1} N s/m")),
        with(m.tracking_free, "m"),
        with(m.tracking_contact, "m"),
        with(m.effort, "N"),
    ]
}
