//! `backdrive model show` and `backdrive model check`.

use crate::cli;
use crate::failure::Failure;
use crate::simulate::held_model;
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
            println!("{path}: fine: a fragment of {} elements", fragment.network.elements.len());
        }
        ModelFile::Device(_) => {
            let model = held_model(&file.model, file.grip.as_deref())?;
            // What cannot be stepped is told now, not at the start of a run.
            let plant = Plant::new(&model, 2e-4, &Options::default()).map_err(|e| Failure::input(format!("{path}: {e}")))?;
            println!(
                "{path}: fine: {} bodies, {} elements, {} inputs, {} outputs, {} axes; {} substeps at 5 kHz",
                model.bodies.len(),
                model.elements.len(),
                model.inputs.len(),
                model.outputs.len(),
                model.axes.len(),
                plant.substeps()
            );
        }
    }
    Ok(0)
}

fn show(file: &cli::ModelFile) -> Result<u8, Failure> {
    let text = match ModelFile::load(&file.model)? {
        ModelFile::Fragment(fragment) => backdrive_plant::describe::network(&fragment.network),
        ModelFile::Device(_) => {
            let model = held_model(&file.model, file.grip.as_deref())?;
            backdrive_plant::describe::describe(&model)
        }
    };
    print!("{text}");
    Ok(0)
}
