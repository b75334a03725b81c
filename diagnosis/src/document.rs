//! The tuning table and the steps of a search as a page of the documentation, `docs/tuning.md`.

use crate::search::step_table;
use crate::tuning::Tuning;
use std::fmt::Write;

/// The heading below which the page is written by hand: what was measured of the table.
pub const MEASURED: &str = "## How much verdicts depend on it";

/// The page up to [`MEASURED`].
pub fn tuning_page() -> String {
    let mut page = String::from(
        "# The tuning of a diagnosis\n\n\
         Every number that decides what is tried, how well it is fitted and what is claimed, with its unit and what it rests on. The first part of this page is\n\
         printed by `cargo run -p backdrive-diagnosis --example tuning`, and a test holds it against the code (`diagnosis/src/tuning/`). Residuals are\n\
         normalised: divided by the noise standard deviation of their output. Work is counted in steps of a linear network in the stepper.\n\n\
         What belongs to one physics (ranges, starting values, what is tried beside what) stands in its file in `diagnosis/src/physics/`. `x0.5` and `x2` of any entry\n\
         are tried by `diagnosis/tests/concealed/sensitivity.py`.\n\n\
         What an entry rests on: **statistics**, the level of a test or criterion; **numerics**, the size of an error of arithmetic; **measured**, a command and what it\n\
         said; **cost**, it trades time for completeness and claims nothing; **judgement**, a reason and no more.\n",
    );
    let mut group = "";
    let rows = Tuning::default().rows();
    for row in &rows {
        let (own, field) = row.name.split_once('.').unwrap_or(("", &row.name));
        if own != group {
            group = own;
            let _ = write!(page, "\n## {group}\n\n| entry | value | unit | decides | rests on |\n|---|---|---|---|---|\n");
        }
        let (kind, why) = row.evidence.told();
        let _ = writeln!(page, "| `{field}` | {} | {} | {} | {kind}: {why} |", row.value, row.unit, row.decides);
    }
    page += "\n## steps\n\nEach step proposes structures, which race (search.further, search.ended). Where the best is far from the noise, a step may take its share of the work.\n\n\
             | step | share of the work |\n|---|---|\n";
    for step in step_table() {
        let _ = writeln!(page, "| {} | {} |", step.name, step.share);
    }
    page + "\n"
}
