//! Paper 001, the steering compensator: from the linear design to friction with parasitic damping, then backlash; and what leaving the
//! backlash out does to the stiffness.

use super::{Drive, SET, Step, Story, Walk, device, score, walk};
use crate::run::{Ask, diagnose, diagnosed_model, said};
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive::diagnose::MODEL;
use backdrive_plant::model::Model;
use std::path::Path;

pub(crate) const STUDY: Study = Study {
    name: "paper_001",
    about: "an inerter told blind: linear design to friction and backlash, and the stiffness that was biased without it",
    needs: ("", &[]),
    run,
};

const PAPER: &str = "Papageorgiou et al. 2007";
const STIFFNESS: &str = "elements.gearbox.stiffness";

const STEPS: &[Step] = &[
    Step {
        paper: "dry friction, 18.7 N at rest and 16.4 N in motion",
        accept: &["coulomb", "stribeck", "asymmetric_coulomb", "dahl", "lugre", "maxwell_slip"],
        places: &[["disc", "ground"]],
    },
    Step {
        paper: "parasitic damping, 1397 N s/m",
        accept: &["damper", "asymmetric_damper"],
        places: &[["disc", "ground"], ["flywheel", "ground"]],
    },
    Step { paper: "backlash, 0.336 mm", accept: &["backlash"], places: &[["ram", "disc"]] },
];

// With c1 between disc and ground, the force on the disc is that of b1, c1, and c in series with b. A damper d between flywheel and ground gives
// the same one at every frequency with c' = c + c1, b' = b (c'/c)^2, d = c' c1/c: no measurement at the ram tells them apart.

/// A model whose only output is the force, as on the rig.
fn rig(name: &str) -> Result<Model, StudyError> {
    let mut model = Model::load(&device(name))?;
    model.outputs.retain(|output| output.name == "force");
    model.axes.clear();
    Ok(model)
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let first = rig("steering-compensator.toml")?;
    let mut truth = rig("steering-compensator-sae-40.toml")?;
    for output in &mut truth.outputs {
        // N, a load cell of some kN.
        output.noise = 1.0;
    }
    // The rig's band, 0.1 to 35 Hz, at three strokes; unseen are the frequencies whose time plots the paper shows.
    let drives = [
        Drive { name: "large", held_out: false, inputs: vec!["sweep:amplitude=0.004,from=4,to=0.1,duration=20,fade_in=0.5,fade_out=0.5"] },
        Drive { name: "middle", held_out: false, inputs: vec!["sweep:amplitude=0.002,from=12,to=0.5,duration=6,fade_in=0.2,fade_out=0.2"] },
        Drive { name: "small", held_out: false, inputs: vec!["sweep:amplitude=0.001,from=35,to=3,duration=4,fade_in=0.1,fade_out=0.1"] },
        Drive { name: "sine-0.1", held_out: true, inputs: vec!["sines:amplitude=0.004,frequency=0.1,cycles=1,fade_in=0.5"] },
        Drive { name: "sine-3.2", held_out: true, inputs: vec!["sines:amplitude=0.002,frequency=3.24,cycles=6,fade_in=0.1"] },
        Drive { name: "sine-8", held_out: true, inputs: vec!["sines:amplitude=0.0015,frequency=8.09,cycles=10,fade_in=0.1"] },
        Drive { name: "sine-20", held_out: true, inputs: vec!["sines:amplitude=0.001,frequency=20.21,cycles=20,fade_in=0.1"] },
    ];
    let story = Story { truth, first: &first, rate: 500.0, drives: &drives, steps: STEPS };
    story.record(context.out)?;
    let mut report = Report::new("Paper 001, told blind: the linear design of the compensator");
    let (effects, patience): (&[usize], _) = if context.quick { (&[3], 60.0) } else { (&[1, 3], 100.0) };
    let walked = walk(&mut report, context.out, &Walk { effects, again: if context.quick { 0 } else { 1 }, patience })?;
    parasitic(&mut report, &context.out.join(&walked.best).join(MODEL))?;
    if !context.quick {
        bias(&mut report, context)?;
    }
    score(&mut report, context.out, PAPER, &walked)?;
    Ok(report)
}

/// The damping of the oil and beside the parasitic inertance, of a found model that has the damper at either place.
fn parasitic(report: &mut Report, found: &Path) -> Result<(), StudyError> {
    let model = Model::load(found)?;
    let place = |name: &str| model.bodies.iter().position(|body| body.name == name);
    let damping = |between: [Option<usize>; 2]| -> f64 {
        let reversed = [between[1], between[0]];
        let all = model.elements.iter().filter(|e| e.between == between || e.between == reversed);
        all.filter_map(|e| model.values_at(&format!("elements.{}.damping", e.name)).ok()?.first().copied()).sum()
    };
    let (c, d) = (damping([place("disc"), place("flywheel")]), damping([place("flywheel"), None]));
    let oil = if d > 0.0 { c * c / (c + d) } else { c };
    let beside = damping([place("disc"), None]) + c - oil;
    for (what, value, published) in [("oil", oil, 6261.0), ("parasitic damping", beside, 1397.0)] {
        report.line(
            &format!("{what}, with the damper at disc-ground"),
            format!("{value:.0} N s/m"),
            format!("{published:.0} N s/m"),
            PAPER,
            None,
        );
        report.figure(what, value);
    }
    Ok(())
}

/// The stiffness where the backlash may not be named, and where it may.
fn bias(report: &mut Report, context: &Context) -> Result<(), StudyError> {
    let set = context.out.join(SET);
    let here = Context { folder: &set, data: &set, ..*context };
    let gaps: &[&str] = &["backlash", "contact", "hunt_crossley"];
    let mut values = Vec::new();
    for (name, without, published) in [("without-backlash", gaps, 563e3), ("with-backlash", &[], 861e3)] {
        let ask = Ask { name, set: "set.toml", model: "model.toml", without, effects: 3, patience: 100.0 };
        let found = diagnose(&here, &ask)?;
        let json = &found.said.json;
        let model = diagnosed_model(&here, &ask)?;
        let value = model.values_at(STIFFNESS).ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN);
        values.push(value);
        report.line(name, said(json), "", "", None);
        report.line(
            &format!("stiffness, {name}"),
            format!("{:.0} kN/m", 1e-3 * value),
            format!("{:.0} kN/m", 1e-3 * published),
            PAPER,
            None,
        );
        report.figure(&format!("stiffness {name}"), value);
        let moved = &json["parameters"][STIFFNESS];
        let note = format!("{} -> {}", moved["nominal"], moved["value"]);
        report.line(&format!("what the verdict {name} says of it"), note, "", "", None);
    }
    let [without, with] = [values[0], values[1]];
    let low = 100.0 * (1.0 - without / with);
    report.line(
        "stiffness biased low by leaving the backlash out",
        format!("{low:.0} %"),
        "35 % (563 of 861 kN/m)",
        PAPER,
        Some((10.0..=50.0).contains(&low) && (with / 861e3 - 1.0).abs() < 0.03),
    );
    report.figure("bias", low);
    Ok(())
}
