//! Paper 001, the steering compensator: from the linear design to friction with parasitic damping, then backlash; and what leaving the
//! backlash out does to the stiffness.

use super::{Drive, SET, Step, Story, Walk, device, score, told, walk};
use crate::run::{Ask, diagnose, parameter, refit, refitted, write};
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_diagnosis::verdict::MODEL_FILE;
use backdrive_plant::model::Model;
use std::path::Path;

pub(crate) const STUDY: Study = Study {
    name: "paper_001",
    about: "an inerter told blind: linear design to friction and backlash, and the stiffness that was biased without it",
    needs: ("", &[]),
    run,
};

const PAPER: &str = "Papageorgiou et al. 2007";
/// The folder of the set with half the strokes.
const HALF: &str = "half";
const STIFFNESS: &str = "elements.gearbox.stiffness";

const STEPS: &[Step] = &[
    Step {
        paper: "dry friction, 18.7 N at rest and 16.4 N in motion",
        accept: &["coulomb", "stribeck", "asymmetric_coulomb", "dahl", "lugre", "maxwell_slip", "friction_deficit"],
        places: &[["disc", "ground"]],
    },
    Step {
        paper: "parasitic damping, 1397 N s/m",
        accept: &["damper", "asymmetric_damper"],
        places: &[["disc", "ground"], ["flywheel", "ground"]],
    },
    Step { paper: "backlash, 0.336 mm", accept: &["backlash"], places: &[["ram", "disc"]] },
];

// With c1 between disc and ground, the force on the disc is that of b1, c1, and c in series with b. A damper d between flywheel and ground gives the
// same one at every frequency with c' = c + c1, b' = b (c'/c)^2, d = c' c1/c: no measurement at the ram distinguishes them.

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
    // The rig's band, 0.1 to 35 Hz, at strokes that are chosen; held out are the frequencies whose time plots the paper shows.
    let drives = |[large, middle, small]: [&str; 3], [slow, fast, faster]: [&str; 3]| {
        let sweep =
            |name, stroke: &str, rest: &str| Drive { name, held_out: false, inputs: vec![format!("sweep:amplitude={stroke},{rest}")] };
        let sine =
            |name, stroke: &str, rest: &str| Drive { name, held_out: true, inputs: vec![format!("sines:amplitude={stroke},{rest}")] };
        [
            sweep("large", large, "from=4,to=0.1,duration=20,fade_in=0.5,fade_out=0.5"),
            sweep("middle", middle, "from=12,to=0.5,duration=6,fade_in=0.2,fade_out=0.2"),
            sweep("small", small, "from=35,to=3,duration=4,fade_in=0.1,fade_out=0.1"),
            sine("sine-0.1", large, "frequency=0.1,cycles=1,fade_in=0.5"),
            sine("sine-3.2", slow, "frequency=3.24,cycles=6,fade_in=0.1"),
            sine("sine-8", fast, "frequency=8.09,cycles=10,fade_in=0.1"),
            sine("sine-20", faster, "frequency=20.21,cycles=20,fade_in=0.1"),
        ]
    };
    let (whole, half) = (
        drives(["0.004", "0.002", "0.001"], ["0.002", "0.0015", "0.001"]),
        drives(["0.002", "0.001", "0.0005"], ["0.001", "0.001", "0.0005"]),
    );
    let shorter = context.out.join(HALF);
    Story { truth: truth.clone(), first: &first, rate: 500.0, drives: &half, steps: &[] }.record(&shorter)?;
    Story { truth, first: &first, rate: 500.0, drives: &whole, steps: STEPS }.record(context.out)?;
    let mut report = Report::new("Paper 001, told blind: the linear design of the compensator");
    let (effects, effort): (&[usize], _) = if context.quick { (&[3], 2.5) } else { (&[1, 3], 10.0) };
    let walked = walk(&mut report, context, &Walk { effects, again: if context.quick { 0 } else { 1 }, effort })?;
    parasitic(&mut report, &context.out.join(&walked.best).join(MODEL_FILE))?;
    let found = Model::load(&context.out.join(&walked.best).join(MODEL_FILE))?;
    bias(&mut report, &first, &found, context, "4, 2 and 1 mm")?;
    bias(&mut report, &first, &found, &Context { out: &shorter, ..*context }, "2, 1 and 0.5 mm")?;
    between(&mut report, &Context { out: &shorter, ..*context })?;
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

/// The paper's model between, handed over as the first one: its next step is the backlash.
fn between(report: &mut Report, outer: &Context) -> Result<(), StudyError> {
    let out = outer.out;
    let set = out.join(SET);
    let here = Context { folder: &set, data: &set, out, quick: false, longer: outer.longer };
    let ask = Ask { name: "from-friction", set: "set.toml", model: "friction.toml", without: &[], effects: 1, effort: 2.5 };
    let verdict = diagnose(&here, &ask)?.verdict;
    told(report, "from-friction", &verdict);
    for (what, key, published) in [("gap", "gap", "3.36e-4 m"), ("stiffness", "stiffness", "861000 N/m")] {
        if let Some((value, [low, high])) = parameter(&verdict, "backlash", key) {
            let measured = format!("{value:.4e} (95 %: {low:.4e} to {high:.4e})");
            report.line(&format!("from-friction, {what}"), measured, published, PAPER, None);
            report.figure(&format!("from-friction {what}"), value);
        }
    }
    Ok(())
}

/// The stiffness of the paper's model between, with friction and parasitic damping but without backlash, fitted to the set in `out`, beside the
/// found one's.
fn bias(report: &mut Report, first: &Model, found: &Model, outer: &Context, strokes: &str) -> Result<(), StudyError> {
    let out = outer.out;
    let set = out.join(SET);
    let friction = "\n[[elements]]\nname = \"friction\"\nkind = \"coulomb\"\nbetween = [\"disc\", \"ground\"]\nforce = 17.0\n\
                    \n[[elements]]\nname = \"parasitic_damping\"\nkind = \"damper\"\nbetween = [\"disc\", \"ground\"]\ndamping = 1000.0\n";
    write(&set.join("friction.toml"), &format!("{}{friction}", first.to_toml()))?;
    let here = Context { folder: &set, data: &set, out, quick: false, longer: outer.longer };
    let ask = Ask { name: "without-backlash", set: "set.toml", model: "friction.toml", without: &[], effects: 1, effort: 2.5 };
    let fitted = refit(&here, &ask)?;
    let without = refitted(&fitted, STIFFNESS);
    let with = found.values_at(STIFFNESS).ok().and_then(|v| v.first().copied()).unwrap_or(f64::NAN);
    let low = 100.0 * (1.0 - without / with);
    let shown = |value: f64| format!("{:.0} kN/m", 1e-3 * value);
    report.line(&format!("stiffness, strokes {strokes}, friction without backlash"), shown(without), "563 kN/m", PAPER, None);
    report.line("what the tool says of that fit", fitted.per_record.sentence(), "", "", None);
    report.line("stiffness, found model", shown(with), "861 kN/m", PAPER, Some((with / 861e3 - 1.0).abs() < 0.03));
    report.line("bias by leaving the backlash out", format!("{low:.0} % low"), "35 % low", PAPER, None);
    for (name, value) in [("stiffness without", without), ("stiffness with", with), ("bias", low)] {
        report.figure(&format!("{name}, {strokes}"), value);
    }
    Ok(())
}
