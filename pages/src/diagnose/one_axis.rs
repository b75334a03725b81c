//! The report on a device of one axis.

use super::about::About;
use super::phrases::{adds, tone};
use super::{force, held_out, tables};
use crate::parts::{ending, sentence, todo};
use backdrive_answers::sentences::{alternatives, confidence, errors, parameters, shows};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::belief::choice::chosen;
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::verdict::Verdict;
use backdrive_diagnosis::verdict::words;
use backdrive_report::{Cell, Page, Table, Tone, percent};

/// The report.
pub(super) fn page(found: &Diagnosis, about: &About) -> Page {
    let best = chosen(&found.search);
    let mut page = Page::new(&format!("Diagnosis of {} against {}", about.name, found.problem.model.name));
    page.lead(tone(found.verdict.word), &sentence(&found.verdict.sentence));
    page.text(&summary(found, adds(best)));
    todo(&mut page, about.steps);
    for note in about.notes {
        page.note(&sentence(note));
    }
    for remark in found.remarks.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&sentence(&remark.to_string()));
    }
    if found.search.cut {
        page.warning("The search was cut off by the clock (--patience) or interrupted: on another machine it may come to another verdict.");
    } else if found.search.exhausted {
        page.warning("The search ended before everything was tried.");
    }
    findings(&mut page, &found.verdict);
    page.section(if found.problem.held_out.is_empty() { "Recordings, as fitted" } else { "Recordings that no fit has seen" });
    held_out::section(&mut page, found, best);
    page.section("The force that is missing");
    force::section(&mut page, found, best);
    page.section("Every hypothesis that was tried");
    tables::hypotheses(&mut page, found, best);
    page.section("Parameters before and after");
    tables::numbers(&mut page, found, best);
    page.section("Each record by itself");
    tables::per_record(&mut page, found);
    page.section("The recordings themselves");
    tables::audit(&mut page, found);
    ending(&mut page, &TERMS);
    page
}

/// The terms of the page.
const TERMS: [(&str, &str); 8] = [
    ("residual", "what was measured less what a model predicts"),
    (
        "sensor noise",
        "standard deviation of the measuring error of an output, estimated from the recordings: a residual of 1 cannot be improved on",
    ),
    ("nrmse", "root mean square of the residual over the standard deviation of the measured signal"),
    ("held out", "a recording that no fit has seen"),
    ("refitted", "the same structure, its parameters fitted to the recordings"),
    ("diagnosed", "the structure with the physics that was found, all parameters fitted"),
    ("asked for by the recordings", "the force at a place that makes the model do what was recorded when the law found there is left out"),
    ("sd", "standard deviations of a parameter's own error"),
];

/// How far it is explained, and where it shows.
fn summary(found: &Diagnosis, added: bool) -> String {
    let (verdict, held) = (&found.verdict, &found.verdict.held_out);
    let mut text = String::new();
    let on = if found.problem.held_out.is_empty() { "the fitted recordings" } else { "the held-out recordings" };
    if let (Some(before), Some(refit), Some(after), Some(floor)) = (held.nrmse_before, held.nrmse_refit, held.nrmse_after, held.noise_floor)
    {
        // Where nothing was added, what is written as diagnosed is one of the two others.
        let diagnosed = if added { format!(", {} with the diagnosed model", percent(after)) } else { String::new() };
        text = format!(
            "On {on} the error is {} of what was measured with the model as given, {} with its parameters refitted{diagnosed}; the sensors' own \
             noise is {}.",
            percent(before),
            percent(refit),
            percent(floor)
        );
        let beyond = |x: f64| (x * x - floor * floor).max(0.0).sqrt();
        if added && beyond(refit) > floor && after < refit {
            text.push_str(&format!(
                " Of the error that refitting leaves beyond that noise, {} is removed.",
                percent(1.0 - beyond(after) / beyond(refit))
            ));
        }
    }
    if let Some(place) = verdict.shows.as_ref().filter(|_| !verdict.word.is_structure_right()) {
        text.push_str(&format!(" It shows {}.", shows(place)));
    }
    if let Some(errors) = errors(&verdict.error_budget) {
        text.push_str(&format!(" What is off in the prediction is partly {errors}."));
    }
    text
}

/// What is claimed.
fn findings(page: &mut Page, verdict: &Verdict) {
    let all = &verdict.findings;
    if all.is_empty() {
        return;
    }
    let replacing = all.iter().any(|f| !f.replaces.is_empty());
    let mut headers = vec![if verdict.word.claims() { "missing" } else { "nearest" }, "where", "parameters"];
    headers.extend(replacing.then_some("in place of"));
    headers.extend(["confidence", "or instead"]);
    let mut table = Table::new(headers);
    for finding in all {
        let sure = if finding.confidence > 0.8 { Tone::Good } else { Tone::Unsure };
        let mut row =
            vec![Cell::from(words::physics(&finding.physics)), words::place(&finding.place).into(), parameters(finding).join("; ").into()];
        row.extend(replacing.then(|| Cell::from(finding.replaces.join(", "))));
        row.extend([Cell::tone(confidence(finding), sure), alternatives(finding).join("; ").into()]);
        table.push(row);
    }
    page.table(table);
}
