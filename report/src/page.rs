//! The page.

use crate::escape::escape;
use crate::figure::Figure;
use crate::style::{COLOURS, FIGURE_STYLE, PAGE_STYLE, Tone};
use crate::table::Table;
use std::path::Path;

/// The library that draws, and our script that gives it the data of the page; see vendor/README.md.
const LIBRARY: &str = include_str!("../vendor/echarts/echarts.min.js");
const FIGURES: &str = include_str!("figures.js");
/// The buttons that copy commands.
const COPY: &str = include_str!("copy.js");

/// A report: blocks in the order in which they are added. All text is plain text; markup in it is shown, not obeyed.
#[derive(Clone, Debug, Default)]
pub struct Page {
    title: String,
    body: String,
}

impl Page {
    /// An empty report.
    pub fn new(title: &str) -> Self {
        Self { title: title.into(), body: String::new() }
    }

    /// The sentence that a hurried reader takes away, large and in the colour of its tone.
    pub fn lead(&mut self, tone: Tone, sentence: &str) -> &mut Self {
        self.add(format_args!("<p class=\"lead {}\">{}</p>\n", tone.class(), escape(sentence)))
    }

    /// A remark set apart.
    pub fn note(&mut self, text: &str) -> &mut Self {
        self.add(format_args!("<p class=\"aside unsure\">{}</p>\n", escape(text)))
    }

    /// Something to beware of, set apart.
    pub fn warning(&mut self, text: &str) -> &mut Self {
        self.add(format_args!("<p class=\"aside warning\"><b>Warning:</b> {}</p>\n", escape(text)))
    }

    /// A box of what to do now: a sentence each, with a command to copy where there is one. Nothing where there are no items.
    pub fn todo(&mut self, heading: &str, items: &[(String, Option<String>)]) -> &mut Self {
        if items.is_empty() {
            return self;
        }
        self.add(format_args!("{TODO}\n<b>{}</b>\n<ul>\n", escape(heading)));
        for (sentence, command) in items {
            let command = command.as_ref().map_or(String::new(), |c| format!("<pre><code>{}</code></pre>", escape(c)));
            self.add(format_args!("<li>{}{command}</li>\n", escape(sentence)));
        }
        self.add(format_args!("</ul>\n</div>\n"))
    }

    /// A line that leads to a file beside the page, by its path from the page. What is no such path (an address with a scheme, one from
    /// the root) stands as text.
    pub fn link(&mut self, text: &str, path: &str) -> &mut Self {
        if path.contains(':') || path.starts_with('/') {
            return self.text(&format!("{text}: {path}"));
        }
        self.add(format_args!("<p><a href=\"{}\">{}</a></p>\n", escape(path), escape(text)))
    }

    /// Begins a section.
    pub fn section(&mut self, heading: &str) -> &mut Self {
        self.add(format_args!("<h2>{}</h2>\n", escape(heading)))
    }

    /// Text; an empty line begins a new paragraph.
    pub fn text(&mut self, text: &str) -> &mut Self {
        for paragraph in text.replace("\r\n", "\n").split("\n\n").filter(|p| !p.trim().is_empty()) {
            self.add(format_args!("<p>{}</p>\n", escape(paragraph.trim())));
        }
        self
    }

    /// A table; wide ones scroll by themselves.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.add(format_args!("{}", table.html()))
    }

    /// A plot or several ([`Figure`]) with a caption, which may be empty.
    pub fn figure(&mut self, figure: impl Into<Figure>, caption: &str) -> &mut Self {
        let caption = if caption.is_empty() { String::new() } else { format!("<figcaption>{}</figcaption>\n", escape(caption)) };
        let drawings = figure.into().html();
        self.add(format_args!("<figure>\n{drawings}{caption}</figure>\n"))
    }

    /// A part that is folded away until asked for.
    ///
    /// ```
    /// # use backdrive_report::{Page, Table};
    /// # let mut page = Page::new("t");
    /// page.details("How it was computed", |inside| {
    ///     inside.text("Welch, 50 % overlap.").table(Table::new(["segments", "window"]).row(["31", "Hann"]));
    /// });
    /// ```
    pub fn details(&mut self, summary: &str, fill: impl FnOnce(&mut Page)) -> &mut Self {
        let mut inside = Page::default();
        fill(&mut inside);
        self.add(format_args!("<details><summary>{}</summary>\n{}</details>\n", escape(summary), inside.body))
    }

    /// Writes a symbol in another way in all text of the page so far, its title and figures included.
    pub fn spell(&mut self, written: &str, shown: &str) -> &mut Self {
        let (written, shown) = (escape(written), escape(shown));
        self.title = self.title.replace(&written, &shown);
        self.body = self.body.replace(&written, &shown);
        self
    }

    fn add(&mut self, markup: std::fmt::Arguments) -> &mut Self {
        use std::fmt::Write;
        let _ = self.body.write_fmt(markup); // writing to a String cannot fail
        self
    }

    /// The whole file. It is HTML and XML at once, refers to nothing outside itself, and is the same for the same data. The library that
    /// draws is in it once, if there is a figure.
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let drawn = self.body.contains(crate::figure::DATA);
        let figures = if drawn { script(LIBRARY) + &script(FIGURES) } else { String::new() };
        let copy = if self.body.contains(TODO) { script(COPY) } else { String::new() };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
             <style>\n{COLOURS}{PAGE_STYLE}{FIGURE_STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{}</main>\n\
             {copy}{figures}</body>\n</html>\n",
            self.body
        )
    }

    /// Writes the file, in place of one that is there.
    pub fn write(&self, path: impl AsRef<Path>) -> std::io::Result<()> {
        std::fs::write(path, self.html())
    }
}

/// The box with commands to copy.
const TODO: &str = "<div class=\"aside todo\">";

/// A script that XML parsers take as text.
fn script(source: &str) -> String {
    format!("<script>//<![CDATA[\n{source}\n//]]></script>\n")
}
