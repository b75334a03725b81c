//! The report on a device of one axis.

use super::about::About;
use super::phrases::{adds, tone};
use super::{force, held_out, tables};
use crate::parts::{ending, sentence, todo};
use backdrive_answers::sentences::{alternatives, confidence, errors, parameters, shows};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::belief::choice::chosen;
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::output_error::candidate::Candidate;
use backdrive_diagnosis::verdict::Verdict;
use backdrive_diagnosis::verdict::words;
use backdrive_report::{Cell, Page, Table, Tone, percent};

/// The report.
pub(super) fn page(found: &Diagnosis, about: &About) -> Page {
    let best = chosen(&found.search);
    let model = &found.problem.model.name;
    let against = if about.name == *model { String::new() } else { format!(" against the model {model}") };
    let mut page = Page::new(&format!("Diagnosis of {}{against}", about.name));
    page.lead(tone(found.verdict.word), &sentence(&found.verdict.sentence));
    todo(&mut page, about.steps);
    page.text(&summary(found, adds(best)));
    for note in about.notes {
        page.note(&sentence(note));
    }
    for remark in found.remarks.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&sentence(&remark.to_string()));
    }
    if found.search.cut {
        page.warning("The search was cut off by the clock (--patience) or interrupted: on another machine the verdict may differ.");
    } else if found.search.exhausted {
        page.warning("The search ended before everything was tried.");
    }
    findings(&mut page, &found.verdict);
    // Where something was found, its force is the picture that shows it first.
    let sections: [fn(&mut Page, &Diagnosis, &Candidate); 2] = if adds(best) { [force, predictions] } else { [predictions, force] };
    sections.into_iter().for_each(|section| section(&mut page, found, best));
    page.section("Details");
    page.details("All hypotheses", |inside| tables::hypotheses(inside, found, best));
    page.details("Parameters before and after", |inside| tables::numbers(inside, found, best));
    page.details("Each record alone", |inside| tables::per_record(inside, found));
    page.details("Checks of the recordings", |inside| tables::audit(inside, found));
    ending(&mut page, &TERMS);
    page
}

/// The force that the nominal model lacks.
fn force(page: &mut Page, found: &Diagnosis, best: &Candidate) {
    page.section("The missing force");
    force::section(page, found, best);
}

/// What the models predict of each recording.
fn predictions(page: &mut Page, found: &Diagnosis, best: &Candidate) {
    page.section(if found.problem.held_out.is_empty() { "Recordings, as fitted" } else { "Held-out recordings" });
    held_out::section(page, found, best);
}

/// The terms of the page.
const TERMS: [(&str, &str); 8] = [
    ("residual", "the measured signal minus the predicted signal"),
    (
        "sensor noise",
        "standard deviation of the measuring error of an output, estimated from the recordings: a residual of 1 cannot be reduced further",
    ),
    ("nrmse", "root mean square of the residual over the standard deviation of the measured signal"),
    ("held out", "a recording that no fit uses"),
    ("refitted", "the same structure, its parameters fitted to the recordings"),
    ("diagnosed", "the structure with the effects found, all parameters fitted"),
    ("required by the recordings", "the force at a place that makes the model without the law found there reproduce the recording"),
    ("sd", "standard deviations of a parameter's estimate"),
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
            "On {on} the error is {} of the measured signal with the model as given, {} with its parameters refitted{diagnosed}; the \
             sensor noise is {}.",
            percent(before),
            percent(refit),
            percent(floor)
        );
        let beyond = |x: f64| (x * x - floor * floor).max(0.0).sqrt();
        if added && beyond(refit) > floor && after < refit {
            text.push_str(&format!(
                " The findings remove {} of the refitted model's error above that noise.",
                percent(1.0 - beyond(after) / beyond(refit))
            ));
        }
    }
    if let Some(place) = verdict.shows.as_ref().filter(|_| !verdict.word.is_structure_right()) {
        text.push_str(&format!(" The missing effect appears at: {}.", shows(place)));
    }
    if let Some(errors) = errors(&verdict.error_budget) {
        text.push_str(&format!(" The prediction error is partly {errors}."));
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
    headers.extend(["confidence", "alternatives"]);
    let mut table = Table::new(headers);
    for finding in all {
        let sure = if finding.confidence > 0.8 { Tone::Good } else { Tone::Unsure };
        let mut row =
            vec![Cell::from(words::physics(&finding.physics)), words::place(&finding.place).into(), parameters(finding).join("; ").into()];
        row.extend(replacing.then(|| Cell::from(finding.replaces.join(", "))));
        row.extend([Cell::tone(confidence(finding), sure), alternatives(finding, words::physics).join("; ").into()]);
        table.push(row);
    }
    page.table(table);
}
