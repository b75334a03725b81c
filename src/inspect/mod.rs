//! `backdrive inspect`: is a recording right?

mod text;

use crate::failure::Failure;
use crate::{cli, output, progress};
use backdrive_inspect::{Options, Source, inspect_with_data};
use backdrive_pages::inspect::page;
use serde_json::json;

/// Inspects, and prints what was found.
pub fn inspect(options: &cli::Inspect) -> Result<u8, Failure> {
    if let Some(html) = &options.html {
        output::writable(html)?;
    }
    let sources: Vec<Source> = options.files.iter().cloned().map(Source::Path).collect();
    let columns = Some(options.columns.clone()).filter(|columns| !columns.is_empty());
    let read = Options { rate_hz: options.rate, columns, time: options.time.clone() };
    let (report, recordings) = progress::busy("inspecting", || inspect_with_data(&sources, &read))?;
    if options.json {
        let mut value = serde_json::to_value(&report).map_err(Failure::input)?;
        value["answer"] = json!(report.sentence());
        output::json(&value)?;
    } else {
        output::text(text::text(&report))?;
    }
    if let Some(html) = &options.html {
        output::page(html, page(&report, &recordings))?;
        output::note(format_args!("wrote {}", html.display()));
    }
    Ok(u8::from(report.wrong().next().is_some()))
}
