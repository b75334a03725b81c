//! Tables of an arm: findings, joints, inertial parameters, what was tried, logs.

use crate::parts::{file_name, sentence};
use backdrive_answers::sentences::{confidence, parameters};
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
    let mut headers = vec!["missing", "where", "numbers"];
    headers.extend(replacing.then_some("in place of"));
    headers.extend(["confidence", "or instead"]);
    let simulated = all.iter().any(|f| f.closed_loop.is_some());
    headers.extend(simulated.then_some("closed loop: correction with it, of that without"));
    let mut table = Table::new(headers);
    for finding in all {
        let sure = if finding.confidence > 0.8 { Tone::Good } else { Tone::Unsure };
        let others: Vec<String> = finding
            .alternatives
            .iter()
            .take(3)
            .map(|a| format!("{} {} ({})", words(&a.physics), said::place(&a.place), said::share(a.confidence)))
            .collect();
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
        "Shares of the rms torque (N m, N of a joint that slides). At rest dry friction is anything between its levels, so what the diagnosed model leaves \
         is told for the time in which the joint moves, too.",
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
        "m, mx, Ixx, ... with the number of the joint: mass, mass times centre, inertia about the joint's frame. Marked where the interval does not hold the \
         file's value.",
    ));
}

/// Numbers of the model that moved beyond their interval.
pub(super) fn moved(page: &mut Page, verdict: &Verdict) {
    if verdict.parameters.is_empty() {
        page.text("No number of the model moved beyond its interval.");
        return;
    }
    let mut table = Table::new(["number of the model", "nominal", "fitted", "95 % interval", "moved, in sd"]);
    for (name, moved) in &verdict.parameters {
        let sd = moved.moved_sd.map_or("–".to_string(), number);
        table.push([name.clone(), number(moved.nominal), number(moved.value), interval(&moved.ci95), sd]);
    }
    page.table(table.caption("Numbers of the model that moved beyond their interval, beside what was found."));
}

/// What the search fitted in full.
pub(super) fn tried(page: &mut Page, tried: &[Tried]) {
    if tried.is_empty() {
        page.text("No physics promised enough beside the nominal model to be fitted in full.");
        return;
    }
    let mut all: Vec<&Tried> = tried.iter().collect();
    all.sort_by(|a, b| b.taken.cmp(&a.taken).then(b.worth.total_cmp(&a.worth)));
    let table = |part: &[&Tried]| {
        let mut table = Table::new(["physics", "where", "worth", "unseen stretches, in sd", ""]);
        for one in part {
            table.push([
                Cell::from(words(&one.physics)),
                said::place(&one.place).into(),
                number(one.worth).into(),
                one.unseen.map_or("–".to_string(), number).into(),
                if one.taken { Cell::tone("taken up in its round", Tone::Good) } else { Cell::from("not taken up") },
            ]);
        }
        table.caption(
            "Worth: rise of twice the log evidence beside what had been found until then; more than 10 is asked for. Unseen stretches: how much better those \
             are predicted that the fit has not seen. What was taken up can be exchanged or taken off later.",
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
        page.text("The logs were looked at for units, signs, swapped columns, told velocities that are no derivatives, and loads that never change: nothing was seen.");
        return;
    }
    let mut table = Table::new(["looked at", "where", "seen", "weight"]);
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
