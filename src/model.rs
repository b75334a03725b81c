//! `backdrive model show` and `backdrive model check`.

use crate::cli;
use crate::failure::Failure;
use crate::output;
use backdrive_plant::describe::{Severity, check as remarks, describe};
use backdrive_plant::linear::Operating;
use backdrive_plant::parse::ModelFile;
use backdrive_plant::stepper::{Options, Plant};
use backdrive_predict::held::held_model;

/// Does what `backdrive model` is asked.
pub fn model(command: &cli::Model) -> Result<u8, Failure> {
    match command {
        cli::Model::Check(file) => check(file),
        cli::Model::Show(file) => show(file),
    }
}

fn check(file: &cli::ModelFile) -> Result<u8, Failure> {
    let path = file.model.display();
    let loaded = ModelFile::load(&file.model)?;
    fit_to_show(&loaded, file)?;
    match loaded {
        ModelFile::Fragment(fragment) => {
            output::line(format_args!("{path}: fine: a fragment of {} elements", fragment.network.elements.len()))?;
        }
        ModelFile::Device(_) => {
            let model = held_model(&file.model, file.grip.as_deref())?;
            // What cannot be stepped is reported now, not at the start of a run.
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

/// Most bodies of a model that is looked at: its modes and its response are those of full matrices, whose cost grows with the cube of it.
const MOST_BODIES: usize = 300;

/// Whether there is something to look at, and not too much.
fn fit_to_show(loaded: &ModelFile, file: &cli::ModelFile) -> Result<(), Failure> {
    let network = match loaded {
        ModelFile::Fragment(fragment) => &fragment.network,
        ModelFile::Device(model) => model,
    };
    let path = file.model.display();
    match network.bodies.len() {
        0 if matches!(loaded, ModelFile::Device(_)) => Err(Failure::input(format!(
            "{path}: has no [bodies], so nothing moves; add what moves, such as `handle = 0.1`, kg (docs/own-recording.md, plant/models)"
        ))),
        bodies if bodies > MOST_BODIES => Err(Failure::input(format!(
            "{path}: has {bodies} bodies, and at most {MOST_BODIES} can be shown; merge those that move together (a chain needs few \
             bodies per wave length of the highest frequency that matters)"
        ))),
        _ => Ok(()),
    }
}

fn show(file: &cli::ModelFile) -> Result<u8, Failure> {
    let at = match file.amplitude {
        Some(amplitude) if amplitude > 0.0 && amplitude.is_finite() => Operating::amplitude(amplitude),
        Some(amplitude) => return Err(Failure { code: 2, message: format!("--amplitude must be above 0, is {amplitude}") }),
        None => Operating::small(),
    };
    let loaded = ModelFile::load(&file.model)?;
    fit_to_show(&loaded, file)?;
    let description = match loaded {
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
