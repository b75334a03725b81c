//! The report on joints that position servos drive.

use super::about::About;
use super::phrases::tone;
use crate::parts::{ending, file_name, sentence, todo};
use backdrive_answers::sentences::{alternatives, confidence, estimate, parameters};
use backdrive_diagnosis::verdict::words as said;
use backdrive_report::{Colour, Dash, Figure, Page, Plot, Series, Table, Tone, number};
use backdrive_servo::diagnose::{Answer, Found, Judged};
use backdrive_servo::problem::Problem;
use backdrive_servo::search::scored;
use backdrive_servo::sentences::words;

/// Records that are drawn of each joint.
const DRAWN: usize = 2;
/// Points in a line, at most.
const POINTS: usize = 3000;

/// The terms of the page.
const TERMS: [(&str, &str); 5] = [
    ("free run", "a simulation from the recorded commands only, starting at the first recorded position"),
    ("nrmse", "root mean square of the error over the standard deviation of the recorded position"),
    ("second order", "delay, inertia, damping and offset alone, fitted to the same recordings"),
    ("held out", "a recording that no fit uses; if there is none, each recording is simulated with a fit to the others"),
    ("force in rad", "over the servo's proportional gain: the angle between command and position that balances it"),
];

/// The report.
pub(super) fn page(problem: &Problem, found: &Found, about: &About) -> Page {
    let About { name, notes, steps } = about;
    let verdict = &found.verdict;
    let mut page = Page::new(&format!("Diagnosis of the servo joints of {name}"));
    page.lead(tone(verdict.word), &sentence(&verdict.sentence));
    let Some(servo) = &verdict.servo else { return page };
    todo(&mut page, steps);
    page.text(&sentence(&servo.scale));
    for note in *notes {
        page.note(&sentence(note));
    }
    for remark in &verdict.audit {
        page.warning(&sentence(&format!("{}: {}", remark.place, remark.message)));
    }

    page.section("What was found");
    let rows: Vec<Vec<String>> = verdict
        .findings
        .iter()
        .map(|f| {
            let (numbers, others) = (parameters(f).join(", "), alternatives(f, words).join(", "));
            vec![said::place(&f.place), words(&f.physics), numbers, confidence(f), others]
        })
        .collect();
    match rows.is_empty() {
        true => page.text("Nothing in addition to delay, second order and offset."),
        false => page.table(table(["where", "what", "parameters", "confidence", "alternatives"], rows)),
    };

    page.section("Free runs from the commands");
    let share = |x: Option<f64>| x.map_or("-".to_string(), |x| format!("{x:.3}"));
    let rows: Vec<Vec<String>> = servo
        .joints
        .iter()
        .map(|j| {
            let e = &j.errors;
            vec![
                j.joint.clone(),
                share(e.command),
                share(e.refit),
                share(e.diagnosed),
                number(1e3 * e.command_mae),
                number(1e3 * e.refit_mae),
                number(1e3 * e.diagnosed_mae),
            ]
        })
        .collect();
    page.table(table(
        ["joint", "nrmse: the command", "second order", "diagnosed", "mean error, mrad: the command", "second order", "diagnosed"],
        rows,
    ));
    for answer in &found.answers {
        drawn(&mut page, &problem.joints[answer.joint].name, answer);
    }

    page.section("Details");
    let rows: Vec<Vec<String>> = servo
        .joints
        .iter()
        .flat_map(|j| j.shared.iter().map(|s| vec![j.joint.clone(), sentence(&s.sentence), sentence(&s.separated_by)]))
        .collect();
    page.details("What these recordings do not separate", |inside| {
        inside.table(table(["joint", "not separated", "what separates them"], rows));
    });

    let rows: Vec<Vec<String>> = servo
        .joints
        .iter()
        .flat_map(|j| j.numbers.iter().map(|(key, e)| vec![j.joint.clone(), key.replace('_', " "), estimate(e)]))
        .collect();
    page.details("Parameters", |inside| {
        inside.table(table(["joint", "parameter", "value and 95 % interval"], rows));
    });
    ending(&mut page, &TERMS);
    page
}

fn table<const N: usize>(headers: [&str; N], rows: Vec<Vec<String>>) -> Table {
    rows.into_iter().fold(Table::new(headers), Table::row)
}

/// The records that move a joint most: command, recording, both free runs, and their errors.
fn drawn(page: &mut Page, joint: &str, answer: &Answer) {
    let mut order: Vec<&Judged> = answer.judged.iter().collect();
    let travel = |j: &Judged| backdrive_signal::statistics::deviation(&j.record.position);
    order.sort_by(|a, b| travel(b).total_cmp(&travel(a)));
    for judged in order.into_iter().take(DRAWN) {
        let record = &judged.record;
        let step = record.t.len().div_ceil(POINTS).max(1);
        let thin = |x: &[f64]| x.iter().step_by(step).copied().collect::<Vec<f64>>();
        let t = thin(&record.t);
        let line = |name: &str, y: &[f64], colour, dash| Series::line(name, &t, &thin(y)).colour(colour).dash(dash);
        let upper = Plot::new(joint)
            .x_axis("time", "s")
            .y_axis("position", "rad")
            .height(230.0)
            .series(line("command", &record.command, Colour::Muted, Dash::Dashed))
            .series(line("recorded", &record.position, Colour::Ink, Dash::Solid))
            .series(line("second order", &judged.refit, Colour::Nth(0), Dash::Dashed))
            .series(line("diagnosed", &judged.diagnosed, Colour::Nth(1), Dash::Solid));
        let error = |x: &[f64]| x.iter().zip(&record.position).map(|(s, p)| 1e3 * (s - p)).collect::<Vec<f64>>();
        let lower = Plot::new("")
            .x_axis("time", "s")
            .y_axis("error", "mrad")
            .height(190.0)
            .horizontal(0.0, "", Tone::Neutral)
            .series(line("second order", &error(&judged.refit), Colour::Nth(0), Dash::Dashed))
            .series(line("diagnosed", &error(&judged.diagnosed), Colour::Nth(1), Dash::Solid));
        let (share, mae) = scored(&judged.diagnosed, &record.position);
        let how = if answer.is_held_out { "held out" } else { "simulated with a fit to the other recordings" };
        page.figure(
            Figure::stacked([upper, lower]),
            &format!("{joint} in {}: {how}; nrmse {share:.3}, mean error {} mrad.", file_name(&record.name), number(1e3 * mae)),
        );
    }
}
