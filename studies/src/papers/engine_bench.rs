//! Paper 003, the engine test bench: from a linear shaft to what a seed hides in it. The paper's own constants are lost.

use super::{Drive, Step, Story, Walk, device, score, walk};
use crate::run::read;
use crate::table::Report;
use crate::{Context, Study, StudyError};
use backdrive_plant::model::Model;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

pub(crate) const STUDY: Study = Study {
    name: "paper_003",
    about: "an engine test bench told blind: a linear shaft, and what a seed hides in it",
    needs: ("", &[]),
    run,
};

const PAPER: &str = "drawn; the bench's own constants are lost";
const FILE: &str = "engine-test-bench.toml";
/// Seeds of the whole study; the short part takes the first one.
const SEEDS: [u64; 4] = [1, 2, 3, 4];

/// What may be hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hidden {
    Stiffening,
    Gap,
    EngineFriction,
    DynoFriction,
}

const KINDS: [Hidden; 4] = [Hidden::Stiffening, Hidden::Gap, Hidden::EngineFriction, Hidden::DynoFriction];

/// Numbers in 0..1 from a seed (SplitMix64).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// What each kind is called where it is found.
fn steps(hidden: Hidden) -> [Step; 1] {
    const FRICTION: &[&str] = &["coulomb", "stribeck", "asymmetric_coulomb", "dahl", "lugre", "friction_deficit", "maxwell_slip"];
    let (paper, accept, places): (_, &'static [&'static str], &'static [[&'static str; 2]]) = match hidden {
        Hidden::Stiffening => ("the shaft stiffens", &["cubic_spring"], &[["engine", "dyno"]]),
        Hidden::Gap => ("the shaft has a gap", &["backlash"], &[["engine", "dyno"]]),
        Hidden::EngineFriction => ("the engine rubs", FRICTION, &[["engine", "ground"]]),
        Hidden::DynoFriction => ("the machine rubs", FRICTION, &[["dyno", "ground"]]),
    };
    [Step { paper, accept, places }]
}

/// The bench with what a seed hides in it.
fn bench(seed: u64) -> Result<(Model, Hidden), StudyError> {
    let mut draw = Draw(seed);
    let hidden = KINDS[((KINDS.len() as f64 * draw.next()) as usize).min(KINDS.len() - 1)];
    let wrong = |what: &str| StudyError::File(format!("{FILE}: {what}"));
    let mut document: DocumentMut = read(&device(FILE))?.parse().map_err(|e| wrong(&format!("{e}")))?;
    let elements: &mut ArrayOfTables =
        document.get_mut("elements").and_then(Item::as_array_of_tables_mut).ok_or_else(|| wrong("there are no elements"))?;
    let shaft =
        elements.iter_mut().find(|e| e.get("name").and_then(Item::as_str) == Some("shaft")).ok_or_else(|| wrong("there is no shaft"))?;
    match hidden {
        Hidden::Stiffening => {
            // N m/rad^3: a fifth to a half more at the 5 mrad of the drive.
            shaft["kind"] = value("cubic_spring");
            shaft["cubic"] = value(2.0e4 * draw.between(0.2, 0.5) / 5e-3_f64.powi(2));
        }
        Hidden::Gap => {
            // rad: of worn spline couplings, on both sides together.
            shaft["kind"] = value("backlash");
            shaft["gap"] = value(draw.between(2e-3, 5e-3));
            shaft["damping"] = value(12.0);
            // The gap replaces the damper too.
            elements.retain(|e| e.get("name").and_then(Item::as_str) != Some("shaft_damping"));
            for output in document.get_mut("outputs").and_then(Item::as_array_of_tables_mut).into_iter().flat_map(|t| t.iter_mut()) {
                if output.contains_key("element") {
                    output["element"] = value("shaft");
                }
            }
        }
        Hidden::EngineFriction | Hidden::DynoFriction => {
            let body = if hidden == Hidden::EngineFriction { "engine" } else { "dyno" };
            let mut friction = Table::new();
            friction["name"] = value("friction");
            friction["kind"] = value("coulomb");
            friction["between"] = value(toml_edit::Array::from_iter([body, "ground"]));
            // N m: of the 600 N m that the map reaches, a hundredth to a fortieth.
            friction["force"] = value(draw.between(6.0, 15.0));
            elements.push(friction);
        }
    }
    let mut model = Model::from_toml(&document.to_string(), FILE)?;
    for output in &mut model.outputs {
        // rad/s, N m and rad of the bench's own sensors.
        output.noise = match output.name.as_str() {
            "shaft_torque" => 0.5,
            "dyno_angle" => 1e-4,
            _ => 0.01,
        };
    }
    model.axes.clear();
    Ok((model, hidden))
}

fn run(context: &Context) -> Result<Report, StudyError> {
    let mut first = Model::load(&device(FILE))?;
    first.axes.clear();
    let mut report = Report::new("Paper 003, told blind: a linear shaft");
    // The two machines against each other about standstill, below and above the torsional mode of 36 Hz; held out: another draw of phases, and slow.
    let drives = [
        Drive {
            name: "broad",
            held_out: false,
            inputs: ["multisine:rms=60,from=1,to=80,period=2,periods=1,seed=1", "multisine:rms=60,from=1,to=80,period=2,periods=1,seed=2"]
                .map(String::from)
                .to_vec(),
        },
        Drive { name: "sweep", held_out: false, inputs: ["sweep:amplitude=100,from=1,to=60,duration=3", ""].map(String::from).to_vec() },
        Drive {
            name: "broad-other",
            held_out: true,
            inputs: ["multisine:rms=50,from=1,to=80,period=2,periods=1,seed=3", "multisine:rms=70,from=1,to=80,period=2,periods=1,seed=4"]
                .map(String::from)
                .to_vec(),
        },
    ];
    let seeds = if context.quick { &SEEDS[..1] } else { &SEEDS[..] };
    let mut hits = 0;
    for seed in seeds {
        let (truth, hidden) = bench(*seed)?;
        let out = context.out.join(format!("seed-{seed}"));
        let steps = steps(hidden);
        let story = Story { truth, first: &first, rate: 1000.0, drives: &drives, steps: &steps };
        story.record(&out)?;
        report.line(&format!("seed {seed}"), "", "", "", None);
        let walked = walk(
            &mut report,
            &Context { out: &out, ..*context },
            &Walk { effects: &[1], again: if context.quick { 0 } else { 1 }, effort: if context.quick { 1.25 } else { 3.1 } },
        )?;
        hits += score(&mut report, &out, PAPER, &walked)?;
    }
    report.figure("hits", hits as f64);
    report.figure("seeds", seeds.len() as f64);
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_hide_every_kind() {
        let drawn: Vec<Hidden> = (1..40).map(|seed| bench(seed).unwrap().1).collect();
        assert!(KINDS.iter().all(|kind| drawn.contains(kind)));
        assert_eq!(bench(3).unwrap(), bench(3).unwrap());
    }
}
