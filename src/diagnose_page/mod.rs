//! The report of `backdrive diagnose`: pictures first, the numbers beside them.

mod force;
mod held_out;
mod tables;

use crate::diagnose::Found;
use crate::diagnose_text::{named, next_experiment, parameter, place_of, shows};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::search::Candidate;
use backdrive_diagnosis::verdict::chosen;
use backdrive_report::{Cell, Page, Table, Tone, number, percent};
use serde_json::Value;

/// What a report shows.
pub struct Shown<'a> {
    /// What was found.
    pub found: &'a Found,
    /// The set, for the title.
    pub name: &'a str,
    /// What a reader should know first.
    pub notes: &'a [String],
}

/// The report.
pub fn page(shown: &Shown) -> Page {
    let found = shown.found;
    let json = &found.said.json;
    let best = chosen(&found.search);
    let mut page = Page::new(&format!("Diagnosis of {} against {}", shown.name, found.problem.model.name));
    page.lead(tone(json), &capital(&found.said.sentence));
    page.text(&summary(found));
    if let Some(next) = next_experiment(&json["next_experiment"]) {
        page.note(&format!("To record next: {next}"));
    }
    for note in shown.notes {
        page.note(&capital(note));
    }
    for remark in found.remarks.iter().filter(|r| r.weight > Weight::Note).take(4) {
        page.warning(&capital(&remark.to_string()));
    }
    if found.search.stopped {
        page.warning("The search ended before everything was tried.");
    }
    findings(&mut page, json);
    page.section(if found.problem.held_out.is_empty() { "Recordings, as fitted" } else { "Recordings that no fit has seen" });
    held_out::section(&mut page, found, best);
    page.section("The force that is missing");
    force::section(&mut page, found, best);
    page.section("Every hypothesis that was tried");
    tables::hypotheses(&mut page, found, best);
    page.section("Numbers before and after");
    tables::numbers(&mut page, found, best);
    page.section("Each record by itself");
    tables::per_record(&mut page, found);
    page.section("The recordings themselves");
    tables::audit(&mut page, found);
    page
}

/// The physics that a candidate adds, or nothing.
fn adds(candidate: &Candidate) -> bool {
    !candidate.structure.added.is_empty()
}

fn tone(json: &Value) -> Tone {
    match json["verdict"].as_str() {
        Some("nothing_missing") => Tone::Good,
        Some("parameters") => Tone::Limited,
        Some("missing") => Tone::Warning,
        Some("ambiguous" | "cannot_tell") => Tone::Unsure,
        _ => Tone::Bad,
    }
}

/// How far it is explained, and where it shows.
fn summary(found: &Found) -> String {
    let json = &found.said.json;
    let held = &json["held_out"];
    let of = |key: &str| held[key].as_f64();
    let mut text = String::new();
    let on = if found.problem.held_out.is_empty() { "the fitted recordings" } else { "the held-out recordings" };
    if let (Some(before), Some(refit), Some(after), Some(floor)) =
        (of("nrmse_before"), of("nrmse_refit"), of("nrmse_after"), of("noise_floor"))
    {
        text = format!(
            "On {on} the error is {} of what was measured with the model as given, {} with its numbers refitted, {} with the diagnosed model; \
             the sensors' own noise is {}.",
            percent(before),
            percent(refit),
            percent(after),
            percent(floor)
        );
        let beyond = |x: f64| (x * x - floor * floor).max(0.0).sqrt();
        if beyond(refit) > floor && after < refit {
            text.push_str(&format!(
                " Of the error that refitting leaves beyond that noise, {} is removed.",
                percent(1.0 - beyond(after) / beyond(refit))
            ));
        }
    }
    let quiet = matches!(json["verdict"].as_str(), Some("nothing_missing" | "parameters"));
    if !quiet && json["where"].is_object() {
        text.push_str(&format!(" It shows {}.", shows(&json["where"])));
    }
    text
}

/// What is claimed.
fn findings(page: &mut Page, json: &Value) {
    let all = json["findings"].as_array().map_or(&[][..], Vec::as_slice);
    if all.is_empty() {
        return;
    }
    let claimed = matches!(json["verdict"].as_str(), Some("missing" | "ambiguous"));
    let mut table =
        Table::new([if claimed { "missing" } else { "nearest" }, "where", "numbers", "in place of", "confidence", "or instead"]);
    for finding in all {
        let numbers: Vec<String> = finding["parameters"]
            .as_object()
            .map(|p| p.iter().map(|(key, value)| format!("{} {}", key.replace('_', " "), parameter(value))).collect())
            .unwrap_or_default();
        let replaced: Vec<&str> = finding["replaces"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let others: Vec<String> = finding["alternatives"]
            .as_array()
            .into_iter()
            .flatten()
            .take(3)
            .map(|a| format!("{} ({})", named(a), number(a["confidence"].as_f64().unwrap_or(0.0))))
            .collect();
        let confidence = finding["confidence"].as_f64().unwrap_or(0.0);
        let sure = if confidence > 0.8 { Tone::Good } else { Tone::Unsure };
        table.push([
            Cell::from(finding["physics"].as_str().unwrap_or("?").replace('_', " ")),
            place_of(finding).into(),
            numbers.join("; ").into(),
            replaced.join(", ").into(),
            Cell::tone(number(confidence), sure),
            others.join("; ").into(),
        ]);
    }
    page.table(table);
}

/// A sentence from a clause: its first letter large, a full stop at its end.
fn capital(clause: &str) -> String {
    let mut chars = clause.chars();
    let first: String = chars.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    let stop = if clause.is_empty() || clause.ends_with(['.', '!', '?', ':']) { "" } else { "." };
    format!("{first}{}{stop}", chars.as_str())
}
