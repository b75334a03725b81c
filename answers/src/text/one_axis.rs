//! What a diagnosis of one axis prints: a dozen lines for a person, from the same data as the verdict file.

use crate::sentences::{alternatives, described, errors, next_experiment, shows};
use backdrive_diagnosis::audit::Weight;
use backdrive_diagnosis::belief::intervals::Uncertainty;
use backdrive_diagnosis::belief::parameters::rows;
use backdrive_diagnosis::diagnose::Diagnosis;
use backdrive_diagnosis::verdict::words;
use backdrive_diagnosis::verdict::{HeldOut, Remaining};
use backdrive_report::{number, si};
use std::fmt::Write as _;

/// Remarks of the audit that are printed, at most; all are in the report.
const REMARKS: usize = 3;

/// The dozen lines.
pub(crate) fn text(found: &Diagnosis) -> String {
    let mut out = String::new();
    let mut line = |name: &str, text: String| {
        let _ = writeln!(out, "{name:<9} {text}");
    };
    let verdict = &found.verdict;
    line("audit", recordings(found));
    let mut cautions = found.remarks.iter().filter(|r| r.weight > Weight::Note);
    for remark in cautions.by_ref().take(REMARKS) {
        line("", remark.to_string());
    }
    match cautions.count() {
        0 => {}
        more => line("", format!("and {more} more cautions, see the report")),
    }
    if let Some(errors) = errors(&verdict.error_budget) {
        line("errors", errors);
    }
    line("refit", refit(found));
    line("verdict", format!("{}: {}", verdict.word.spoken().to_uppercase(), verdict.sentence));
    for finding in &verdict.findings {
        line(if verdict.word.claims() { "found" } else { "nearest" }, described(finding, words::physics));
        let others = alternatives(finding, words::physics);
        if !others.is_empty() {
            line("", format!("or instead {}", others.join(", ")));
        }
    }
    if let Some(place) = verdict.shows.as_ref().filter(|_| !verdict.word.is_structure_right()) {
        line("where", shows(place));
    }
    // Where nothing was found all of it remains, and it is reported above where it shows.
    if let Some(left) = verdict.remaining.as_ref().filter(|_| !verdict.findings.is_empty()).and_then(remains) {
        line("remains", left);
    }
    line(if found.problem.held_out.is_empty() { "fitted" } else { "held out" }, held_out(&verdict.held_out, found.search.noise()));
    if let Some(next) = &verdict.next_experiment {
        line("next", next_experiment(next));
    }
    if found.search.cut {
        line(
            "note",
            "the search was cut off by the clock (--patience) or interrupted: on another machine the verdict may differ".to_string(),
        );
    } else if found.search.exhausted {
        line("note", "the search ended before everything was tried".to_string());
    }
    out.trim_end().to_string()
}

/// What was recorded, in a line.
fn recordings(found: &Diagnosis) -> String {
    let problem = &found.problem;
    let all: Vec<_> = problem.fit.iter().chain(&problem.held_out).collect();
    let samples: usize = all.iter().map(|r| r.len).sum();
    let rate = all.first().map_or(0.0, |r| 1.0 / r.period);
    let measured = |output: usize| all.iter().any(|r| r.outputs.get(output).is_some_and(Option::is_some));
    let noises: Vec<String> = problem
        .model
        .outputs
        .iter()
        .zip(&problem.noise_sd)
        .enumerate()
        .filter(|(index, _)| measured(*index))
        .map(|(_, (output, floor))| {
            format!("{} {}", output.name, si(*floor, &backdrive_diagnosis::belief::parameters::unit_of_output(problem, &output.kind)))
        })
        .collect();
    format!(
        "{} recordings ({} held out), {samples} samples at {}; noise of {}",
        all.len(),
        problem.held_out.len(),
        si(rate, "Hz"),
        noises.join(", ")
    )
}

/// What refitting the parameters alone does.
fn refit(found: &Diagnosis) -> String {
    let search = &found.search;
    let level = |levels: &[f64]| levels.iter().fold(0.0f64, |a, b| a.max(*b));
    let noise = search.noise();
    let spread = Uncertainty::of(&search.nominal);
    let mut moved = rows(&found.problem, &search.nominal, &spread);
    moved.retain(|r| r.determined && r.moved_sd.is_some_and(f64::is_finite));
    moved.sort_by(|a, b| b.moved_sd.unwrap_or(0.0).abs().total_cmp(&a.moved_sd.unwrap_or(0.0).abs()));
    let most = moved.first().filter(|r| r.moved_sd.is_some_and(|s| s.abs() > 2.0)).map_or(String::new(), |r| {
        let given = r.given.unwrap_or(f64::NAN);
        format!("; {} moved most, {} to {} ({:.0} sd)", r.name, si(given, &r.unit), si(r.value, &r.unit), r.moved_sd.unwrap_or(0.0).abs())
    });
    format!(
        "residual {} times {noise} as given, {} with the parameters refitted{most}; {}",
        number(level(&search.levels_given)),
        number(level(&search.nominal.levels)),
        found.per_record.sentence()
    )
}

/// Errors of prediction before and after.
fn held_out(held: &HeldOut, noise: &str) -> String {
    let value = |x: Option<f64>| x.map_or("?".to_string(), number);
    format!(
        "nrmse {} as given, {} refitted, {} diagnosed; {noise} is {}",
        value(held.nrmse_before),
        value(held.nrmse_refit),
        value(held.nrmse_after),
        value(held.noise_floor)
    )
}

/// What the explanation leaves over, beside what was found; `None` where that is the sensors' noise.
fn remains(left: &Remaining) -> Option<String> {
    let place = shows(left.shows.as_ref()?);
    let share = left.share.map_or(String::new(), |s| {
        let floor = left.floor_share.map_or(String::new(), |f| format!(" (sensor noise: {})", words::share(f)));
        format!("{} of the residual with the parameters refitted{floor}; ", words::share(s))
    });
    let like = left.looks_like.as_ref().map_or(String::new(), |like| format!("; looks most like {like}"));
    Some(format!("{share}{place}{like}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backdrive_diagnosis::verdict::Where;

    #[test]
    fn what_remains_is_told_only_where_it_is_more_than_noise() {
        let noise = Remaining {
            share: Some(0.03),
            floor_share: Some(0.03),
            noise_sd: Some(1.01),
            not_repeated: None,
            shows: None,
            looks_like: None,
        };
        assert_eq!(remains(&noise), None);
        let left = Remaining {
            share: Some(0.31),
            floor_share: Some(0.06),
            noise_sd: Some(5.2),
            not_repeated: None,
            shows: Some(Where { time: vec![[1.0, 1.2]], band_hz: [20.0, 90.0], state: None, class: None }),
            looks_like: Some("backlash between motor and drum".to_string()),
        };
        let said = "31 % of the residual with the parameters refitted (sensor noise: 6 %); 20.0 Hz to 90.0 Hz; most at 1.00 to 1.20 s; \
                    looks most like backlash between motor and drum";
        assert_eq!(remains(&left).as_deref(), Some(said));
    }
}
