//! What all pages have: what to do next and the terms they use; and words that several pages share.

use crate::offered::Step;
use backdrive_report::{Page, Table};

/// The terms of a page, folded.
pub fn ending(page: &mut Page, terms: &[(&str, &str)]) {
    let mut table = Table::new(["term", "meaning"]);
    for (term, meaning) in terms {
        table.push([*term, *meaning]);
    }
    page.details("Terms", |inside| {
        inside.table(table);
    });
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

/// Writes the loop gain as `μλ`. In a terminal and in files it is `mu*lambda`, and sentences are made once for all of them.
pub fn symbols(page: &mut Page) {
    page.spell("mu*lambda", "μλ");
}

/// The last part of a path.
pub fn file_name(path: &str) -> &str {
    path.rsplit('/').find(|part| !part.is_empty()).unwrap_or(path)
}

/// The words with their first letter large.
pub fn large(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A sentence from a clause: its first letter large, a full stop at its end.
pub fn sentence(clause: &str) -> String {
    let stop = if clause.is_empty() || clause.ends_with(['.', '!', '?', ':']) { "" } else { "." };
    format!("{}{stop}", large(clause))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_gain_has_one_spelling_in_headings_tables_and_folded_parts() {
        let mut page = Page::new("Stability at mu*lambda = 3");
        page.text("from mu*lambda = 2 on").table(Table::new(["mu*lambda"]).row(["2"])).details("mu*lambda", |inside| {
            inside.text("at μλ");
        });
        symbols(&mut page);
        let html = page.html();
        assert!(!html.contains("mu*lambda") && html.contains("<h1>Stability at μλ = 3</h1>") && html.contains("from μλ = 2 on"), "{html}");
    }

    #[test]
    fn clauses_become_sentences_and_paths_lose_their_folders() {
        assert_eq!(sentence("äh, no"), "Äh, no.");
        assert_eq!(sentence("Done."), "Done.");
        assert_eq!(sentence(""), "");
        assert_eq!(file_name("a/b/session/"), "session");
    }
}
