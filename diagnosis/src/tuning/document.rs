//! The tuning table and the steps of a search as a page in Markdown, which `cargo run -p backdrive-diagnosis --example tuning` prints.

use crate::search::step_table;
use crate::tuning::Tuning;
use std::fmt::Write;

/// The page.
pub fn tuning_page() -> String {
    let mut page = String::from(
        "# Constants of a diagnosis\n\n\
         Every constant that decides what is tried, how well it is fitted and what is claimed, with its unit and evidence (docs/tuning.md explains both).\n",
    );
    let mut group = "";
    let rows = Tuning::default().rows();
    for row in &rows {
        let (own, field) = row.name.split_once('.').unwrap_or(("", &row.name));
        if own != group {
            group = own;
            let _ = write!(page, "\n## {group}\n\n| entry | value | unit | decides | evidence |\n|---|---|---|---|---|\n");
        }
        let (kind, why) = row.evidence.kind_and_reason();
        let _ = writeln!(page, "| `{field}` | {} | {} | {} | {kind}: {why} |", row.value, row.unit, row.decides);
    }
    page += "\n## steps\n\nEach step proposes structures, which race (search.further, search.ended). Where the best is far from the noise, a step may take its share of the work.\n\n\
             | step | share of the work |\n|---|---|\n";
    for step in step_table() {
        let _ = writeln!(page, "| {} | {} |", step.name, step.share);
    }
    page
}
