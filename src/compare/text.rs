//! The comparison as text, and the words and numbers that the page has too.

use super::compared::Compared;
use backdrive_report::{number, si};
use backdrive_stability::compare::Cell;
use backdrive_stability::outcome::Outcome;

/// Headings of the table, with what they mean on the page.
pub(super) const COLUMNS: [(&str, &str); 8] = [
    ("law", "what stands between master and slave"),
    ("edge", "loop gain μλ at which the loop stops being stable; > where it is stable at every gain searched, or a clamp comes first"),
    ("at the gain", "what the loop does at the gain of the comparison"),
    ("shown", "stiffness that the hand is shown in the push over μλ times the wall's; 100 % is transparent"),
    ("drag", "force against the hand per velocity in free motion, at the master"),
    ("off free", "slave beside μ times the master before contact, root mean square"),
    ("off contact", "the same in contact; on a stiff wall most of it is the wall"),
    ("effort", "force on the master in contact, root mean square"),
];

/// The edge in a word.
pub(super) fn edge(cell: &Cell, highest: f64) -> String {
    match (cell.critical_gain, cell.stable_up_to) {
        (Some(critical), _) => number(critical),
        (None, least) if least >= highest => format!("> {}", number(least)),
        (None, least) if least > 0.0 => format!("> {} (clamp)", number(least)),
        (None, _) if matches!(cell.outcome, Outcome::NotJudged { .. }) => "not judged".to_string(),
        (None, _) => "none".to_string(),
    }
}

/// The verdict in a word or two.
pub(super) fn verdict(cell: &Cell) -> &'static str {
    match cell.outcome {
        Outcome::Stable => "stable",
        Outcome::LimitCycle { .. } => "limit cycle",
        Outcome::Unstable { .. } => "unstable",
        Outcome::Limited { .. } => "limited",
        Outcome::NotJudged { .. } => "not judged",
    }
}

/// A row of the table.
pub(super) fn row(cell: &Cell, highest: f64) -> [String; 8] {
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

/// One block of lines per condition.
pub(super) fn text(compared: &Compared) -> String {
    let [mu, lambda] = compared.gains;
    let mut lines = vec![format!("compared at mu*lambda = {} (mu {}, lambda {})", number(mu * lambda), number(mu), number(lambda))];
    let rows: Vec<[String; 8]> = compared.cells.iter().map(|cell| row(cell, compared.highest)).collect();
    let width = |column: usize| rows.iter().map(|r| r[column].chars().count()).chain([COLUMNS[column].0.len()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
    let line = |cells: &[String]| {
        let padded = cells.iter().zip(&widths).enumerate().map(|(column, (cell, width))| match column {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        format!("  {}", padded.collect::<Vec<_>>().join("  "))
    };
    let mut before = String::new();
    for (cell, row) in compared.cells.iter().zip(&rows) {
        let condition = cell.condition.text();
        if condition != before {
            lines.push(format!("\nlink {condition}"));
            lines.push(line(&COLUMNS.map(|c| c.0.to_string())));
            before = condition;
        }
        lines.push(line(row));
    }
    for note in compared.notes {
        lines.push(format!("\nnote: {note}"));
    }
    lines.join("\n")
}
