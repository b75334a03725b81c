//! What all pages have: the terms they use, and what made them.

use backdrive_report::{Page, Table};

/// The terms of a page, and the command and version that made it.
pub fn ending(page: &mut Page, terms: &[(&str, &str)]) {
    page.section("Terms");
    let mut table = Table::new(["term", "meaning"]);
    for (term, meaning) in terms {
        table.push([*term, *meaning]);
    }
    page.table(table);
    page.text(&format!("Made by backdrive {} with: {}", env!("CARGO_PKG_VERSION"), command()));
}

/// The command line of this process, to be typed again.
pub fn command() -> String {
    let words: Vec<String> = std::env::args_os().skip(1).map(|w| shell_word(&w.to_string_lossy())).collect();
    format!("backdrive {}", words.join(" "))
}

/// A word of a command line, in quotes where a shell would read it otherwise.
pub fn shell_word(word: &str) -> String {
    match word.chars().all(|c| c.is_alphanumeric() || "-_./:,=+@%".contains(c)) && !word.is_empty() {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_cut_them() {
        assert_eq!(shell_word("out/run-1.mcap"), "out/run-1.mcap");
        assert_eq!(shell_word("my run.mcap"), "'my run.mcap'");
        assert_eq!(shell_word("it's"), "'it'\\''s'");
        assert_eq!(shell_word(""), "''");
    }
}
