//! `backdrive export`: a model as another program's text, and what that leaves out. The work is that of [`backdrive_predict::export`].

use crate::cli;
use crate::failure::{Failure, code};
use crate::output;
use crate::output::may_replace;
use crate::progress::busy;
use backdrive_export::LeftOut;
use backdrive_export::target;
use backdrive_predict::export::{Done, Options};
use backdrive_predict::left_out::Errors;
use backdrive_report::percent;
use std::path::Path;

/// Exports, and prints what is left out.
pub fn export(options: &cli::Export) -> Result<u8, Failure> {
    let done = exported_into(&resolved(options), options.out.as_deref(), options.overwrite)?;
    if options.json {
        output::json(&done.json(options.out.as_deref()))?;
    } else {
        reported(options, &done)?;
    }
    Ok(ended(&done))
}

/// Exports, and writes the text where a file is given; notes go to the caller.
///
/// # Errors
/// As of [`Done::of`]; the file is there and may not be replaced, or cannot be written.
pub fn exported_into(options: &Options, out: Option<&Path>, overwrite: bool) -> Result<Done, Failure> {
    if let Some(out) = out {
        may_replace(out, overwrite)?;
        output::writable(out)?;
    }
    let done = match options.on {
        Some(_) => busy("simulating the recordings without the omitted parts", || Done::of(options))?,
        None => Done::of(options)?,
    };
    if let Some(out) = out {
        output::file(out, &done.exported.text)?;
    }
    done.notes().for_each(|note| output::note(format_args!("note: {note}")));
    Ok(done)
}

/// The exit code of an export.
pub fn ended(done: &Done) -> u8 {
    if done.is_complete() { 0 } else { code::NEGATIVE }
}

/// The options of the work.
fn resolved(asked: &cli::Export) -> Options {
    Options {
        model: asked.model.clone(),
        how: target::Options { to: asked.to, language: asked.language, width: asked.width, step: asked.step },
        on: Some(asked.on.clone()).filter(|on| !on.is_empty()).map(Into::into),
        ignored: asked.ignore_signal.clone(),
    }
}

/// For a person: the text where it has no file, and the list.
fn reported(options: &cli::Export, done: &Done) -> Result<(), Failure> {
    let list = list(options, &done.exported.left_out, done.errors.as_ref());
    match &options.out {
        Some(out) => {
            output::note(format_args!("wrote {}", out.display()));
            output::line(list)
        }
        None => {
            output::text(&done.exported.text)?;
            output::note(list);
            Ok(())
        }
    }
}

fn list(options: &cli::Export, left_out: &[LeftOut], errors: Option<&Errors>) -> String {
    if left_out.is_empty() {
        return "nothing is left out".to_string();
    }
    let error = |index: usize| match (errors, left_out[index].changes.is_empty()) {
        (_, true) => "; the motion is the same".to_string(),
        (None, false) => String::new(),
        (Some(errors), false) => match errors.without.get(index).copied().flatten() {
            Some(without) => format!("; nrmse {} without it", percent(without)),
            None => "; without it the recordings cannot be simulated".to_string(),
        },
    };
    let mut text = "left out:\n".to_string();
    for (index, left) in left_out.iter().enumerate() {
        let instead = left.instead.as_deref().map_or(String::new(), |instead| format!("; in its place: {instead}"));
        text += &format!("  {} ({}): {}{instead}{}\n", left.name, left.kind, left.why, error(index));
    }
    match errors {
        Some(errors) => {
            let all = errors.as_exported.map_or("cannot be simulated".to_string(), percent);
            text += &format!("nrmse on {}: {} with everything, {all} as exported\n", errors.of, percent(errors.with_all));
        }
        None if !left_out.iter().any(LeftOut::matters) => {}
        None => {
            text += &format!(
                "effect on the error on recordings: backdrive export {} --to {} --on SET\n",
                options.model.display(),
                options.to.word()
            )
        }
    }
    text.trim_end().to_string()
}
