//! Paper 002, the force-reflecting master: from a linear chain to Coulomb friction at motor and drum and a hysteretic linkage.

use super::{Drive, Step, Story, Walk, device, score, walk};
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_plant::model::{Fragment, Model};
use std::path::Path;

pub(crate) const STUDY: Study = Study {
    name: "paper_002",
    about: "a force-reflecting master told blind: linear chain to dry friction and a hysteretic linkage",
    needs: ("", &[]),
    run,
};

const PAPER: &str = "Kuchenbecker & Niemeyer 2005";
const FRICTION: &[&str] = &["coulomb", "stribeck", "asymmetric_coulomb", "dahl", "lugre", "friction_deficit"];

/// The paper's order: motor, drum, linkage. The hand holds still, so it is ground here.
const STEPS: &[Step] = &[
    Step { paper: "Coulomb friction at the motor, 0.044 N", accept: FRICTION, places: &[["motor", "ground"]] },
    Step { paper: "Coulomb friction at the drum, 0.1 N", accept: FRICTION, places: &[["drum", "ground"], ["drum", "grip.hand"]] },
    Step {
        paper: "hysteretic stiffness of the linkage",
        accept: &["hysteretic_spring", "bouc_wen", "maxwell_slip"],
        places: &[["drum", "handle"]],
    },
];

/// The model in a comfortable grasp, which holds still.
fn held(name: &str) -> Result<Model, StudyError> {
    let mut model = Model::load(&device(name))?;
    let grip = Fragment::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant/grips/normal.toml"))?;
    let user = model.axes.first().map_or(0, |axis| axis.user);
    model.attach(&grip, user, "grip");
    model.axes.clear();
    Ok(model)
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let first = held("impulse-engine-linear.toml")?;
    let mut truth = held("impulse-engine.toml")?;
    for output in &mut truth.outputs {
        // m, of the current and the encoder's interpolation together: a quarter of the encoder's step.
        output.noise = 5e-7;
    }
    // Slow and large, both ways; the same sweep at two magnitudes; held out: impacts, as the paper verifies, and a larger sweep.
    let drives = [
        Drive {
            name: "slow",
            held_out: false,
            inputs: ["triangle:amplitude=3,period=1,cycles=2,nested=2,inner=0.3", ""].map(String::from).to_vec(),
        },
        Drive {
            name: "sweep-small",
            held_out: false,
            inputs: ["sweep:amplitude=0.6,from=2,to=400,duration=1.5", ""].map(String::from).to_vec(),
        },
        Drive {
            name: "sweep-large",
            held_out: false,
            inputs: ["sweep:amplitude=3,from=2,to=400,duration=1.5", ""].map(String::from).to_vec(),
        },
        Drive {
            name: "impacts",
            held_out: true,
            inputs: ["impacts:amplitude=1/3/5,width=0.008,interval=0.2,count=1,bounces=2", ""].map(String::from).to_vec(),
        },
        Drive {
            name: "sweep-middle",
            held_out: true,
            inputs: ["sweep:amplitude=1.8,from=2,to=300,duration=1", ""].map(String::from).to_vec(),
        },
    ];
    let story = Story { truth, first: &first, rate: 2500.0, drives: &drives, steps: STEPS };
    story.record(context.out)?;
    let mut report = Report::new("Paper 002, told blind: linear master, held in a comfortable grasp");
    let (effects, effort): (&[usize], _) = if context.quick { (&[1], 2.5) } else { (&[1, 3], 5.0) };
    let walked = walk(&mut report, context, &Walk { effects, again: if context.quick { 0 } else { 2 }, effort })?;
    score(&mut report, context.out, PAPER, &walked)?;
    Ok(report)
}
