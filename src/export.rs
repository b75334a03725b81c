//! `backdrive export`: a model as another program's text, and what that leaves out.

use crate::cli;
use crate::failure::{Failure, code};
use crate::output;
use crate::output::may_replace;
use crate::progress::busy;
use backdrive_export::target::{Options, export as written};
use backdrive_export::{Exported, LeftOut};
use backdrive_plant::model::Model;
use backdrive_predict::left_out::{Errors, errors};
use backdrive_report::percent;
use serde_json::{Value, json};

/// Exports, and prints what is left out.
pub fn export(options: &cli::Export) -> Result<u8, Failure> {
    if let Some(out) = &options.out {
        may_replace(out, options.overwrite)?;
        output::writable(out)?;
    }
    let model = Model::load(&options.model)?;
    let how = Options { to: options.to, language: options.language, width: options.width, step: options.step };
    let exported = written(&model, &how).map_err(|e| Failure::input(format!("{}: {e}", options.model.display())))?;
    let errors = match options.on.is_empty() {
        true => None,
        false => Some(busy("simulating the recordings without the omitted parts", || {
            errors(&options.on, &options.model, &options.ignore_signal, &exported.left_out)
        })?),
    };
    if let Some(out) = &options.out {
        output::file(out, &exported.text)?;
    }
    for note in exported.notes.iter().chain(errors.iter().flat_map(|e| &e.notes)) {
        output::note(format_args!("note: {note}"));
    }
    if options.json {
        output::json(&as_json(&model, options, &exported, errors.as_ref()))?;
    } else {
        told(options, &exported, errors.as_ref())?;
    }
    Ok(if !exported.left_out.iter().any(LeftOut::matters) { 0 } else { code::NEGATIVE })
}

/// For a person: the text where it has no file, and the list.
fn told(options: &cli::Export, exported: &Exported, errors: Option<&Errors>) -> Result<(), Failure> {
    let list = list(options, &exported.left_out, errors);
    match &options.out {
        Some(out) => {
            output::note(format_args!("wrote {}", out.display()));
            output::line(list)
        }
        None => {
            output::text(&exported.text)?;
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

fn as_json(model: &Model, options: &cli::Export, exported: &Exported, errors: Option<&Errors>) -> Value {
    let one = |(index, left): (usize, &LeftOut)| {
        json!({
            "part": left.part, "name": left.name, "kind": left.kind, "why": left.why, "instead": left.instead,
            "changes_the_motion": !left.changes.is_empty(),
            "nrmse_without": errors.and_then(|e| e.without.get(index).copied().flatten()),
        })
    };
    let left_out: Vec<Value> = exported.left_out.iter().enumerate().map(one).collect();
    let mut all = json!({
        "model": model.name,
        "to": options.to.word(),
        "out": options.out,
        "left_out": left_out,
        "notes": exported.notes,
        "held_out": errors.map(|e| json!({ "of": e.of, "nrmse": e.with_all, "nrmse_as_exported": e.as_exported })),
    });
    if options.out.is_none() {
        all["text"] = json!(exported.text);
    }
    all
}
