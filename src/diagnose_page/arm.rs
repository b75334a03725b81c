//! The report of `backdrive diagnose` on an arm: pictures first, the numbers beside them.

use super::phrases::{capital, tone};
use super::{arm_figures as figures, arm_tables as tables};
use crate::offered::{Offered, Step};
use crate::page_parts::{ending, todo};
use backdrive_arms::diagnose::Found;
use backdrive_arms::problem::Problem;
use backdrive_arms::said::unexplained;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::verdict::{MODEL_FILE, Verdict, Word};
use backdrive_report::{Page, percent};
use std::path::Path;

/// What a report shows.
pub struct Shown<'a> {
    /// The model and its logs.
    pub problem: &'a Problem,
    /// What was found.
    pub found: &'a Found,
    /// The set, for the title.
    pub name: &'a str,
    /// What a reader should know first.
    pub notes: &'a [String],
    /// The folder of the model that was written.
    pub out: &'a Path,
}

/// The report.
pub fn page(shown: &Shown) -> Page {
    let Shown { problem, found, name, notes, out } = shown;
    let verdict = &found.verdict;
    let held = !problem.held_out.is_empty();
    let mut page = Page::new(&format!("Diagnosis of {name} against {}", problem.model.name));
    page.lead(tone(verdict.word), &capital(&verdict.sentence));
    page.text(&summary(verdict, held));
    todo(&mut page, &to_do(verdict, out));
    for note in *notes {
        page.note(&capital(note));
    }
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&capital(&format!("{}: {}", remark.place, remark.message)));
    }
    tables::findings(&mut page, verdict);
    page.section("What remains of each joint's torque");
    figures::remaining(&mut page, verdict, held);
    tables::joints(&mut page, verdict);
    page.section(if held { "Torque on a log that no fit has seen" } else { "Torque on a log, as fitted" });
    figures::torque(&mut page, &found.drawn);
    page.section("Friction of each joint");
    figures::friction(&mut page, &found.drawn);
    page.section("Inertial parameters");
    tables::base_parameters(&mut page, verdict);
    tables::moved(&mut page, verdict);
    page.section("What to record next");
    figures::next(&mut page, verdict, &found.drawn);
    page.section("What was tried");
    tables::tried(&mut page, &found.tried);
    page.section("The logs themselves");
    tables::audit(&mut page, problem, verdict);
    ending(&mut page, &TERMS);
    page
}

/// The terms of the page.
const TERMS: [(&str, &str); 8] = [
    ("torque", "of the motor, seen at the joint; of a joint that slides its force"),
    ("residual", "measured torque less what a model takes for the measured motion, both through the same filter without delay"),
    ("as given", "the model's file, unchanged"),
    ("refitted", "the same structure, its inertial parameters and numbers of friction fitted to the logs"),
    ("diagnosed", "the structure with the physics that was found, all numbers fitted"),
    ("held out", "a log that no fit has seen"),
    (
        "closed loop",
        "the model simulated with the measured torque, and a loop that adds what it takes to keep the measured motion: the share is what it added",
    ),
    ("base parameter", "a combination of masses, centres and inertias that the torque of this arm can show; other combinations it cannot"),
];

/// How far the torque is explained, in all.
fn summary(verdict: &Verdict, held: bool) -> String {
    let Some(arm) = &verdict.arm else { return String::new() };
    let on = if held { "held-out logs" } else { "fitted logs" };
    let joints: Vec<String> = arm
        .joints
        .iter()
        .map(|j| {
            let noise = j.noise.map_or(String::new(), |n| format!(" (noise alone {})", percent(n)));
            format!(
                "{}: {} as given, {} refitted, {} diagnosed{noise}",
                j.joint,
                percent(j.as_given),
                percent(j.refit),
                percent(j.diagnosed)
            )
        })
        .collect();
    format!(
        "Of the rms torque on the {on} remain at {}. Torque and models were compared below {} Hz.",
        joints.join("; at "),
        backdrive_report::number(arm.corner_hz)
    )
}

/// What to do now, most useful first, with commands to copy.
pub fn to_do(verdict: &Verdict, out: &Path) -> Vec<Step> {
    let mut steps = Vec::new();
    let model = out.join(MODEL_FILE);
    let (name, export) = (model.display(), Offered::verb("export").reads(&model).option("--to", "urdf"));
    let use_it = || [export.option_writes("--out", Path::new("arm.diagnosed.urdf")).build()];
    match verdict.word {
        Word::Missing | Word::Parameters => steps.push(Step::new(
            format!("Use {name}, such as in a feed-forward or a simulation; this writes it for other programs:"),
            use_it(),
        )),
        Word::Ambiguous => steps.push(Step::new(
            format!("{name} may be used, but the physics named first could be another one: see the table below."),
            use_it(),
        )),
        Word::NothingMissing => steps.push(Step::said("Keep the model: the logs ask for nothing more.")),
        Word::Unexplained => steps.push(Step::said(
            "Do not build on a law yet: look below at when and where the residual shows, and check the sensors of the joints named there first.",
        )),
        Word::CannotTell => {}
    }
    if verdict.word != Word::Unexplained {
        for joint in verdict.arm.iter().flat_map(|a| &a.joints) {
            if let Some(open) = unexplained(joint) {
                steps.push(Step::said(format!("Look at what is left over {open}.")));
            }
        }
    }
    if let Some(next) = &verdict.next_experiment {
        steps.push(Step::said(format!("Record next: {}", next.sentence())));
    }
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note).take(2) {
        steps.push(Step::said(format!("Check this signal: {}: {}", remark.place, remark.message)));
    }
    steps
}
