//! The result of a study: measured beside published, and whether it is in its range.

use std::fmt::Write as _;

/// A line of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// What was measured.
    pub what: String,
    /// Our figure or finding.
    pub measured: String,
    /// The published one, or what was known; empty where there is none.
    pub published: String,
    /// Where that stands.
    pub source: String,
    /// Whether the measured one is within the bar; `None` where there is no bar.
    pub within: Option<bool>,
}

/// The result of a study.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// The title.
    pub title: String,
    /// The table.
    pub lines: Vec<Line>,
    /// What a reader should know beside the table.
    pub notes: Vec<String>,
    /// Figures by name, for tests: no rounding.
    pub figures: Vec<(String, f64)>,
    /// What was found by name, for tests: verdicts and the effects that they name.
    pub words: Vec<(String, String)>,
}

impl Report {
    /// An empty report.
    pub fn new(title: &str) -> Report {
        Report { title: title.to_string(), ..Report::default() }
    }

    /// A line.
    pub fn line(&mut self, what: &str, measured: impl Into<String>, published: impl Into<String>, source: &str, within: Option<bool>) {
        let (measured, published) = (measured.into(), published.into());
        self.lines.push(Line { what: what.to_string(), measured, published, source: source.to_string(), within });
    }

    /// Keeps a figure for tests.
    pub fn figure(&mut self, name: &str, value: f64) {
        self.figures.push((name.to_string(), value));
    }

    /// Keeps a word for tests.
    pub fn word(&mut self, name: &str, value: &str) {
        self.words.push((name.to_string(), value.to_string()));
    }

    /// A figure by its name; NaN where there is none.
    pub fn figure_named(&self, name: &str) -> f64 {
        self.figures.iter().find(|f| f.0 == name).map_or(f64::NAN, |f| f.1)
    }

    /// A word by its name; empty where there is none.
    pub fn word_named(&self, name: &str) -> &str {
        self.words.iter().find(|w| w.0 == name).map_or("", |w| &w.1)
    }

    /// How many bars are missed.
    pub fn missed(&self) -> usize {
        self.lines.iter().filter(|l| l.within == Some(false)).count()
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let mut out = format!("# {}\n\n| | measured | published | source | bar |\n|---|---|---|---|---|\n", self.title);
        for line in &self.lines {
            let met = bar(line.within);
            let _ = writeln!(out, "| {} | {} | {} | {} | {met} |", line.what, line.measured, line.published, line.source);
        }
        for note in &self.notes {
            let _ = write!(out, "\n{note}\n");
        }
        out
    }

    /// The table for a terminal.
    pub fn text(&self) -> String {
        let mut rows = vec![["", "measured", "published", "source", ""].map(str::to_string)];
        for line in &self.lines {
            let cells = [&line.what, &line.measured, &line.published, &line.source].map(String::clone);
            let [a, b, c, d] = cells;
            rows.push([a, b, c, d, bar(line.within).to_string()]);
        }
        let width = |c: usize| rows.iter().map(|r| r[c].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..5).map(width).collect();
        let mut out = format!("{}\n\n", self.title);
        for row in &rows {
            let cells: Vec<String> =
                row.iter().zip(&widths).map(|(cell, w)| format!("{cell}{}", " ".repeat(w - cell.chars().count()))).collect();
            let _ = writeln!(out, "{}", cells.join("  ").trim_end());
        }
        for note in &self.notes {
            let _ = write!(out, "\n{note}\n");
        }
        out
    }
}

fn bar(within: Option<bool>) -> &'static str {
    match within {
        Some(true) => "met",
        Some(false) => "missed",
        None => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_says_what_is_missed() {
        let mut report = Report::new("device");
        report.line("mass", "95.1 kg", "95.1089 kg", "the paper", Some(true));
        report.line("error", "7 %", "3 %", "the paper", Some(false));
        report.figure("error", 0.07);
        let text = report.text();
        assert!(text.contains("error  7 %       3 %         the paper  missed"), "{text}");
        assert!(report.markdown().contains("| mass | 95.1 kg | 95.1089 kg | the paper | met |"));
        assert_eq!(report.missed(), 1);
        assert_eq!(report.figure_named("error"), 0.07);
        assert!(report.figure_named("other").is_nan());
    }
}
