//! `backdrive inspect`: is a recording right?

mod text;

use crate::failure::Failure;
use crate::{cli, output, progress};
use backdrive_inspect::{Options, Recording, Report, Source, inspect_with_data};
use backdrive_pages::inspect::page;
use serde_json::{Value, json};

/// Inspects, and prints what was found.
pub fn inspect(options: &cli::Inspect) -> Result<u8, Failure> {
    if let Some(html) = &options.html {
        output::writable(html)?;
    }
    let columns = Some(options.columns.clone()).filter(|columns| !columns.is_empty());
    let sources: Vec<Source> = options.files.iter().cloned().map(Source::Path).collect();
    let found = inspected(&sources, &Options { rate_hz: options.rate, columns, time: options.time.clone() })?;
    if options.json {
        output::json(&found.json()?)?;
    } else {
        output::text(text::text(&found.report))?;
    }
    if let Some(html) = &options.html {
        output::page(html, page(&found.report, &found.recordings))?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(found.code())
}

/// What an inspection found.
pub struct Inspected {
    report: Report,
    recordings: Vec<Recording>,
}

/// Inspects recordings.
///
/// # Errors
/// One cannot be read.
pub fn inspected(sources: &[Source], options: &Options) -> Result<Inspected, Failure> {
    let (report, recordings) = progress::busy("inspecting", || inspect_with_data(sources, options))?;
    Ok(Inspected { report, recordings })
}

impl Inspected {
    /// The result for programs.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub fn json(&self) -> Result<Value, Failure> {
        let mut value = serde_json::to_value(&self.report).map_err(Failure::input)?;
        value["answer"] = json!(self.report.sentence());
        Ok(value)
    }

    /// The text of the page.
    pub fn html(&self) -> String {
        output::html(page(&self.report, &self.recordings))
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        u8::from(self.report.wrong().next().is_some())
    }
}
