//! What all pages have: what to do next, the terms they use, and what made them.

use crate::offered::{Step, own_command};
use backdrive_report::{Page, Table};

/// The terms of a page, and the command and version that made it.
pub fn ending(page: &mut Page, terms: &[(&str, &str)]) {
    page.section("Terms");
    let mut table = Table::new(["term", "meaning"]);
    for (term, meaning) in terms {
        table.push([*term, *meaning]);
    }
    page.table(table);
    page.text(&format!("Made by backdrive {} with: {}", env!("CARGO_PKG_VERSION"), own_command()));
}

/// The box of what to do next, with the commands that do it.
pub fn todo(page: &mut Page, steps: &[Step]) {
    let items: Vec<(String, Option<String>)> = steps.iter().map(|step| (step.sentence.clone(), step.pasted())).collect();
    page.todo("What to do now", &items);
}

/// Lines for a file, each with its reason.
pub fn lines_to_paste(page: &mut Page, lines: &[(String, Option<String>)]) {
    page.todo("Lines to paste into the set", lines);
}
