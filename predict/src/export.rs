//! A model as another program's text, what that leaves out, and what leaving it out costs on recordings.

use crate::error::PredictError;
use crate::left_out::{Errors, errors};
use backdrive_export::target::{self, Target};
use backdrive_export::{Exported, LeftOut};
use backdrive_plant::model::Model;
use backdrive_sets::Recordings;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What is exported, and what it is compared on.
#[derive(Debug, Clone)]
pub struct Options {
    /// The model file.
    pub model: PathBuf,
    /// What it is written for, and how.
    pub how: target::Options,
    /// Recordings to compute the error that omitted parts cause; `None` to compute none.
    pub on: Option<Recordings>,
    /// Recorded inputs that the model may lack.
    pub ignored: Vec<String>,
}

/// A model in another form.
pub struct Done {
    /// The text, what it leaves out, and notes on it.
    pub exported: Exported,
    /// What that costs on recordings.
    pub errors: Option<Errors>,
    model: String,
    to: Target,
}

impl Done {
    /// Exports.
    ///
    /// # Errors
    /// A file cannot be read, the target cannot hold the model, or the model cannot be simulated on the recordings.
    pub fn of(options: &Options) -> Result<Done, PredictError> {
        let model = Model::load(&options.model)?;
        let exported = target::export(&model, &options.how);
        let exported = exported.map_err(|e| PredictError::input(format!("{}: {e}", options.model.display())))?;
        let cost = |on: &Recordings| errors(on, &options.model, &options.ignored, &exported.left_out);
        let errors = options.on.as_ref().map(cost).transpose()?;
        Ok(Done { exported, errors, model: model.name, to: options.how.to })
    }

    /// Whether everything that moves the model was exported.
    pub fn is_complete(&self) -> bool {
        !self.exported.left_out.iter().any(LeftOut::matters)
    }

    /// What a person should know: a sentence each.
    pub fn notes(&self) -> impl Iterator<Item = &String> {
        self.exported.notes.iter().chain(self.errors.iter().flat_map(|errors| &errors.notes))
    }

    /// The result for programs; with the text where it goes to no file.
    pub fn json(&self, out: Option<&Path>) -> Value {
        let errors = self.errors.as_ref();
        let one = |(index, left): (usize, &LeftOut)| {
            json!({
                "part": left.part, "name": left.name, "kind": left.kind, "why": left.why, "instead": left.instead,
                "changes_the_motion": !left.changes.is_empty(),
                "nrmse_without": errors.and_then(|e| e.without.get(index).copied().flatten()),
            })
        };
        let left_out: Vec<Value> = self.exported.left_out.iter().enumerate().map(one).collect();
        let mut all = json!({
            "model": self.model,
            "to": self.to.word(),
            "out": out,
            "left_out": left_out,
            "notes": self.exported.notes,
            "held_out": errors.map(|e| json!({ "of": e.of, "nrmse": e.with_all, "nrmse_as_exported": e.as_exported })),
        });
        if out.is_none() {
            all["text"] = json!(self.exported.text);
        }
        all
    }
}
