//! Tables.

use crate::escape::escape;
use crate::style::Tone;

/// Characters from which a cell counts as a sentence.
const LONG: usize = 48;

/// How a column stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Text.
    Left,
    /// Marks.
    Middle,
    /// Numbers.
    Right,
}

/// One cell of a table.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    text: String,
    tone: Tone,
}

impl Cell {
    /// A cell whose text is coloured as its tone, for instance a verdict.
    pub fn tone(text: impl Into<String>, tone: Tone) -> Self {
        Self { text: text.into(), tone }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self { text: text.into(), tone: Tone::Neutral }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { text, tone: Tone::Neutral }
    }
}

/// Headers and rows. A column in which each filled cell begins like a number stands to the right, if nothing else is asked. Rows of
/// different length are filled up with empty cells.
#[derive(Clone, Debug, Default)]
pub struct Table {
    headers: Vec<String>,
    rows: Vec<Vec<Cell>>,
    align: Vec<(usize, Align)>,
    caption: String,
}

impl Table {
    /// A table with these headers; none of them, and it has no head.
    pub fn new<S: Into<String>>(headers: impl IntoIterator<Item = S>) -> Self {
        Self { headers: headers.into_iter().map(Into::into).collect(), ..Self::default() }
    }

    /// Adds a row.
    pub fn row<C: Into<Cell>>(mut self, cells: impl IntoIterator<Item = C>) -> Self {
        self.push(cells);
        self
    }

    /// Adds a row, in a loop.
    pub fn push<C: Into<Cell>>(&mut self, cells: impl IntoIterator<Item = C>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// Sets how the column with this number (from 0) stands.
    pub fn align(mut self, column: usize, align: Align) -> Self {
        self.align.push((column, align));
        self
    }

    /// A sentence below the table.
    pub fn caption(mut self, caption: &str) -> Self {
        self.caption = caption.into();
        self
    }

    fn class(&self, column: usize) -> &'static str {
        let asked = self.align.iter().rev().find(|a| a.0 == column).map(|a| a.1);
        let cells = || self.rows.iter().filter_map(|r| r.get(column)).map(|c| c.text.trim()).filter(|t| !t.is_empty());
        let align = asked.unwrap_or(if cells().next().is_some() && cells().all(like_a_number) { Align::Right } else { Align::Left });
        match align {
            Align::Left => "",
            Align::Middle => "mid",
            Align::Right => "num",
        }
    }

    pub(crate) fn html(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).chain([self.headers.len()]).max().unwrap_or(0);
        if columns == 0 {
            return String::new();
        }
        let classes: Vec<&str> = (0..columns).map(|c| self.class(c)).collect();
        let attribute = |class: &str| if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
        // On a narrow screen a table with sentences, or with many columns of words, is a list of its rows; one of numbers scrolls.
        let longest = self.rows.iter().flatten().map(|cell| cell.text.chars().count()).max().unwrap_or(0);
        let has_sentences = (columns > 2 && longest >= LONG) || (columns > 4 && longest >= LONG / 2);
        let cards = if has_sentences && !self.headers.is_empty() { " class=\"cards\"" } else { "" };
        let mut out = format!("<div class=\"scroll\"><table{cards}>\n");
        if !self.headers.is_empty() {
            let cells = classes.iter().enumerate().map(|(i, class)| {
                let text = self.headers.get(i).map_or("", String::as_str);
                format!("<th scope=\"col\"{}>{}</th>", attribute(class), escape(text))
            });
            out += &format!("<thead><tr>{}</tr></thead>\n", cells.collect::<String>());
        }
        out += "<tbody>\n";
        for row in &self.rows {
            let cells = classes.iter().enumerate().map(|(i, class)| {
                let cell = row.get(i).cloned().unwrap_or_default();
                let tone = if cell.tone == Tone::Neutral { String::new() } else { format!("tone {}", cell.tone.class()) };
                // Sentences need room, or a narrow screen makes them towers of words.
                let room = match cell.text.chars().count() {
                    0..16 => "",
                    16..LONG => "some",
                    _ => "long",
                };
                let classes: Vec<&str> = [*class, tone.as_str(), room].into_iter().filter(|c| !c.is_empty()).collect();
                let header = self.headers.get(i).filter(|header| !cards.is_empty() && !header.is_empty());
                let label = header.map_or(String::new(), |header| format!(" data-label=\"{}\"", escape(header)));
                format!("<td{}{label}>{}</td>", attribute(&classes.join(" ")), escape(&cell.text))
            });
            out += &format!("<tr>{}</tr>\n", cells.collect::<String>());
        }
        out += "</tbody></table></div>\n";
        if !self.caption.is_empty() {
            // Beside the table, not in it: a caption within would scroll away with a wide one.
            out += &format!("<p class=\"caption\">{}</p>\n", escape(&self.caption));
        }
        out
    }
}

/// Whether a cell begins like a number (`-1.2 mm`, `≥ 50`, `∞`) or marks that there is none.
fn like_a_number(text: &str) -> bool {
    let rest = text.trim_start_matches(['-', '−', '+', '±', '≥', '≤', '<', '>', '~', '≈', '.', ' ']);
    rest.starts_with(|c: char| c.is_ascii_digit() || c == '∞') || matches!(text, "–" | "-" | "—")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_to_the_right() {
        let html = Table::new(["name", "gain", "edge"])
            .row(["a<b", "1.2", "≥ 50"])
            .row([Cell::from("3 axes"), "-0.3 mm".into(), Cell::tone("–", Tone::Unsure)])
            .row(["short"])
            .html();
        assert!(
            html.contains("<th scope=\"col\">name</th><th scope=\"col\" class=\"num\">gain</th><th scope=\"col\" class=\"num\">edge</th>")
        );
        assert!(html.contains("<td>a&lt;b</td><td class=\"num\">1.2</td>"));
        assert!(html.contains("<td class=\"num tone unsure\">–</td>"));
        assert!(html.contains("<td>short</td><td class=\"num\"></td><td class=\"num\"></td>"));
        assert!(Table::new(["a"]).row(["1"]).align(0, Align::Left).html().contains("<td>1</td>"));
        assert_eq!(Table::default().html(), "");
    }

    #[test]
    fn a_table_with_sentences_names_the_column_in_each_cell_for_narrow_screens() {
        let sentence = "It is a sentence that needs more room than a column has.";
        let html = Table::new(["where", "", "what <"]).row(["a", "b", sentence]).html();
        assert!(html.contains("<table class=\"cards\">"), "{html}");
        assert!(html.contains("<td data-label=\"where\">a</td><td>b</td><td class=\"long\" data-label=\"what &lt;\">"), "{html}");
        assert!(!Table::new(["where", "what"]).row(["a", sentence]).html().contains("cards"), "two columns fit");
        assert!(!Table::new(["a", "b", "c"]).row(["1", "2", "3"]).html().contains("cards"), "numbers are compared along a column");
    }
}
