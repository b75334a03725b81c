//! Paper 000, the ball-screw axis: from LuGre to presliding hysteresis with non-local memory.

use super::{Drive, Step, Story, Walk, device, score, walk};
use crate::run::read;
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_plant::model::{Hold, InputKind, Model, OutputKind};
use toml_edit::{DocumentMut, Item};

pub(crate) const STUDY: Study = Study {
    name: "paper_000",
    about: "a ball-screw axis told blind: LuGre to presliding hysteresis with non-local memory",
    needs: ("", &[]),
    run,
};

const PAPER: &str = "Choi, Han & Kim 2006";
const FILE: &str = "ball-screw.toml";

const STEPS: &[Step] = &[Step {
    paper: "presliding hysteresis that remembers every reversal (Preisach)",
    accept: &["maxwell_slip", "preisach_lugre"],
    places: &[["screw", "ground"]],
}];

/// The axis on a bench that moves it and measures the torque, as the paper's torque meter does.
fn bench(text: &str) -> Result<Model, StudyError> {
    let mut model = Model::from_toml(text, FILE)?;
    let on = model.inputs.first().map_or(0, |input| input.on);
    for input in &mut model.inputs {
        (input.name, input.kind, input.hold) = ("position".to_string(), InputKind::Motion, Hold::Cubic);
    }
    for output in &mut model.outputs {
        (output.name, output.kind, output.resolution) = ("torque".to_string(), OutputKind::Reaction(on), 0.0);
    }
    model.axes.clear();
    Ok(model)
}

/// The model file with LuGre friction instead of its own: about the true slope at a reversal and level of sliding.
fn lugre(text: &str) -> Result<String, StudyError> {
    let mut document: DocumentMut = text.parse().map_err(|e| StudyError::File(format!("{FILE}: {e}")))?;
    for element in document.get_mut("elements").and_then(Item::as_array_of_tables_mut).into_iter().flat_map(|t| t.iter_mut()) {
        if element.get("name").and_then(Item::as_str) == Some("friction") {
            element["kind"] = toml_edit::value("lugre");
            for (key, value) in [("stiffness", 1.8), ("damping", 0.01), ("coulomb", 0.34), ("static", 0.36), ("velocity", 0.1)] {
                element[key] = toml_edit::value(value);
            }
            element.remove("force");
        }
    }
    Ok(document.to_string())
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let text = read(&device(FILE))?;
    let (first, mut truth) = (bench(&lugre(&text)?)?, bench(&text)?);
    for output in &mut truth.outputs {
        // N m: the torque meter's 5 N m to 0.1 %.
        output.noise = 5e-3;
    }
    // Motions that turn within turns, as the paper's Fig. 6, below and beyond the presliding displacement; its 0.2 Hz tail.
    let drives = [
        Drive {
            name: "small",
            held_out: false,
            inputs: ["multisine:peak=0.25,from=0.1,to=1,period=10,periods=1,seed=1"].map(String::from).to_vec(),
        },
        Drive {
            name: "large",
            held_out: false,
            inputs: ["multisine:peak=3,from=0.1,to=0.6,period=10,periods=1,seed=2"].map(String::from).to_vec(),
        },
        Drive { name: "tail", held_out: false, inputs: ["sines:amplitude=0.1/0.5/2,frequency=0.2,cycles=1"].map(String::from).to_vec() },
        Drive {
            name: "other",
            held_out: true,
            inputs: ["multisine:peak=1,from=0.1,to=1,period=10,periods=1,seed=3"].map(String::from).to_vec(),
        },
    ];
    let story = Story { truth, first: &first, rate: 200.0, drives: &drives, steps: STEPS };
    story.record(context.out)?;
    let mut report = Report::new("Paper 000, told blind: LuGre friction");
    let walked = walk(&mut report, context, &Walk { effects: &[1], again: if context.quick { 0 } else { 1 }, effort: 2.5 })?;
    score(&mut report, context.out, PAPER, &walked)?;
    Ok(report)
}
