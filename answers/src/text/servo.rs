//! What a diagnosis of servo joints prints.

use crate::sentences::{alternatives, described, estimate};
use backdrive_report::number;
use backdrive_servo::diagnose::Found;
use backdrive_servo::problem::Problem;
use backdrive_servo::sentences::words;
use std::fmt::Write as _;

/// What was found, for a terminal.
pub(crate) fn text(problem: &Problem, found: &Found) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let verdict = &found.verdict;
    let held = problem.joints.first().map_or(0, |j| j.held_out.len());
    let all = problem.joints.first().map_or(0, |j| j.fit.len()) + held;
    line("logs", format!("{all}, {held} of them held out; commands and positions of {} joints, no torque", problem.joints.len()));
    for remark in &verdict.audit {
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
    let Some(servo) = &verdict.servo else { return out };
    for joint in &servo.joints {
        let e = &joint.errors;
        let share = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.3}"));
        line(
            &joint.joint,
            format!(
                "free run from the command: nrmse {} diagnosed, {} with delay and second order, {} for the command itself; mean error {} \
                    mrad diagnosed, {} and {}",
                share(e.diagnosed),
                share(e.refit),
                share(e.command),
                number(1e3 * e.diagnosed_mae),
                number(1e3 * e.refit_mae),
                number(1e3 * e.command_mae)
            ),
        );
        if let Some(gain) = &joint.gain {
            line("", format!("proportional gain {}", estimate(gain)));
        }
    }
    line("scale", servo.scale.clone());
    let mut listed: Vec<&str> = Vec::new();
    for shared in servo.joints.iter().flat_map(|j| &j.shared) {
        if !listed.contains(&shared.sentence.as_str()) {
            listed.push(&shared.sentence);
            let joints: Vec<&str> =
                servo.joints.iter().filter(|j| j.shared.iter().any(|s| s.sentence == shared.sentence)).map(|j| j.joint.as_str()).collect();
            line("open", format!("{}: {}; to separate them, {}", joints.join(", "), shared.sentence, shared.separated_by));
        }
    }
    for note in &found.notes {
        line("note", note.clone());
    }
    out.trim_end().to_string()
}

fn looked_at(adds: &[&str], drops: Option<&str>) -> String {
    let adds: Vec<String> = adds.iter().map(|name| words(name)).collect();
    format!("{}{}", adds.join(" and "), drops.map_or(String::new(), |d| format!(" instead of {}", words(d))))
}

/// What the search looked at, joint by joint.
pub(crate) fn explained(problem: &Problem, found: &Found) -> String {
    let mut out = format!("{:<20} {:<58} {:>10} {:>12}  accepted", "joint", "effect", "lowers", "held out, sd");
    for answer in &found.answers {
        for tried in &answer.found.tried {
            let unseen = tried.gain.map_or("-".to_string(), |g| format!("{:.1}", g.in_errors()));
            let _ = write!(
                out,
                "\n{:<20} {:<58} {:>8.1} % {unseen:>12}  {}",
                problem.joints[answer.joint].name,
                looked_at(&tried.adds, tried.drops),
                100.0 * tried.lowers,
                if tried.taken { "yes" } else { "no" }
            );
        }
    }
    out += "\nlowers: the share by which it lowers the mean loss on held-out recordings; held out: that gain in its standard errors";
    out
}
