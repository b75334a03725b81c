//! `backdrive model show` and `backdrive model check`.

use crate::cli;
use crate::failure::Failure;
use crate::output;
use crate::simulate::held_model;
use backdrive_plant::describe::{Severity, check as remarks, describe};
use backdrive_plant::linear::Operating;
use backdrive_plant::parse::ModelFile;
use backdrive_plant::stepper::{Options, Plant};

/// Does what `backdrive model` is asked.
pub fn model(command: &cli::Model) -> Result<u8, Failure> {
    match command {
        cli::Model::Check(file) => check(file),
        cli::Model::Show(file) => show(file),
    }
}

fn check(file: &cli::ModelFile) -> Result<u8, Failure> {
    let path = file.model.display();
    match ModelFile::load(&file.model)? {
        ModelFile::Fragment(fragment) => {
            output::line(format_args!("{path}: fine: a fragment of {} elements", fragment.network.elements.len()))?;
        }
        ModelFile::Device(_) => {
            let model = held_model(&file.model, file.grip.as_deref())?;
            // What cannot be stepped is told now, not at the start of a run.
            let plant = Plant::new(&model, 2e-4, &Options::default()).map_err(|e| Failure::input(format!("{path}: {e}")))?;
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
    let at = match file.amplitude {
        Some(amplitude) if amplitude > 0.0 && amplitude.is_finite() => Operating::amplitude(amplitude),
        Some(amplitude) => return Err(Failure { code: 2, message: format!("--amplitude must be above 0, is {amplitude}") }),
        None => Operating::small(),
    };
    let description = match ModelFile::load(&file.model)? {
        ModelFile::Fragment(fragment) => describe(&fragment.network, &at),
        ModelFile::Device(_) => describe(&held_model(&file.model, file.grip.as_deref())?, &at),
    };
    if file.json {
        output::json(&description)?;
    } else {
        output::text(format_args!("{description}"))?;
    }
    Ok(0)
}
