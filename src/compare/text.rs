//! The comparison as text.

use backdrive_pages::compare::cells::{COLUMNS, row};
use backdrive_pages::compare::compared::Compared;
use backdrive_report::number;

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
