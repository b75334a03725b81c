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
    let mut page = Page::new(&format!("Diagnosis of {name} against the model {}", problem.model.name));
    page.lead(tone(verdict.word), &sentence(&verdict.sentence));
    todo(&mut page, steps);
    page.text(&summary(verdict, held));
    for note in *notes {
        page.note(&sentence(note));
    }
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&sentence(&format!("{}: {}", remark.place, remark.message)));
    }
    page.section("What remains of each joint's torque");
    figures::remaining(&mut page, verdict, held);
    tables::findings(&mut page, verdict);
    page.details("Shares of the torque of each joint", |inside| tables::joints(inside, verdict));
    page.section(if held { "Torque on a held-out log" } else { "Torque on a log, as fitted" });
    figures::torque(&mut page, &found.drawn);
    page.section("Friction of each joint");
    figures::friction(&mut page, &found.drawn);
    page.section("Next recording");
    figures::next(&mut page, verdict, &found.drawn);
    page.section("Details");
    page.details("Inertial parameters", |inside| {
        tables::base_parameters(inside, verdict);
        tables::moved(inside, verdict);
    });
    page.details("All hypotheses", |inside| tables::tried(inside, &found.tried));
    page.details("Checks of the logs", |inside| tables::audit(inside, problem, verdict));
    ending(&mut page, &TERMS);
    page
}

/// The terms of the page.
const TERMS: [(&str, &str); 8] = [
    ("torque", "of the motor, at the joint; for a sliding joint its force"),
    ("residual", "measured torque minus the model's torque for the measured motion, both through the same zero-phase filter"),
    ("as given", "the model's file, unchanged"),
    ("refitted", "the same structure, its inertial and friction parameters fitted to the logs"),
    ("diagnosed", "the structure with the effects found, all parameters fitted"),
    ("held out", "a log that no fit uses"),
    (
        "closed loop",
        "a simulation with the measured torque and a controller that keeps the measured motion; the share of torque that the controller \
            adds",
    ),
    (
        "base parameter",
        "a combination of masses, centres of mass and inertias that influences the torque of this arm; only such \
        combinations can be identified",
    ),
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
        "Unexplained share of the rms torque on the {on}: {}. Torque and models were compared below {} Hz.",
        joints.join("; at "),
        backdrive_report::number(arm.corner_hz)
    )
}
