//! The numbers of a comparison in words and cells, for terminal and page.

use backdrive_report::{number, si};
use backdrive_stability::compare::Cell;
use backdrive_stability::outcome::Outcome;

/// Headings of the table, with what they mean on the page.
pub const COLUMNS: [(&str, &str); 8] = [
    ("law", "the coupling between master and slave"),
    (
        "limit",
        "stability limit: the loop gain μλ above which the loop is not stable; > if it is stable at every gain searched, or a clamp \
        acts first",
    ),
    ("at the gain", "the motion at the gain of the comparison"),
    ("stiffness", "stiffness displayed to the hand in contact, relative to μλ times the wall's; 100 % is transparent"),
    ("drag", "resisting force per velocity in free motion, at the master"),
    ("error, free", "slave position minus μ times the master's before contact, rms"),
    ("error, contact", "the same in contact; on a stiff wall most of it is due to the wall"),
    ("effort", "force on the master in contact, rms"),
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
