//! What a diagnosis of an arm prints.

use crate::sentences::{alternatives, described};
use backdrive_diagnosis::arms::diagnose::{Found, Tried};
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::sentences::{unexplained, words};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::verdict::Word;
use backdrive_diagnosis::verdict::words as said;
use backdrive_plant::robot::JointKind;
use backdrive_report::number;
use std::fmt::Write as _;

/// What was found, for a terminal.
pub(crate) fn text(problem: &Problem, found: &Found) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let verdict = &found.verdict;
    let all = problem.fit.len() + problem.held_out.len();
    line("logs", format!("{all}, {} of them held out; {} joints", problem.held_out.len(), problem.joints.len()));
    for remark in verdict.audit.iter().filter(|r| r.weight > Weight::Note) {
        line("", format!("{}: {}", remark.place, remark.message));
    }
    line("verdict", format!("{}: {}", verdict.word.spoken().to_uppercase(), verdict.sentence));
    for finding in &verdict.findings {
        line("found", described(finding, words));
        let others = alternatives(finding, words);
        if !others.is_empty() {
            line("", format!("or instead {}", others.join(", ")));
        }
    }
    if let Some(arm) = &verdict.arm {
        for (joint, coordinate) in arm.joints.iter().zip(problem.tree.coordinates()) {
            let unit = if coordinate.kind == JointKind::Revolute { "N m" } else { "N" };
            let in_loop = match (joint.loop_refit, joint.loop_diagnosed) {
                (Some(before), Some(after)) => format!("; in closed loop {:.1} % and {:.1} %", 100.0 * before, 100.0 * after),
                _ => String::new(),
            };
            line(
                &joint.joint,
                format!(
                    "of its torque (rms {} {unit}) remain unexplained: {:.1} % as given, {:.1} % refitted, {:.1} % diagnosed{in_loop}",
                    number(joint.torque_rms),
                    100.0 * joint.as_given,
                    100.0 * joint.refit,
                    100.0 * joint.diagnosed
                ),
            );
        }
    }
    // Where nothing else is claimed the sentence states it.
    let beside = verdict.arm.iter().filter(|_| verdict.word != Word::Unexplained);
    for joint in beside.flat_map(|arm| &arm.joints) {
        if let Some(open) = unexplained(joint) {
            line("remains", open);
        }
    }
    if let Some(next) = &verdict.next_experiment {
        line("next", next.sentence().to_string());
    }
    for note in &found.notes {
        line("note", note.clone());
    }
    out.trim_end().to_string()
}

/// What the search fitted in full, round by round.
pub(crate) fn explained(tried: &[Tried]) -> String {
    let mut out = format!("{:<64} {:>12} {:>12}  accepted", "fitted", "worth", "held out, sd");
    for one in tried {
        let name = format!("{} {}", words(&one.physics), said::place(&one.place));
        let unseen = one.unseen.map_or("-".to_string(), |u| format!("{u:.1}"));
        let _ = write!(out, "\n{name:<64} {:>12.1} {unseen:>12}  {}", one.worth, if one.taken { "yes" } else { "no" });
    }
    out += "\nworth: rise of twice the log evidence, more than 10 is claimed; held out: improvement of the prediction of held-out segments";
    out
}
