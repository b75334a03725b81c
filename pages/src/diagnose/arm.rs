//! The report on an arm.

use super::about::About;
use super::phrases::tone;
use super::{arm_figures as figures, arm_tables as tables};
use crate::parts::{ending, sentence, todo};
use backdrive_diagnosis::arms::diagnose::Found;
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::verdict::Verdict;
use backdrive_report::{Page, percent};

/// The report.
pub(super) fn page(problem: &Problem, found: &Found, about: &About) -> Page {
    let About { name, notes, steps } = about;
    let verdict = &found.verdict;
    let held = !problem.held_out.is_empty();
    let mut page = Page::new(&format!("Diagnosis of {name} against {}", problem.model.name));
    page.lead(tone(verdict.word), &sentence(&verdict.sentence));
    page.text(&summary(verdict, held));
    todo(&mut page, steps);
    for note in *notes {
        page.note(&sentence(note));
    }
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&sentence(&format!("{}: {}", remark.place, remark.message)));
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
