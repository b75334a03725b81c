//! Tables of an arm: findings, joints, inertial parameters, what was tried, logs.

use crate::parts::{file_name, sentence};
use backdrive_answers::sentences::{alternatives, confidence, parameters};
use backdrive_diagnosis::arms::diagnose::Tried;
use backdrive_diagnosis::arms::judge::AGAINST;
use backdrive_diagnosis::arms::problem::Problem;
use backdrive_diagnosis::arms::sentences::{unexplained, words};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::verdict::words as said;
use backdrive_diagnosis::verdict::{Interval, Verdict};
use backdrive_report::{Cell, Page, Table, Tone, number, percent, si};

/// Rows of what was tried that are shown at once.
const SHOWN: usize = 15;

/// What is claimed.
pub(super) fn findings(page: &mut Page, verdict: &Verdict) {
    let all = &verdict.findings;
    if all.is_empty() {
        return;
    }
    let replacing = all.iter().any(|f| !f.replaces.is_empty());
    let mut headers = vec!["missing", "where", "parameters"];
    headers.extend(replacing.then_some("in place of"));
    headers.extend(["confidence", "alternatives"]);
    let simulated = all.iter().any(|f| f.closed_loop.is_some());
    headers.extend(simulated.then_some("closed loop: correction with it, of that without"));
    let mut table = Table::new(headers);
    for finding in all {
        let sure = if finding.confidence > 0.8 { Tone::Good } else { Tone::Unsure };
        let others = alternatives(finding, words);
        let mut row = vec![Cell::from(words(&finding.physics)), said::place(&finding.place).into(), parameters(finding).join("; ").into()];
        row.extend(replacing.then(|| Cell::from(finding.replaces.join(", "))));
        row.extend([Cell::tone(confidence(finding), sure), others.join("; ").into()]);
        let tone = |ratio: f64| if ratio > AGAINST { Tone::Unsure } else { Tone::Good };
        row.extend(simulated.then(|| finding.closed_loop.map_or(Cell::from("–"), |ratio| Cell::tone(percent(ratio), tone(ratio)))));
        table.push(row);
    }
    page.table(table);
}

/// What remains at each joint, in numbers.
pub(super) fn joints(page: &mut Page, verdict: &Verdict) {
    let Some(arm) = &verdict.arm else { return };
    let headers = [
        "joint",
        "rms torque",
        "as given",
        "refitted",
        "diagnosed",
        "while it moves",
        "noise alone",
        "closed loop, refitted",
        "closed loop, diagnosed",
    ];
    let mut table = Table::new(headers);
    let share = |x: Option<f64>| x.map_or("–".to_string(), percent);
    for j in &arm.joints {
        let tone = if j.shows.is_some() { Tone::Bad } else { Tone::Neutral };
        table.push([
            Cell::from(j.joint.clone()),
            number(j.torque_rms).into(),
            percent(j.as_given).into(),
            percent(j.refit).into(),
            percent(j.diagnosed).into(),
            Cell::tone(share(j.moving), tone),
            share(j.noise).into(),
            share(j.loop_refit).into(),
            share(j.loop_diagnosed).into(),
        ]);
    }
    page.table(table.caption(
        "Shares of the rms torque (N m, N of a joint that slides). At rest dry friction is undetermined between its levels, so the \
         residual of the diagnosed model is also given for the time in motion.",
    ));
    for open in arm.joints.iter().filter_map(unexplained) {
        page.text(&sentence(&format!("not explained: {open}")));
    }
}

fn interval(ci95: &Interval) -> String {
    match ci95 {
        [Some(low), Some(high)] => format!("{} to {}", number(*low), number(*high)),
        _ => "not determined".to_string(),
    }
}

/// The combinations of inertial parameters that the arm can show.
pub(super) fn base_parameters(page: &mut Page, verdict: &Verdict) {
    let Some(arm) = &verdict.arm else { return };
    let mut table = Table::new(["base parameter", "unit", "nominal", "fitted", "95 % interval"]);
    for base in &arm.base_parameters {
        let holds = matches!(base.ci95, [Some(low), Some(high)] if low <= base.nominal && base.nominal <= high);
        table.push([
            Cell::from(base.name.clone()),
            base.unit.clone().into(),
            number(base.nominal).into(),
            Cell::tone(number(base.value), if holds { Tone::Neutral } else { Tone::Warning }),
            interval(&base.ci95).into(),
        ]);
    }
    page.table(table.caption(
        "m, mx, Ixx, ... with the number of the joint: mass, mass times centre, inertia about the joint's frame. Marked if the interval \
         does not contain the file's value.",
    ));
}

/// Numbers of the model that moved beyond their interval.
pub(super) fn moved(page: &mut Page, verdict: &Verdict) {
    if verdict.parameters.is_empty() {
        page.text("No parameter of the model changed beyond its interval.");
        return;
    }
    let mut table = Table::new(["parameter of the model", "nominal", "fitted", "95 % interval", "moved, in sd"]);
    for (name, moved) in &verdict.parameters {
        let sd = moved.moved_sd.map_or("–".to_string(), number);
        table.push([name.clone(), number(moved.nominal), number(moved.value), interval(&moved.ci95), sd]);
    }
    page.table(table.caption("Parameters of the model that changed beyond their interval, besides the findings."));
}

/// What the search fitted in full.
pub(super) fn tried(page: &mut Page, tried: &[Tried]) {
    if tried.is_empty() {
        page.text("No effect promised enough improvement of the nominal model to be fitted in full.");
        return;
    }
    let mut all: Vec<&Tried> = tried.iter().collect();
    all.sort_by(|a, b| b.taken.cmp(&a.taken).then(b.worth.total_cmp(&a.worth)));
    let table = |part: &[&Tried]| {
        let mut table = Table::new(["physics", "where", "worth", "held-out segments, in sd", ""]);
        for one in part {
            table.push([
                Cell::from(words(&one.physics)),
                said::place(&one.place).into(),
                number(one.worth).into(),
                one.unseen.map_or("–".to_string(), number).into(),
                if one.taken { Cell::tone("accepted in its round", Tone::Good) } else { Cell::from("not accepted") },
            ]);
        }
        table.caption(
            "Worth: increase of twice the log evidence; more than 10 is required. Held-out segments: improvement of their prediction. An \
             accepted effect can be exchanged or removed later.",
        )
    };
    let (first, rest) = all.split_at(all.len().min(SHOWN));
    page.table(table(first));
    if !rest.is_empty() {
        page.details(&format!("The other {}", rest.len()), |inside| {
            inside.table(table(rest));
        });
    }
}

/// The logs, and what they say of themselves.
pub(super) fn audit(page: &mut Page, problem: &Problem, verdict: &Verdict) {
    let mut files = Table::new(["log", "samples", "rate", "length", "used for"]);
    for (logs, use_) in [(&problem.fit, "fits"), (&problem.held_out, "held out")] {
        for log in logs {
            let length = log.t.last().unwrap_or(&0.0) - log.t.first().unwrap_or(&0.0);
            let rate = if length > 0.0 { si((log.t.len() - 1) as f64 / length, "Hz") } else { "–".to_string() };
            files.push([file_name(&log.name).to_string(), log.t.len().to_string(), rate, si(length, "s"), use_.to_string()]);
        }
    }
    page.table(files);
    if verdict.audit.is_empty() {
        page.text(
            "The logs were checked for units, signs, swapped columns, recorded velocities that are not derivatives, and constant \
            loads: no problem was found.",
        );
        return;
    }
    let mut table = Table::new(["checked", "where", "seen", "weight"]);
    for remark in &verdict.audit {
        let (word, tone) = match remark.weight {
            Weight::Note => ("note", Tone::Neutral),
            Weight::Caution => ("caution", Tone::Warning),
            Weight::Unusable => ("unusable", Tone::Bad),
        };
        table.push([Cell::from(remark.what.clone()), remark.place.clone().into(), remark.message.clone().into(), Cell::tone(word, tone)]);
    }
    page.table(table);
}
