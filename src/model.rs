//! `backdrive model show` and `backdrive model check`. The description is that of [`backdrive_predict::show`].

use crate::cli;
use crate::failure::Failure;
use crate::output;
use backdrive_plant::describe::{Severity, check as remarks};
use backdrive_plant::linear::Operating;
use backdrive_plant::parse::ModelFile;
use backdrive_plant::stepper::{self, Plant};
use backdrive_predict::held::held_model;
use backdrive_predict::show::{Options, described, read};

/// Does what `backdrive model` is asked.
pub fn model(command: &cli::Model) -> Result<u8, Failure> {
    match command {
        cli::Model::Check(file) => check(file),
        cli::Model::Show(file) => show(file),
    }
}

fn check(file: &cli::ModelFile) -> Result<u8, Failure> {
    let path = file.model.display();
    match read(&file.model)? {
        ModelFile::Fragment(fragment) => {
            output::line(format_args!("{path}: fine: a fragment of {} elements", fragment.network.elements.len()))?;
        }
        ModelFile::Device(_) => {
            let model = held_model(&file.model, file.grip.as_deref())?;
            // What cannot be stepped is reported now, not at the start of a run.
            let plant = Plant::new(&model, 2e-4, &stepper::Options::default()).map_err(|e| Failure::input(format!("{path}: {e}")))?;
            for remark in remarks(&model, &Operating::small()) {
                output::note(format_args!(
                    "{}: {path}: {}",
                    if remark.severity == Severity::Note { "note" } else { "warning" },
                    remark.message
                ));
            }
            output::line(format_args!(
                "{path}: fine: {} bodies, {} elements, {} inputs, {} outputs, {} axes; {} substeps at 5 kHz",
                model.bodies.len(),
                model.elements.len(),
                model.inputs.len(),
                model.outputs.len(),
                model.axes.len(),
                plant.substeps()
            ))?;
        }
    }
    Ok(0)
}

fn show(file: &cli::ModelFile) -> Result<u8, Failure> {
    let asked = Options { model: file.model.clone(), grip: file.grip.clone(), amplitude: file.amplitude };
    let description = described(&asked)?;
    if file.json {
        output::json(&description)?;
    } else {
        output::text(format_args!("{description}"))?;
    }
    Ok(0)
}
